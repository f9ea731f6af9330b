"""Twelve small systems of a writer who had not read the method: six with two solutions, six with one.

The two solutions of those of the kind "two" follow from each other by products or ratios of parameters.
Nothing was tuned on them. Parameters (M, P) and a numpy Generator in, (M, T, D) out.
"""

import numpy as np
from awkward_systems import System, columns, registrar

SYSTEMS: dict[str, System] = {}
system = registrar(SYSTEMS)


def alone(other):
    """Return what gives the only other solution of a truth, in a list."""
    return lambda truth: [other(truth)]


# ---------------------------------------------------------------- (a) two solutions


@system(
    "two",
    alone(
        lambda p: (
            p
            | {
                "uptake": p["loss"],
                "loss": p["uptake"],
                "volume": p["volume"] * p["loss"] / p["uptake"],
            }
        )
    ),
    uptake=(0.02, 4.0, 0.8, 1.6),
    loss=(0.02, 4.0, 0.25, 0.5),
    volume=(1.0, 60.0, 20.0, 40.0),
    spread=(0.01, 0.6, 0.05, 0.25),
)
def flip_flop_dose(parameters, rng):
    """A drug swallowed: concentration at 16 times, log-normal noise.

    Second: uptake' = loss, loss' = uptake, volume' = volume * loss / uptake.
    """
    ka, ke, v, s = columns(parameters)
    t = np.linspace(0.3, 12.0, 16)[None]
    gap = np.where(np.abs(ka - ke) < 1e-6, 1e-6, ka - ke)
    c = 100.0 * ka / (v * gap) * (np.exp(-ke * t) - np.exp(-ka * t))
    return (np.maximum(c, 0.0) * np.exp(s * rng.normal(size=c.shape)))[:, :, None]


@system(
    "two",
    alone(lambda p: p | {"conductance": 1.0 / p["capacity"], "capacity": 1.0 / p["conductance"]}),
    conductance=(0.1, 8.0, 1.5, 4.0),
    capacity=(0.1, 8.0, 1.2, 3.5),
    gain=(0.1, 5.0, 0.5, 3.0),
)
def two_stage_relay(parameters, rng):
    """Two buffered RC stages: first of unit capacity and this conductance, second of unit conductance
    and this capacity; driven by a noisy square wave. Only the output is seen, 50 steps of 0.2.

    Second: conductance' = 1 / capacity, capacity' = 1 / conductance.
    """
    g, c, gain = columns(parameters)
    a, b = np.exp(-0.2 * g), np.exp(-0.2 / c)
    x = np.zeros_like(g)
    y = np.zeros_like(g)
    steps = []
    for i in range(50):
        u = gain * ((1.0 if i % 25 < 12 else 0.0) + 0.8 * rng.normal(size=g.shape))
        x, y = a * x + (1 - a) * u, b * y + (1 - b) * x
        steps.append(y)
    return np.stack(steps, axis=1)


@system(
    "two",
    alone(
        lambda p: {
            "hunger": p["hunger"] / (p["half"] * p["swamp"]),
            "half": 1.0 / p["swamp"],
            "swamp": 1.0 / p["half"],
        }
    ),
    hunger=(1.0, 400.0, 10.0, 25.0),
    half=(0.2, 40.0, 1.0, 2.5),
    swamp=(0.02, 4.0, 0.05, 0.12),
)
def predator_meals(parameters, rng):
    """A predator that prey in number confuse: meals in a day at 24 known densities of prey,
    hunger * R / ((half + R) * (1 + swamp * R)), Poisson.

    Second: half' = 1 / swamp, swamp' = 1 / half, hunger' = hunger / (half * swamp).
    """
    v, k, b = columns(parameters)
    r = np.geomspace(0.2, 60.0, 24)[None]
    return rng.poisson(v * r / ((k + r) * (1.0 + b * r)))[:, :, None].astype(float)


@system(
    "two",
    alone(lambda p: p | {"service": p["service"] * p["faster"], "faster": 1.0 / p["faster"]}),
    arrival=(0.1, 3.0, 0.5, 0.9),
    service=(0.2, 12.0, 1.0, 1.6),
    faster=(0.1, 10.0, 2.0, 5.0),
)
def tandem_desks(parameters, rng):
    """Two desks one after the other, the second so many times as fast: 40 customers, each with the gap
    to the departure before and the time spent in all. Exponential desks interchange (Weber 1979).

    Second: service' = service * faster, faster' = 1 / faster.
    """
    lam, mu, f = columns(parameters)
    size = (len(lam), 40)
    gaps = rng.exponential(size=size) / lam
    first = rng.exponential(size=size) / mu
    second = rng.exponential(size=size) / (mu * f)
    arrivals = np.cumsum(gaps, axis=1)
    d1 = np.zeros(len(lam))
    d2 = np.zeros(len(lam))
    steps = []
    for i in range(40):
        d1 = np.maximum(arrivals[:, i], d1) + first[:, i]
        before = d2
        d2 = np.maximum(d1, d2) + second[:, i]
        steps.append(np.stack([d2 - before, d2 - arrivals[:, i]], axis=1))
    return np.stack(steps, axis=1)


@system(
    "two",
    alone(
        lambda p: (
            p
            | {"rate": p["rate"] * p["ratio"], "ratio": 1.0 / p["ratio"], "share": 1.0 - p["share"]}
        )
    ),
    rate=(0.02, 5.0, 0.12, 0.3),
    ratio=(0.05, 20.0, 4.0, 9.0),
    share=(0.0, 1.0, 0.25, 0.75),
)
def photon_two_lives(parameters, rng):
    """Photons of two dyes, 30 windows: Poisson, 80 * (share * exp(-rate t) + (1 - share) exp(-rate ratio t)).

    Second: rate' = rate * ratio, ratio' = 1 / ratio, share' = 1 - share.
    """
    k, r, w = columns(parameters)
    t = np.arange(30)[None] * 0.5
    mean = 80.0 * (w * np.exp(-k * t) + (1.0 - w) * np.exp(-k * r * t))
    return rng.poisson(mean)[:, :, None].astype(float)


@system(
    "two",
    alone(lambda p: p | {"size": p["size"] * p["echo"], "echo": 1.0 / p["echo"]}),
    level=(-5.0, 5.0, -3.0, 3.0),
    size=(0.05, 6.0, 1.0, 4.0),
    echo=(0.1, 10.0, 0.25, 0.65),
)
def echo_shocks(parameters, rng):
    """Daily returns with the echo of yesterday's shock, a moving average, 60 days, normal shocks.

    Second: echo' = 1 / echo, size' = size * echo.
    """
    m, s, e = columns(parameters)
    z = rng.normal(size=(len(m), 61))
    return (m + s * (z[:, 1:] + e * z[:, :-1]))[:, :, None]


# ---------------------------------------------------------------- (b) a single solution


@system(
    "outside",
    hatch=(0.02, 1.5, 0.4, 0.8),
    fledge=(0.02, 1.5, 0.06, 0.15),
    seen=(0.05, 1.0, 0.5, 0.9),
)
def nestlings_seen(parameters, rng):
    """120 eggs hatch and nestlings fledge; nestlings seen on 25 days (each a separate brood), a share seen.

    Swap of hatch and fledge needs seen' = seen * hatch / fledge > 1: outside. A single solution.
    """
    h, f, q = columns(parameters)
    t = np.arange(1, 26)[None]
    gap = np.where(np.abs(h - f) < 1e-6, 1e-6, h - f)
    p = h / gap * (np.exp(-f * t) - np.exp(-h * t))
    return rng.binomial(120, np.clip(q * p, 0.0, 1.0))[:, :, None].astype(float)


@system("nearly", size=(0.05, 8.0, 1.5, 5.0), echo=(0.1, 10.0, 0.3, 0.6))
def skewed_echo(parameters, rng):
    """Rainfall anomalies with an echo of the day before; shocks are gamma (shape 1), so skewed. 60 days.

    Means, variances and correlations agree at echo' = 1 / echo, size' = size * echo; the order of
    skewed shocks in time does not. A single solution.
    """
    s, e = columns(parameters)
    z = rng.gamma(1.0, size=(len(s), 61)) - 1.0
    return (s * (z[:, 1:] + e * z[:, :-1]))[:, :, None]


@system(
    "single", speed=(0.1, 10.0, 1.0, 4.0), half=(0.2, 30.0, 3.0, 12.0), noise=(0.02, 2.0, 0.1, 0.8)
)
def enzyme_progress(parameters, rng):
    """Michaelis-Menten: substrate used up from two starts, 20 and 4; two signals with noise, 30 steps."""
    v, k, n = columns(parameters)
    s = np.broadcast_to(np.array([20.0, 4.0]), (len(v), 2)).copy()
    steps = []
    for _ in range(30):
        for _ in range(4):
            s = s * np.exp(-0.125 * v / (k + s))
        steps.append(s + n * rng.normal(size=s.shape))
    return np.stack(steps, axis=1)


@system(
    "single",
    often=(0.05, 5.0, 0.5, 2.0),
    burst=(1.0, 40.0, 4.0, 15.0),
    decay=(0.01, 1.5, 0.08, 0.5),
)
def bursting_gene(parameters, rng):
    """Bursts of transcripts, geometric in size, and their decay from none: 40 steps of counts."""
    o, b, d = columns(parameters)
    n = np.zeros(o.shape, dtype=np.int64)
    steps = []
    for _ in range(40):
        bursts = rng.poisson(o)
        new = np.where(bursts > 0, rng.negative_binomial(np.maximum(bursts, 1), 1.0 / (1.0 + b)), 0)
        n = rng.binomial(n, np.exp(-d)) + new
        steps.append(n)
    return np.stack(steps, axis=1).astype(float)


@system(
    "single",
    resistance=(0.1, 10.0, 1.0, 5.0),
    capacity=(0.1, 10.0, 0.5, 4.0),
    leak=(0.01, 1.0, 0.05, 0.4),
)
def patch_clamp(parameters, rng):
    """Step of current through a cell with noise of the current, on for 20 of 45 steps, then off."""
    r, c, n = columns(parameters)
    a = np.exp(-0.4 / (r * c))
    v = np.zeros_like(r)
    steps = []
    for i in range(45):
        current = (1.0 if i < 20 else 0.0) + n * rng.normal(size=r.shape)
        v = a * v + (1.0 - a) * r * current
        steps.append(v)
    return np.stack(steps, axis=1)


@system(
    "single",
    longest=(5.0, 150.0, 40.0, 90.0),
    growth=(0.01, 1.0, 0.1, 0.4),
    differ=(0.01, 0.5, 0.05, 0.2),
    slip=(0.05, 8.0, 0.5, 3.0),
)
def fish_growth(parameters, rng):
    """Von Bertalanffy: fish that differ in their final length, measured with error at 15 ages."""
    length, k, d, s = columns(parameters)
    t = np.arange(1, 16)[None]
    own = length * np.exp(d * rng.normal(size=length.shape))
    return (own * (1.0 - np.exp(-k * t)) + s * rng.normal(size=(len(length), 15)))[:, :, None]
