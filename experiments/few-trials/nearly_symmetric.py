"""Ten small systems, written before they were tried: six whose mirror image differs in one thing alone, four true pairs.

They are as those of `awkward_systems`: parameters (M, P) and a numpy Generator in, (M, T, D) out.
Of the kind "nearly" a second solution agrees in what is looked at first, such as means, spectra and
correlations, but not in the order in time, in the fourth moment, or in how samples differ from each
other. Of the kind "pair" it agrees in all. Their writer had read the method.
"""

import numpy as np
from awkward_systems import System, columns, registrar

SYSTEMS: dict[str, System] = {}
system = registrar(SYSTEMS)

# ---------------------------------------------------------------- a single solution


@system("nearly", size=(0.05, 6, 1, 3), echo=(0.1, 10, 0.3, 0.6))
def nearly_tailed_echo(parameters, rng):
    """A moving average of Laplace shocks, 80 days: only fourth moments know which shock came first."""
    size, echo = columns(parameters)
    shock = rng.laplace(size=(len(size), 81))
    return (size * (shock[:, 1:] + echo * shock[:, :-1]))[..., None]


@system("nearly", rise=(1, 20, 3, 6), fall=(1, 20, 10, 16), noise=(0.02, 1, 0.05, 0.2))
def nearly_sawtooth(parameters, rng):
    """A wave that rises and falls in straight lines, of any phase; in reverse both change places."""
    rise, fall, noise = columns(parameters)
    period = rise + fall
    time = (np.arange(80) + period * rng.random((len(rise), 1))) % period
    wave = np.where(time < rise, time / rise, (period - time) / fall)
    return (wave + noise * rng.standard_normal(wave.shape))[..., None]


@system(
    "nearly", swell=(0.05, 1, 0.5, 0.8), ebb=(0.05, 1, 0.1, 0.25), noise=(0.01, 0.6, 0.03, 0.15)
)
def nearly_alarm(parameters, rng):
    """An alarm that comes at times by chance, swells to 1 at a rate and ebbs at another one."""
    swell, ebb, noise = columns(parameters)
    level, alarmed = np.zeros(len(swell)), np.zeros(len(swell), dtype=bool)
    steps = []
    for chance in rng.random((90, len(swell))):
        alarmed = np.where(alarmed, level < 0.999, chance < 0.05)
        step = np.where(alarmed, swell[:, 0], -ebb[:, 0])
        level = np.clip(level + step, 0, 1)
        steps.append(level)
    wave = np.stack(steps, axis=1)
    return (wave + noise * rng.standard_normal(wave.shape))[..., None]


@system("nearly", own=(0.05, 2, 0.8, 1.5), common=(0.05, 2, 0.2, 0.5))
def nearly_households(parameters, rng):
    """Incomes of 6 households of a village: each has its own deviation, and all one of the village."""
    own, common = columns(parameters)
    village = common * rng.standard_normal((len(own), 1))
    return (village + own * rng.standard_normal((len(own), 6)))[..., None]


@system("nearly", slope=(-4, 4, 1, 3), noise=(0.1, 3, 0.4, 1.2))
def nearly_follower(parameters, rng):
    """A signal, and one that is a multiple of the square of its last value: the sign shows little."""
    slope, noise = columns(parameters)
    first = rng.standard_normal((len(slope), 60))
    last = np.roll(first, 1, axis=1)
    second = slope * (last**2 - 1) * rng.choice((-1, 1), size=(len(slope), 1))
    second = second + 0.3 * slope * last + noise * rng.standard_normal(first.shape)
    return np.stack([first, second], axis=-1)


@system("nearly", early=(0.02, 1, 0.4, 0.7), late=(0.02, 1, 0.1, 0.25))
def nearly_two_doors(parameters, rng):
    """Visitors go through one door, and then another; each step says how many are between and behind."""
    early, late = parameters.T
    outside, between = np.full((2, len(early)), 60)
    between = np.zeros(len(early), dtype=np.int64)
    steps = []
    for _ in range(25):
        through = rng.binomial(outside, early)
        gone = rng.binomial(between, late)
        outside, between = outside - through, between + through - gone
        # whoever counts misses most of those between
        steps.append(np.stack([rng.binomial(between, 0.1), gone], axis=-1))
    return np.stack(steps, axis=1)


# ---------------------------------------------------------------- pairs


@system(
    "pair",
    lambda truth: [dict(truth, size=truth["size"] * truth["echo"], echo=1 / truth["echo"])],
    size=(0.05, 6, 1, 3),
    echo=(0.1, 10, 0.3, 0.6),
    share=(0.0, 1, 0.2, 0.8),
)
def pair_of_gauges(parameters, rng):
    """Two gauges of a moving average of normal shocks, of which the second sees a share; 80 days."""
    size, echo, share = columns(parameters)
    shock = rng.standard_normal((len(size), 81))
    wave = size * (shock[:, 1:] + echo * shock[:, :-1])
    return np.stack([wave, share * wave + 0.3 * rng.standard_normal(wave.shape)], axis=-1)


@system(
    "pair",
    lambda truth: [dict(truth, first=truth["second"], second=truth["first"])],
    first=(0.05, 2, 0.8, 1.5),
    second=(0.05, 2, 0.2, 0.5),
    noise=(0.02, 1, 0.05, 0.3),
)
def pair_of_rates(parameters, rng):
    """A level that falls by two rates in parallel, of equal amounts."""
    first, second, noise = columns(parameters)
    time = np.linspace(0, 6, 20)
    wave = np.exp(-first * time) + np.exp(-second * time)
    return (wave + noise * rng.standard_normal(wave.shape))[..., None]


@system(
    "pair",
    lambda truth: [dict(truth, tilt=-truth["tilt"])],
    tilt=(-2, 2, 0.6, 1.6),
    noise=(0.05, 1, 0.1, 0.4),
)
def pair_of_slopes(parameters, rng):
    """A board that tilts to either side, by chance."""
    tilt, noise = columns(parameters)
    side = rng.choice((-1, 1), size=(len(tilt), 1))
    line = side * tilt * np.linspace(-1, 1, 30)
    return (line + noise * rng.standard_normal(line.shape))[..., None]


@system(
    "pair",
    lambda truth: [{"fast": 1 / truth["slow"], "slow": 1 / truth["fast"]}],
    fast=(0.05, 10, 2, 5),
    slow=(0.05, 10, 1.5, 4),
)
def pair_of_machines(parameters, rng):
    """Pieces of two machines: times of one have a rate, of the other a mean; shuffled."""
    fast, slow = columns(parameters)
    first, second = rng.gamma(2.0, size=(2, len(fast), 50))
    which = rng.random((len(fast), 50)) < 0.5
    return np.where(which, first / fast, second * slow)[..., None]
