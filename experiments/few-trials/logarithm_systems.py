"""18 small stochastic simulators with products and ratios, written before they were tried.

They are as those of `awkward_systems`: parameters (M, P) and a numpy Generator in, (M, T, D) out.
Of those of the kind "logarithms" two solutions are images of each other that are linear in
logarithms of parameters; those of the kind "products" have one solution, or a ridge.
TUNING names what the search was tuned on; results are reported of the others.
"""

import numpy as np
from awkward_systems import System, columns, registrar

SYSTEMS: dict[str, System] = {}
system = registrar(SYSTEMS)

TUNING = (
    "logarithm_chain",
    "logarithm_double_star",
    "logarithm_tiles",
    "logarithm_rate_and_time",
    "product_growth",
    "product_enzyme",
    "product_allometry",
    "product_durations",
)


# ---------------------------------------------------------------- logarithms, for tuning


def _chain(truth):
    """The other order of decays, of another amount."""
    first, second = truth["first"], truth["second"]
    return [{"first": second, "second": first, "amount": truth["amount"] * first / second}]


@system(
    "logarithms",
    _chain,
    first=(0.02, 2, 0.3, 0.9),
    second=(0.02, 2, 0.06, 0.2),
    amount=(20, 3000, 300, 900),
)
def logarithm_chain(parameters, rng):
    """Atoms of the middle member of a decay chain, counted at 20 times; radiochemistry."""
    first, second, amount = columns(parameters)
    hours = np.geomspace(0.5, 40, 20)
    gap = np.where(np.abs(second - first) < 1e-9, 1e-9, second - first)
    left = first * (np.exp(-first * hours) - np.exp(-second * hours)) / gap
    return rng.poisson(amount * np.maximum(left, 0))[..., None]


@system(
    "logarithms",
    lambda truth: [dict(truth, speed=truth["speed"] * truth["ratio"], ratio=1 / truth["ratio"])],
    speed=(2, 100, 20, 40),
    ratio=(0.1, 8, 1.4, 2.2),
    noise=(0.1, 8, 0.8, 3),
)
def logarithm_double_star(parameters, rng):
    """Speeds of both stars of a pair at 25 times, the lower one first; astronomy."""
    speed, ratio, noise = columns(parameters)
    phase = 2 * np.pi * (np.arange(25) / 11.3 + rng.random((len(speed), 1)))
    both = np.stack([speed * np.sin(phase), -speed * ratio * np.sin(phase)], axis=-1)
    return np.sort(both + noise[..., None] * rng.standard_normal(both.shape), axis=-1)


@system(
    "logarithms",
    lambda truth: [dict(truth, side=truth["area"] / truth["side"])],
    side=(0.3, 12, 1, 2.5),
    area=(1, 40, 8, 20),
)
def logarithm_tiles(parameters, rng):
    """Both sides of 30 tiles, in any order; archaeology."""
    side, area = columns(parameters)
    first = np.broadcast_to(side, (len(side), 30))
    second = area / first
    turned = rng.random(first.shape) < 0.5
    sides = np.stack([np.where(turned, second, first), np.where(turned, first, second)], axis=-1)
    return sides * np.exp(0.15 * rng.standard_normal(sides.shape))


@system(
    "logarithms",
    lambda truth: [{"rate": 1 / truth["time"], "time": 1 / truth["rate"]}],
    rate=(0.05, 10, 1.5, 4),
    time=(0.05, 10, 1.5, 4),
)
def logarithm_rate_and_time(parameters, rng):
    """Stays of 50 guests: one step has a rate, one a mean time; any order; queues."""
    rate, time = columns(parameters)
    first, second = rng.exponential(size=(2, len(rate), 50))
    return (first / rate + second * time)[..., None]


# ---------------------------------------------------------------- logarithms, for the report


@system(
    "logarithms",
    lambda truth: [
        {
            "storm": truth["storm"] * truth["lower"] / truth["upper"],
            "upper": truth["lower"],
            "lower": truth["upper"],
        }
    ],
    storm=(0.05, 12, 0.8, 2.5),
    upper=(0.02, 0.95, 0.4, 0.8),
    lower=(0.02, 0.95, 0.08, 0.25),
)
def logarithm_two_tanks(parameters, rng):
    """Level of a tank that follows another one, which rain fills; hydrology."""
    storm, upper, lower = parameters.T
    above, below = np.zeros((2, len(storm)))
    out = []
    for rain in rng.standard_normal((80, len(storm))):
        above, below = (1 - upper) * above + storm * rain, (1 - lower) * below + lower * above
        out.append(below)
    return np.stack(out, axis=1)[..., None]


@system(
    "logarithms",
    lambda truth: [
        {
            "meal": truth["meal"] * truth["ratio"],
            "ratio": 1 / truth["ratio"],
            "share": 1 - truth["share"],
        }
    ],
    meal=(0.5, 40, 2, 6),
    ratio=(0.1, 10, 2.5, 6),
    share=(0.02, 0.98, 0.25, 0.45),
)
def logarithm_two_prey(parameters, rng):
    """Sizes of 40 meals of two kinds, the second one a multiple of the first; ecology."""
    meal, ratio, share = columns(parameters)
    second = rng.random((len(meal), 40)) < share
    size = np.where(second, meal * ratio, meal)
    return (size * np.exp(0.3 * rng.standard_normal(size.shape)))[..., None]


@system(
    "logarithms",
    lambda truth: [dict(truth, pitch=truth["middle"] ** 2 / truth["pitch"])],
    pitch=(50, 2000, 150, 300),
    middle=(100, 1000, 380, 600),
    wobble=(0.01, 0.5, 0.04, 0.15),
)
def logarithm_two_voices(parameters, rng):
    """Pitches of 40 calls of a pair, either of whom calls, about a common middle; acoustics."""
    pitch, middle, wobble = columns(parameters)
    other = rng.random((len(pitch), 40)) < 0.5
    called = np.where(other, middle**2 / pitch, pitch)
    return (called * np.exp(wobble * rng.standard_normal(called.shape)))[..., None]


@system(
    "logarithms",
    lambda truth: [
        dict(truth, cold=truth["warm"] * truth["factor"], warm=truth["cold"] / truth["factor"])
    ],
    cold=(0.05, 6, 1.5, 3),
    warm=(0.05, 6, 0.2, 0.4),
    factor=(0.2, 5, 1.3, 2.5),
)
def logarithm_heated_step(parameters, rng):
    """Times of two reactions in line, one of them heated, beside those of a heated third; chemistry."""
    cold, warm, factor = columns(parameters)
    first, second, third = rng.exponential(size=(3, len(cold), 40))
    return np.stack([first / cold + second / (warm * factor), third / factor], axis=-1)


def _tracer(truth):
    """Uptake and loss exchanged, in other volumes of both tissues."""
    ratio = truth["loss"] / truth["uptake"]
    return [
        {
            "uptake": truth["loss"],
            "loss": truth["uptake"],
            "blood": truth["blood"] * ratio,
            "lymph": truth["lymph"] * ratio,
        }
    ]


@system(
    "logarithms",
    _tracer,
    uptake=(0.05, 4, 0.8, 2),
    loss=(0.05, 4, 0.2, 0.5),
    blood=(1, 80, 8, 30),
    lymph=(1, 80, 8, 30),
)
def logarithm_two_volumes(parameters, rng):
    """Levels of a tracer in two tissues that have volumes of their own; medicine."""
    uptake, loss, blood, lymph = columns(parameters)
    hours = np.array([0.25, 0.5, 1, 1.5, 2, 3, 4, 6, 8, 12, 18, 24])
    gap = np.where(np.abs(uptake - loss) < 1e-9, 1e-9, uptake - loss)
    level = 100 * uptake * (np.exp(-loss * hours) - np.exp(-uptake * hours)) / gap
    both = np.stack([level / blood, level / lymph], axis=-1)
    relative, absolute = rng.standard_normal((2, *both.shape))
    return both * np.exp(0.1 * relative) + 0.03 * absolute


# ---------------------------------------------------------------- products, for tuning


@system(
    "products",
    growth=(0.02, 1.5, 0.15, 0.6),
    capacity=(20, 2000, 200, 900),
    seen=(0.02, 1, 0.2, 0.7),
)
def product_growth(parameters, rng):
    """Logistic growth from ten animals, of which a part is counted; ecology."""
    growth, capacity, seen = parameters.T
    animals, out = np.full(len(growth), 10.0), []
    for _ in range(30):
        births = growth * animals * np.maximum(1 - animals / capacity, 0)
        animals = animals + rng.poisson(births)
        out.append(rng.binomial(animals.astype(np.int64), seen))
    return np.stack(out, axis=1)[..., None]


def enzyme_speeds(parameters, concentrations, rng):
    """Speeds of an enzyme at some concentrations (T,), with noise of their logarithm."""
    fastest, half, noise = columns(parameters)
    speed = fastest * concentrations / (half + concentrations)
    return (speed * np.exp(noise * rng.standard_normal(speed.shape)))[..., None]


@system("products", fastest=(0.5, 50, 8, 25), half=(0.2, 30, 2, 9), noise=(0.01, 1, 0.06, 0.25))
def product_enzyme(parameters, rng):
    """Speeds of an enzyme at 15 concentrations (Michaelis and Menten); biochemistry."""
    return enzyme_speeds(parameters, np.geomspace(0.3, 40, 15), rng)


@system("products", factor=(0.05, 8, 0.6, 3), power=(0.1, 3, 0.5, 1.4), noise=(0.02, 1.5, 0.1, 0.5))
def product_allometry(parameters, rng):
    """Weights of 20 organs of animals of known sizes, by a power law; biology."""
    factor, power, noise = columns(parameters)
    size = np.geomspace(0.2, 20, 20)
    weight = factor * size**power
    return (weight * np.exp(noise * rng.standard_normal(weight.shape)))[..., None]


@system("products", shape=(0.3, 10, 1.2, 4), scale=(0.3, 10, 1, 4))
def product_durations(parameters, rng):
    """Durations of 40 bouts, of gamma distribution; behavior."""
    shape, scale = columns(parameters)
    return (scale * rng.standard_gamma(np.broadcast_to(shape, (len(shape), 40))))[..., None]


# ---------------------------------------------------------------- products, for the report


@system("products", attack=(0.02, 3, 0.2, 0.9), handling=(0.01, 1, 0.05, 0.3), days=(1, 40, 6, 18))
def product_predator(parameters, rng):
    """Prey eaten at 15 densities in so many days (Holling), beside prey that needs no handling."""
    attack, handling, days = columns(parameters)
    density = np.geomspace(0.5, 60, 15)
    eaten = rng.poisson(days * attack * density / (1 + attack * handling * density))
    small = rng.poisson(days * np.broadcast_to(np.linspace(0.2, 2, 15), eaten.shape))
    return np.stack([eaten, small], axis=-1)


@system(
    "products",
    absorption=(0.05, 4, 0.8, 2),
    elimination=(0.05, 4, 0.15, 0.5),
    volume=(0.5, 80, 10, 35),
)
def product_gut_and_blood(parameters, rng):
    """Blood level of a drug, and how much of it is left in the gut; medicine."""
    absorption, elimination, volume = columns(parameters)
    hours = np.array([0.25, 0.5, 1, 1.5, 2, 3, 4, 6, 8, 12, 18, 24])
    gap = np.where(np.abs(absorption - elimination) < 1e-9, 1e-9, absorption - elimination)
    shape = np.exp(-elimination * hours) - np.exp(-absorption * hours)
    levels = np.stack(
        [100 / volume * absorption * shape / gap, 100 * np.exp(-absorption * hours)], axis=-1
    )
    relative, absolute = rng.standard_normal((2, *levels.shape))
    return levels * np.exp(0.1 * relative) + 0.03 * absolute


@system("products", mobility=(0.1, 10, 1, 4), heat=(0.1, 10, 1, 4), force=(0.1, 10, 1, 4))
def product_drift(parameters, rng):
    """Steps of a particle: only mobility x heat and mobility x force show, a ridge; physics."""
    mobility, heat, force = columns(parameters)
    shocks = rng.standard_normal((len(force), 60))
    return (mobility * force + np.sqrt(2 * mobility * heat) * shocks)[..., None]


@system("products", speed=(2, 100, 20, 40), ratio=(0.1, 8, 1.4, 2.2), noise=(0.1, 8, 0.8, 3))
def product_two_runners(parameters, rng):
    """Speeds of two runners with numbers, the second one a multiple of the first; sports."""
    speed, ratio, noise = parameters.T[..., None, None]
    both = np.concatenate([speed, speed * ratio], axis=-1)
    return both + noise * rng.standard_normal((len(speed), 25, 2))


@system(
    "products", arrivals=(0.05, 5, 0.5, 1.5), service=(0.05, 5, 1.7, 3.5), price=(0.1, 20, 2, 8)
)
def product_shop(parameters, rng):
    """Waiting times of 60 customers of a shop, and what they spend; queues."""
    arrivals, service, price = parameters.T
    waiting, out = np.zeros(len(price)), []
    for gap, work, spent in rng.exponential(size=(60, 3, len(price))):
        busy = work / service
        out.append(np.stack([waiting + busy, price * spent], axis=-1))
        waiting = np.maximum(waiting + busy - gap / arrivals, 0)
    return np.stack(out, axis=1)
