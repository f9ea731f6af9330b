"""48 small stochastic simulators with unknown parameters, to put a likelihood-free inference tool to the test.

Each takes parameters (M, P) and a numpy Generator and gives (M, T, D), one recording for each row of parameters.
Two have exactly equivalent parameters that no finite list can hold; there `solutions` gives the truth alone:
  ridge_fluorescence    only concentration x brightness shows: a whole curve of solutions
  irrelevant_aftershock `threshold` is never used: any value of it is a solution
"""

from collections.abc import Callable
from itertools import permutations
from typing import NamedTuple

import numpy as np


class System(NamedTuple):
    """A simulator, ranges of its parameters, narrower ones for truths, its kind, and all solutions of a truth."""

    simulate: Callable
    ranges: dict
    truths: tuple
    kind: str
    solutions: Callable


def registrar(systems: dict[str, System]) -> Callable:
    """Return a decorator that registers simulators in `systems`.

    Its parameters are name=(low, high, true low, true high); others(truth) gives the further solutions.
    """

    def system(kind, others=None, **parameters):
        ranges = {name: (float(v[0]), float(v[1])) for name, v in parameters.items()}
        truths = tuple((float(v[2]), float(v[3])) for v in parameters.values())

        def inside(values):
            return all(low <= values[name] <= high for name, (low, high) in ranges.items())

        def solutions(truth):
            truth = {name: float(truth[name]) for name in ranges}
            further = [dict(other) for other in others(truth)] if others else []
            return [values for values in [truth, *further] if inside(values)]

        def register(function):
            def simulate(parameters, rng):
                parameters = np.asarray(parameters, dtype=np.float64)
                if parameters.ndim != 2 or parameters.shape[1] != len(ranges):
                    name, size = function.__name__, len(ranges)
                    raise ValueError(f"{name} takes parameters of shape (M, {size})")
                return np.asarray(function(parameters, rng), dtype=np.float64)

            simulate.__name__, simulate.__doc__ = function.__name__, function.__doc__
            systems[function.__name__] = System(simulate, ranges, truths, kind, solutions)
            return simulate

        return register

    return system


SYSTEMS: dict[str, System] = {}
system = registrar(SYSTEMS)


def swapped(groups):
    """All other relabelings of the parts; groups: a tuple of names for each part, in the same order."""

    def others(truth):
        for order in permutations(range(len(groups))):
            if order != tuple(range(len(groups))):
                new = dict(truth)
                for part, source in zip(groups, order, strict=False):
                    new.update(
                        {name: truth[old] for name, old in zip(part, groups[source], strict=False)}
                    )
                yield new

    return others


def two_states(leave_a, leave_b, steps, rng):
    """A stationary two-state Markov chain, (M, steps) of bool: True in state b; leave_* are probabilities per step."""
    uniform = rng.random((len(leave_a), steps))
    states = np.empty(uniform.shape, dtype=bool)
    now = uniform[:, 0] < leave_a / (leave_a + leave_b)
    states[:, 0] = now
    for t in range(1, steps):
        now = now ^ (uniform[:, t] < np.where(now, leave_b, leave_a))
        states[:, t] = now
    return states


def columns(parameters):
    """The parameters as P arrays (M, 1), to meet (M, T)."""
    return [parameters[:, [j]] for j in range(parameters.shape[1])]


def thinned(n, p, rng):
    """Binomial draws of float n."""
    return rng.binomial(n.astype(np.int64), np.clip(p, 0.0, 1.0))


# ---------------------------------------------------------------- counts


@system("counts", base=(0.5, 20, 3, 10), swing=(0, 2, 0.4, 1.2), peak=(0, 24, 7, 17))
def counts_arrivals(parameters, rng):
    """Poisson arrivals at an emergency room by the hour, log rate with a daily cosine; queueing practice."""
    base, swing, peak = columns(parameters)
    hours = np.arange(24) + 0.5
    return rng.poisson(base * np.exp(swing * np.cos(2 * np.pi * (hours - peak) / 24)))[..., None]


@system("counts", gene_a=(0.1, 30, 3, 15), gene_b=(0.1, 30, 3, 15), shape=(0.3, 10, 0.8, 4))
def counts_two_genes(parameters, rng):
    """Overdispersed read counts of two genes in 8 cells, a gamma size factor shared by both genes; single-cell RNA."""
    a, b, shape = columns(parameters)
    size = rng.gamma(np.broadcast_to(shape, (len(a), 8))) / shape
    return np.stack([rng.poisson(a * size), rng.poisson(b * size)], axis=-1)


@system("counts", empty=(0, 0.95, 0.25, 0.7), rate=(0.1, 15, 1.5, 7))
def counts_insect_traps(parameters, rng):
    """Zero-inflated Poisson catches of 20 insect traps, a part of them never visited; ecology."""
    empty, rate = columns(parameters)
    visited = rng.random((len(rate), 20)) >= empty
    return (rng.poisson(np.broadcast_to(rate, visited.shape)) * visited)[..., None]


@system(
    "counts", mean=(0.5, 40, 5, 20), trend=(-0.15, 0.15, -0.08, 0.08), dispersion=(0.2, 20, 0.8, 6)
)
def counts_accidents(parameters, rng):
    """Negative binomial road accidents over 12 months with a log-linear trend; traffic safety."""
    mean, trend, size = columns(parameters)
    mu = mean * np.exp(trend * (np.arange(12) - 5.5))
    return rng.negative_binomial(np.broadcast_to(size, mu.shape), size / (size + mu))[..., None]


@system("counts", log_ed50=(-3, 3, -1, 1), slope=(0.2, 5, 0.8, 3), background=(0, 0.4, 0.03, 0.2))
def counts_dose_response(parameters, rng):
    """Binomial deaths out of 40 animals at 7 log doses with natural mortality (Abbott); toxicology."""
    ed50, slope, background = columns(parameters)
    p = background + (1 - background) / (1 + np.exp(-slope * (np.linspace(-3, 3, 7) - ed50)))
    return rng.binomial(40, np.clip(p, 0, 1))[..., None]


@system(
    "counts", birth=(0, 0.3, 0.05, 0.2), death=(0.02, 0.6, 0.15, 0.4), immigration=(0.1, 10, 1, 6)
)
def counts_birth_death(parameters, rng):
    """Birth, death and immigration of a small population counted 40 times from 10 animals; population ecology."""
    birth, death, immigration = parameters.T
    n, out = np.full(len(birth), 10), []
    for _ in range(40):
        n = thinned(n, np.exp(-death), rng) + rng.poisson(birth * n + immigration)
        out.append(n)
    return np.stack(out, axis=1)[..., None]


# ---------------------------------------------------------------- ridges


@system("ridge", n=(5, 100, 15, 50), p=(0.02, 0.98, 0.15, 0.6))
def ridge_binomial(parameters, rng):
    """Binomial with unknown n and p (between whole numbers n is one of its two neighbors); synaptic release, wildlife counts."""
    n, p = columns(parameters)
    whole = np.floor(n + rng.random((len(n), 10))).astype(np.int64)
    return rng.binomial(whole, p)[..., None]


@system(
    "ridge",
    concentration=(0.1, 10, 1, 4),
    brightness=(0.1, 10, 1, 4),
    bleaching=(0.005, 0.3, 0.03, 0.15),
)
def ridge_fluorescence(parameters, rng):
    """Bleaching dye, of which only concentration x brightness shows (an exact ridge); microscopy."""
    c, b, k = columns(parameters)
    clean = c * b * np.exp(-k * np.arange(30))
    return (
        clean * np.exp(0.1 * rng.standard_normal(clean.shape))
        + 0.05 * rng.standard_normal(clean.shape)
    )[..., None]


@system("ridge", rate=(1, 100, 15, 50), duration=(0.05, 1.5, 0.2, 0.6))
def ridge_busy_lines(parameters, rng):
    """Busy telephone lines (M/M/infinity) looked at 25 times, so rarely that rate x duration shows above all; queueing."""
    rate, duration = parameters.T
    stay = np.exp(-1 / duration)
    n, out = rng.poisson(rate * duration), []
    for _ in range(25):
        out.append(n)
        n = thinned(n, stay, rng) + rng.poisson(rate * duration * (1 - stay))
    return np.stack(out, axis=1)[..., None]


@system("ridge", vmax=(1, 100, 20, 50), km=(5, 200, 40, 100))
def ridge_michaelis_menten(parameters, rng):
    """Enzyme rate at substrate far below saturation, where vmax / km shows above all; biochemistry."""
    vmax, km = columns(parameters)
    s = np.array([0.5, 1, 2, 4, 8, 12, 16, 20])
    v = vmax * s / (km + s)
    return (v * (1 + 0.03 * rng.standard_normal(v.shape)) + 0.1 * rng.standard_normal(v.shape))[
        ..., None
    ]


# ---------------------------------------------------------------- exchangeable


@system(
    "exchangeable",
    swapped([("leave_a", "speed_a"), ("leave_b", "speed_b")]),
    leave_a=(0.01, 0.6, 0.03, 0.12),
    leave_b=(0.01, 0.6, 0.2, 0.4),
    speed_a=(0.05, 3, 0.2, 0.6),
    speed_b=(0.05, 3, 1.2, 2.4),
)
def exchangeable_two_speeds(parameters, rng):
    """Diffusion in the plane whose speed switches between two hidden states; single-particle tracking."""
    leave_a, leave_b, speed_a, speed_b = parameters.T
    states = two_states(leave_a, leave_b, 100, rng)
    speed = np.where(states, speed_b[:, None], speed_a[:, None])
    return np.cumsum(speed[..., None] * rng.standard_normal((*states.shape, 2)), axis=1)


@system(
    "exchangeable",
    swapped([("fast",), ("slow",)]),
    fast=(0.01, 1, 0.3, 0.7),
    slow=(0.01, 1, 0.03, 0.12),
)
def exchangeable_two_decays(parameters, rng):
    """Sum of two exponential decays of equal amplitude in noise; fluorescence lifetimes."""
    k1, k2 = columns(parameters)
    t = np.arange(40)
    return (np.exp(-k1 * t) + np.exp(-k2 * t) + 0.05 * rng.standard_normal((len(k1), 40)))[
        ..., None
    ]


def _mixture_swap(truth):
    return [
        {
            "weight_a": 1 - truth["weight_a"],
            "mean_a": truth["mean_b"],
            "mean_b": truth["mean_a"],
            "sd_a": truth["sd_b"],
            "sd_b": truth["sd_a"],
        }
    ]


@system(
    "exchangeable",
    _mixture_swap,
    weight_a=(0.05, 0.95, 0.25, 0.45),
    mean_a=(-5, 5, -3, -1),
    mean_b=(-5, 5, 1, 3),
    sd_a=(0.2, 3, 0.4, 1),
    sd_b=(0.2, 3, 0.8, 1.6),
)
def exchangeable_two_normals(parameters, rng):
    """Mixture of two normals with unknown weight, means and spreads, 10 draws a recording; eruption times, body sizes."""
    w, ma, mb, sa, sb = columns(parameters)
    a = rng.random((len(w), 10)) < w
    return (np.where(a, ma, mb) + np.where(a, sa, sb) * rng.standard_normal(a.shape))[..., None]


@system(
    "exchangeable",
    swapped([("leave_a", "speed_a", "turn_a"), ("leave_b", "speed_b", "turn_b")]),
    leave_a=(0.01, 0.5, 0.03, 0.1),
    leave_b=(0.01, 0.5, 0.1, 0.3),
    speed_a=(0.05, 3, 1.2, 2.4),
    speed_b=(0.05, 3, 0.2, 0.8),
    turn_a=(0.02, 2, 0.05, 0.3),
    turn_b=(0.02, 2, 0.7, 1.5),
)
def exchangeable_forager(parameters, rng):
    """Animal path of two hidden modes (travel, search), each with its speed, turning and leaving rate; movement ecology."""
    la, lb, va, vb, ta, tb = parameters.T
    states = two_states(la, lb, 120, rng)
    turn = np.where(states, tb[:, None], ta[:, None]) * rng.standard_normal(states.shape)
    heading = 2 * np.pi * rng.random((len(la), 1)) + np.cumsum(turn, axis=1)
    step = np.where(states, vb[:, None], va[:, None]) * (
        1 + 0.15 * rng.standard_normal(states.shape)
    )
    return np.cumsum(np.stack([step * np.cos(heading), step * np.sin(heading)], axis=-1), axis=1)


@system(
    "exchangeable",
    swapped([("x1", "y1"), ("x2", "y2"), ("x3", "y3")]),
    x1=(-5, 5, -3.5, -1.5),
    y1=(-5, 5, -3, -1),
    x2=(-5, 5, 1.5, 3.5),
    y2=(-5, 5, -3, -1),
    x3=(-5, 5, -1, 1),
    y3=(-5, 5, 1.5, 3.5),
)
def exchangeable_three_clusters(parameters, rng):
    """Points in the plane from three clusters of equal weight (six solutions); calls from three nests."""
    centers = parameters.reshape(-1, 3, 2)
    which = rng.integers(3, size=(len(centers), 20))
    return centers[np.arange(len(centers))[:, None], which] + 0.6 * rng.standard_normal(
        (*which.shape, 2)
    )


# ---------------------------------------------------------------- mirrored


@system(
    "mirrored",
    lambda t: [dict(t, detuning=-t["detuning"])],
    detuning=(-2, 2, 0.4, 1.3),
    brightness=(20, 500, 100, 300),
)
def mirrored_detuning(parameters, rng):
    """Photon counts of an atom under rising laser power; the detuning enters by its square; spectroscopy."""
    detuning, brightness = columns(parameters)
    power = np.geomspace(0.1, 30, 20)
    return rng.poisson(brightness * power / (1 + 4 * detuning**2 + power))[..., None]


@system(
    "mirrored",
    lambda t: [dict(t, angle=t["angle"] + np.pi)],
    angle=(0, 2 * np.pi, 0.5, 2.6),
    major=(1.5, 5, 2, 4),
    minor=(0.2, 1.4, 0.4, 1.1),
)
def mirrored_ellipse(parameters, rng):
    """Scatter in the plane along an axis, whose angle is the same half a turn on; pollen, fibers, dispersal along a valley."""
    angle, major, minor = columns(parameters)
    u, v = rng.standard_normal((2, len(angle), 12))
    u, v = major * u, minor * v
    return np.stack(
        [u * np.cos(angle) - v * np.sin(angle), u * np.sin(angle) + v * np.cos(angle)], axis=-1
    )


@system(
    "mirrored",
    lambda t: [dict(t, elevation=90 - t["elevation"])],
    elevation=(5, 85, 53, 75),
    speed=(5, 60, 15, 40),
    spread=(0.01, 0.3, 0.03, 0.12),
)
def mirrored_projectile(parameters, rng):
    """Metered speed and landing distance of 5 shots; elevations mirrored at 45 degrees land alike; ballistics."""
    elevation, speed, spread = columns(parameters)
    v = speed * np.exp(spread * rng.standard_normal((len(speed), 5)))
    meter = v * (1 + 0.03 * rng.standard_normal(v.shape))
    distance = v**2 * np.sin(2 * np.deg2rad(elevation)) / 9.81
    return np.stack([meter, distance + 0.5 * rng.standard_normal(v.shape)], axis=-1)


@system(
    "mirrored",
    lambda t: [{name: -value for name, value in t.items()}],
    load_a=(-2, 2, 0.6, 1.5),
    load_b=(-2, 2, -1.5, -0.5),
    load_c=(-2, 2, 0.5, 1.2),
)
def mirrored_loadings(parameters, rng):
    """Three test scores upon one hidden drifting factor; all loadings may change sign together; psychometrics."""
    shocks = rng.standard_normal((len(parameters), 15))
    factor = np.empty_like(shocks)
    factor[:, 0] = shocks[:, 0]
    for t in range(1, 15):
        factor[:, t] = 0.7 * factor[:, t - 1] + np.sqrt(1 - 0.7**2) * shocks[:, t]
    return factor[..., None] * parameters[:, None, :] + 0.5 * rng.standard_normal(
        (len(parameters), 15, 3)
    )


# ---------------------------------------------------------------- correlated


def _design(n, p, shared, seed):
    """A fixed design (n, p) whose columns have the correlation `shared`."""
    rng = np.random.default_rng(seed)
    return np.sqrt(shared) * rng.standard_normal((n, 1)) + np.sqrt(
        1 - shared
    ) * rng.standard_normal((n, p))


_LOGIT4, _LOGIT10, _LINEAR6 = (
    _design(200, 4, 0.9, 41),
    _design(250, 10, 0.8, 42),
    _design(120, 6, 0.95, 43),
)


@system("correlated", **{f"w{j + 1}": (-3, 3, -1.5, 1.5) for j in range(4)})
def correlated_logistic4(parameters, rng):
    """Logistic model of 200 subjects upon 4 signals correlated at 0.9, told by the sums of y x_j; epidemiology."""
    p = 1 / (1 + np.exp(-parameters @ _LOGIT4.T))
    return ((rng.random(p.shape) < p) @ _LOGIT4)[:, None, :]


@system("correlated", **{f"w{j + 1}": (-2, 2, -1, 1) for j in range(10)})
def correlated_logistic10(parameters, rng):
    """Logistic model of 250 choices upon 10 signals correlated at 0.8, told by the sums of y x_j; discrete choice."""
    p = 1 / (1 + np.exp(-parameters @ _LOGIT10.T))
    return ((rng.random(p.shape) < p) @ _LOGIT10)[:, None, :]


@system("correlated", **{f"w{j + 1}": (-4, 4, -2, 2) for j in range(6)})
def correlated_linear6(parameters, rng):
    """Linear model upon 6 signals correlated at 0.95, three blocks of 40 rows told by their sums of y x_j; near-infrared assay."""
    y = parameters @ _LINEAR6.T + rng.standard_normal((len(parameters), 120))
    return np.stack([y[:, i : i + 40] @ _LINEAR6[i : i + 40] for i in (0, 40, 80)], axis=1)


@system(
    "correlated",
    a11=(0, 0.9, 0.2, 0.6),
    a12=(-0.5, 0.5, -0.25, 0.25),
    a21=(-0.5, 0.5, -0.25, 0.25),
    a22=(0, 0.9, 0.2, 0.6),
)
def correlated_var(parameters, rng):
    """Vector autoregression of two signals with shocks correlated at 0.95; macroeconomics."""
    matrix = parameters.reshape(-1, 2, 2)
    z = rng.standard_normal((40, len(matrix), 2))
    z[..., 1] = 0.95 * z[..., 0] + np.sqrt(1 - 0.95**2) * z[..., 1]
    x, out = np.zeros((len(matrix), 2)), []
    for shock in z:
        x = np.einsum("mij,mj->mi", matrix, x) + shock
        out.append(x)
    return np.stack(out, axis=1)


@system(
    "correlated",
    offset_a=(-3, 3, -1.5, 1.5),
    offset_b=(-3, 3, -1.5, 1.5),
    offset_c=(-3, 3, -1.5, 1.5),
    drift=(-0.3, 0.3, -0.15, 0.15),
    shared=(0, 0.99, 0.7, 0.95),
)
def correlated_thermometers(parameters, rng):
    """Three drifting thermometers side by side whose noise is mostly shared; metrology."""
    drift, shared = parameters[:, 3], parameters[:, 4][:, None, None]
    noise = np.sqrt(shared) * rng.standard_normal((len(drift), 20, 1)) + np.sqrt(
        1 - shared
    ) * rng.standard_normal((len(drift), 20, 3))
    return parameters[:, None, :3] + (drift[:, None] * np.arange(20))[..., None] + noise


# ---------------------------------------------------------------- heavy tails


@system("tails", tail=(0.7, 3.5, 1.1, 2.4), shortest=(0.05, 3, 0.3, 1.5))
def tails_levy_flight(parameters, rng):
    """Levy flight in the plane, step lengths Pareto; foraging albatross."""
    tail, shortest = columns(parameters)
    step = shortest * (1 - rng.random((len(tail), 100))) ** (-1 / tail)
    angle = 2 * np.pi * rng.random(step.shape)
    return np.cumsum(np.stack([step * np.cos(angle), step * np.sin(angle)], axis=-1), axis=1)


@system("tails", drift=(-1, 1, -0.3, 0.3), scale=(0.05, 5, 0.5, 2), freedom=(1.5, 15, 2.2, 6))
def tails_student_returns(parameters, rng):
    """Student t daily returns with unknown drift, scale and degrees of freedom; finance."""
    drift, scale, freedom = columns(parameters)
    return (drift + scale * rng.standard_t(np.broadcast_to(freedom, (len(drift), 60))))[..., None]


@system("tails", claims=(0.2, 20, 2, 10), tail=(0.8, 5, 1.3, 3), deductible=(0.1, 5, 0.5, 2.5))
def tails_insurance(parameters, rng):
    """Number and total of Pareto claims in each of 12 months; reinsurance."""
    claims, tail, deductible = columns(parameters)
    n = rng.poisson(np.broadcast_to(claims, (len(claims), 12)))
    sizes = (1 - rng.random((*n.shape, max(int(n.max()), 1)))) ** (-1 / tail[..., None])
    total = deductible * np.where(np.arange(sizes.shape[-1]) < n[..., None], sizes, 0).sum(axis=-1)
    return np.stack([n, total], axis=-1)


@system(
    "tails",
    stability=(1.1, 1.95, 1.3, 1.75),
    skew=(-0.95, 0.95, -0.6, 0.6),
    scale=(0.1, 5, 0.5, 2),
    location=(-5, 5, -2, 2),
)
def tails_stable(parameters, rng):
    """Alpha-stable noise with skew (Chambers, Mallows and Stuck), 40 draws a recording; radar clutter."""
    alpha, skew, scale, location = columns(parameters)
    u = np.pi * (rng.random((len(alpha), 40)) - 0.5)
    e = np.maximum(rng.exponential(size=u.shape), 1e-12)
    zeta = skew * np.tan(np.pi * alpha / 2)
    xi = np.arctan(zeta) / alpha
    inner = np.maximum(np.cos(u - alpha * (u + xi)), 1e-12) / e
    x = (
        (1 + zeta**2) ** (1 / (2 * alpha))
        * np.sin(alpha * (u + xi))
        / np.maximum(np.cos(u), 1e-12) ** (1 / alpha)
    )
    return (location + scale * x * inner ** ((1 - alpha) / alpha))[..., None]


# ---------------------------------------------------------------- deterministic


@system(
    "deterministic",
    prey_growth=(0.3, 1.5, 0.6, 1.2),
    predation=(0.2, 1.5, 0.4, 1),
    predator_death=(0.3, 1.5, 0.6, 1.2),
    conversion=(0.2, 1.5, 0.4, 1),
)
def deterministic_lotka_volterra(parameters, rng):
    """Lotka-Volterra predator and prey without any noise, from (1.5, 1); textbook ODE fit."""
    a, b, c, d = parameters.T

    own, other = np.stack([a, -c]), np.stack([-b, d])

    def slope(x):
        return own + other * np.exp(x[::-1])

    x, out, h = np.log(np.array([[1.5], [1.0]])) * np.ones((2, len(a))), [], 0.1
    for _ in range(60):
        for _ in range(3):
            k1 = slope(x)
            k2 = slope(x + h / 2 * k1)
            k3 = slope(x + h / 2 * k2)
            k4 = slope(x + h * k3)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        out.append(np.exp(x).T)
    return np.stack(out, axis=1)


@system("deterministic", growth=(3.5, 4, 3.62, 3.97))
def deterministic_logistic_map(parameters, rng):
    """Chaotic logistic map from a random start, nothing else random; May's populations."""
    growth = parameters[:, 0]
    x, out = rng.uniform(0.1, 0.9, len(growth)), []
    for _ in range(100):
        x = growth * x * (1 - x)
        out.append(x)
    return np.stack(out, axis=1)[..., None]


@system(
    "deterministic",
    damping=(0, 0.5, 0.05, 0.3),
    frequency=(0.2, 3, 0.6, 2),
    phase=(-1.5, 1.5, -0.8, 0.8),
)
def deterministic_ringdown(parameters, rng):
    """Damped ringing told to a millionth (noise 1e-6); mechanical resonators."""
    damping, frequency, phase = columns(parameters)
    t = 0.25 * np.arange(80)
    return (
        np.exp(-damping * t) * np.cos(frequency * t + phase)
        + 1e-6 * rng.standard_normal((len(phase), 80))
    )[..., None]


# ---------------------------------------------------------------- many parameters


@system("many", **{f"growth_{j + 1}": (0, 1.2, 0.25, 0.9) for j in range(12)})
def many_plate(parameters, rng):
    """Growth rates of 12 wells of a plate, read 8 times as log density with a shared batch error; microbiology."""
    m = len(parameters)
    batch = 0.3 * rng.standard_normal((m, 8, 1))
    level = -3 + 0.3 * rng.standard_normal((m, 1, 12))
    return (
        level
        + 0.7 * np.arange(8)[:, None] * parameters[:, None, :]
        + batch
        + 0.1 * rng.standard_normal((m, 8, 12))
    )


@system("many", **{f"species_{j + 1}": (-1, 4, 0.3, 3) for j in range(10)})
def many_species(parameters, rng):
    """Counts of 10 species at one visit to a site whose quality is common to all; community ecology (T=1)."""
    site = 0.6 * rng.standard_normal((len(parameters), 1))
    return rng.poisson(np.exp(parameters + site))[:, None, :]


@system(
    "many",
    r0=(0.8, 6, 1.8, 4),
    latent=(1, 10, 2, 6),
    infectious=(2, 14, 4, 9),
    reported=(0.02, 0.9, 0.15, 0.6),
    seeds=(1, 100, 10, 60),
    lockdown=(0, 0.9, 0.2, 0.7),
    hospital=(0.002, 0.2, 0.02, 0.1),
    dispersion=(0.5, 30, 3, 15),
)
def many_epidemic(parameters, rng):
    """SEIR epidemic of 20,000 with a lockdown on day 25: reported cases, admissions and a daily swab of 200; public health."""
    r0, latent, infectious, reported, seeds, lockdown, hospital, dispersion = parameters.T
    size, days = 20000, 60
    i = np.floor(seeds + rng.random(len(seeds))).astype(np.int64)
    e, s, fresh, ill = np.zeros_like(i), size - i, [], []
    for day in range(days):
        beta = r0 / infectious * (1 - lockdown * (day >= 25))
        new_e = thinned(s, 1 - np.exp(-beta * i / size), rng)
        new_i = thinned(e, 1 - np.exp(-1 / latent), rng)
        new_r = thinned(i, 1 - np.exp(-1 / infectious), rng)
        s, e, i = s - new_e, e + new_e - new_i, i + new_i - new_r
        fresh.append(new_i)
        ill.append(i)
    fresh, ill = np.stack(fresh, axis=1), np.stack(ill, axis=1)
    overdispersed = (
        rng.gamma(np.broadcast_to(dispersion[:, None], fresh.shape)) / dispersion[:, None]
    )
    cases = rng.poisson(reported[:, None] * fresh * overdispersed)
    return np.stack(
        [cases, thinned(fresh, hospital[:, None], rng), rng.binomial(200, ill / size)], axis=-1
    )


@system(
    "many",
    **{f"{c}{j}": (-2, 2, -1, 1) for j in range(1, 5) for c in ("cos", "sin")},
    noise=(0.1, 3, 0.5, 1.5),
)
def many_tide(parameters, rng):
    """Tide gauge of 4 known constituents, a cosine and a sine each, in autocorrelated noise; oceanography."""
    t = np.arange(100)
    waves = np.concatenate([[np.cos(w * t), np.sin(w * t)] for w in (0.505, 0.524, 0.253, 0.262)])
    shocks = rng.standard_normal((len(parameters), 100))
    noise = np.empty_like(shocks)
    noise[:, 0] = shocks[:, 0]
    for k in range(1, 100):
        noise[:, k] = 0.6 * noise[:, k - 1] + 0.8 * shocks[:, k]
    return (parameters[:, :8] @ waves + parameters[:, [8]] * noise)[..., None]


# ---------------------------------------------------------------- scales


@system(
    "scales",
    load=(2e5, 8e6, 1e6, 4e6),
    variation=(0.01, 0.6, 0.05, 0.3),
    compliance=(1e-13, 5e-12, 5e-13, 2.5e-12),
)
def scales_bridge(parameters, rng):
    """Load (newtons, millions) and strain (millionths) of a bridge; structural monitoring."""
    load, variation, compliance = columns(parameters)
    force = load * np.exp(variation * rng.standard_normal((len(load), 20)))
    strain = compliance * force * (
        1 + 0.05 * rng.standard_normal(force.shape)
    ) + 2e-8 * rng.standard_normal(force.shape)
    return np.stack([force, strain], axis=-1)


@system("scales", scale=(0.001, 1000, 1, 20), reversion=(0.02, 1, 0.1, 0.6))
def scales_wide_noise(parameters, rng):
    """Mean-reverting noise whose scale is a hundredth of its range; a user who does not know the units."""
    scale, reversion = parameters.T
    x, out = np.zeros(len(scale)), []
    for shock in rng.standard_normal((60, len(scale))):
        x = (1 - reversion) * x + scale * shock
        out.append(x)
    return np.stack(out, axis=1)[..., None]


@system(
    "scales",
    pressure=(80000, 120000, 95000, 105000),
    fall=(-1, 1, -0.4, 0.4),
    noise=(0.01, 2, 0.1, 0.8),
)
def scales_barometer(parameters, rng):
    """Barometer in pascals: a level of 100,000 in which changes and noise below 1 are the matter; meteorology."""
    pressure, fall, noise = columns(parameters)
    return (pressure + fall * np.arange(30) + noise * rng.standard_normal((len(pressure), 30)))[
        ..., None
    ]


# ---------------------------------------------------------------- short


@system("short", shape=(0.3, 10, 1, 5), scale=(0.1, 10, 0.8, 4))
def short_wait(parameters, rng):
    """One gamma waiting time a recording; bus stops, cell divisions."""
    shape, scale = parameters.T
    return (scale * rng.gamma(shape))[:, None, None]


@system("short", level=(90, 190, 120, 160), effect=(-40, 20, -20, 5), spread=(2, 40, 8, 25))
def short_before_after(parameters, rng):
    """Blood pressure of a patient before and after a drug, with the reading's own error; a paired trial."""
    level, effect, spread = columns(parameters)
    own = level + spread * rng.standard_normal(level.shape)
    return (own + effect * np.arange(2) + 5 * rng.standard_normal((len(level), 2)))[..., None]


@system(
    "short",
    spread_a=(0.1, 5, 0.5, 3),
    spread_b=(0.1, 5, 0.5, 3),
    correlation=(-0.95, 0.95, -0.7, 0.7),
)
def short_two_assets(parameters, rng):
    """One pair of correlated lognormal price ratios a recording; portfolio risk."""
    a, b, rho = parameters.T
    z, w = rng.standard_normal((2, len(a)))
    return np.exp(0.2 * np.stack([a * z, b * (rho * z + np.sqrt(1 - rho**2) * w)], axis=-1))[
        :, None, :
    ]


# ---------------------------------------------------------------- mixtures and hidden states


@system(
    "mixture",
    down=(-85, -65, -80, -70),
    up=(-62, -40, -58, -46),
    go_up=(0.005, 0.4, 0.02, 0.15),
    go_down=(0.005, 0.4, 0.05, 0.25),
    noise=(0.5, 10, 1.5, 5),
)
def mixture_up_down(parameters, rng):
    """Membrane voltage with hidden up and down states, smoothed by the membrane; cortical recordings."""
    down, up, go_up, go_down, noise = parameters.T
    states = two_states(go_up, go_down, 150, rng)
    level = np.where(states, up[:, None], down[:, None])
    shocks = rng.standard_normal(level.shape)
    v, out = level[:, 0], []
    for t in range(150):
        v = v + 0.5 * (level[:, t] - v)
        out.append(v + noise * shocks[:, t])
    return np.stack(out, axis=1)[..., None]


@system("mixture", cured=(0, 0.95, 0.2, 0.6), median=(2, 60, 8, 25), shape=(0.4, 4, 0.8, 2.2))
def mixture_cure(parameters, rng):
    """Survival of 20 patients, a part of them cured, the rest Weibull, censored by 60 months at most: time and event; oncology."""
    cured, median, shape = columns(parameters)
    death = median * (rng.exponential(size=(len(cured), 20)) / np.log(2)) ** (1 / shape)
    death = np.where(rng.random(death.shape) < cured, np.inf, death)
    censor = rng.uniform(24, 60, death.shape)
    return np.stack([np.minimum(death, censor), death <= censor], axis=-1)


# ---------------------------------------------------------------- irrelevant


@system(
    "irrelevant",
    background=(0.05, 5, 0.4, 2),
    branching=(0, 0.9, 0.3, 0.75),
    decay=(0.05, 1.5, 0.2, 0.8),
    threshold=(0, 5, 1, 4),
)
def irrelevant_aftershock(parameters, rng):
    """Self-exciting daily counts (Hawkes); `threshold` is a leftover that nothing uses; seismology."""
    background, branching, decay, _ = parameters.T
    keep, excited, out = np.exp(-decay), np.zeros(len(decay)), []
    for _ in range(150):
        n = rng.poisson(background + (1 - keep) * excited)
        excited = keep * excited + branching * n
        out.append(n)
    return np.stack(out, axis=1)[..., None]


# ---------------------------------------------------------------- plain


@system(
    "plain",
    ar1=(-0.9, 0.9, 0.2, 0.8),
    ar2=(-0.8, 0.1, -0.6, -0.3),
    ma=(-0.9, 0.9, -0.5, 0.6),
    noise=(0.1, 4, 0.6, 2),
)
def plain_arma(parameters, rng):
    """ARMA(2, 1) series of 300 steps; time-series practice."""
    ar1, ar2, ma, noise = parameters.T
    e = noise * rng.standard_normal((350, len(noise)))
    x, before, out = np.zeros(len(noise)), np.zeros(len(noise)), []
    for t in range(1, 350):
        x, before = ar1 * x + ar2 * before + e[t] + ma * e[t - 1], x
        out.append(x)
    return np.stack(out[-300:], axis=1)[..., None]


@system(
    "plain", contact=(0.05, 1.5, 0.3, 0.8), recovery=(0.03, 0.6, 0.08, 0.25), seeds=(1, 40, 5, 25)
)
def plain_sir(parameters, rng):
    """Stochastic SIR in a school of 1,000: new cases and those in bed, by day; boarding-school influenza."""
    contact, recovery, seeds = parameters.T
    i = np.floor(seeds + rng.random(len(seeds))).astype(np.int64)
    s, out = 1000 - i, []
    for _ in range(50):
        new = thinned(s, 1 - np.exp(-contact * i / 1000), rng)
        i, s = i + new - thinned(i, 1 - np.exp(-recovery), rng), s - new
        out.append(np.stack([new, i], axis=-1))
    return np.stack(out, axis=1)


@system(
    "plain", stiffness=(0.1, 3, 0.4, 1.8), frequency=(0.4, 3, 0.8, 2), noise=(0.02, 1, 0.1, 0.5)
)
def plain_van_der_pol(parameters, rng):
    """Van der Pol oscillator pushed by noise, position and speed; heartbeat models."""
    mu, frequency, noise = parameters.T
    h = 0.05
    x, v = rng.standard_normal((2, len(mu)))
    kicks, out = np.sqrt(h) * noise * rng.standard_normal((480, len(mu))), []
    for k, kick in enumerate(kicks):
        v = v + h * (mu * (1 - x**2) * v - frequency**2 * x) + kick
        x = x + h * v
        if k % 4 == 3:
            out.append(np.stack([x, v], axis=-1))
    return np.stack(out, axis=1)


@system(
    "plain",
    prevailing=(0, 2 * np.pi, 1.2, 5),
    pull=(0.01, 0.8, 0.08, 0.4),
    jitter=(0.05, 1.5, 0.2, 0.7),
)
def plain_wind(parameters, rng):
    """Wind direction in radians (0 to 2 pi, wrapped) pulled to a prevailing one; meteorology."""
    prevailing, pull, jitter = parameters.T
    angle, out = 2 * np.pi * rng.random(len(pull)), []
    for shock in rng.standard_normal((100, len(pull))):
        angle = angle + pull * np.sin(prevailing - angle) + jitter * shock
        out.append(angle)
    return np.mod(np.stack(out, axis=1), 2 * np.pi)[..., None]
