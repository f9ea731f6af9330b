"""40 more small stochastic simulators, unlike the 48 and written without knowing the method.

Each takes parameters (M, P) and a numpy Generator and gives (M, T, D), one recording a row.
Three have exactly equivalent parameters that no finite list can hold; there `solutions` gives
the truth alone:
  ridge_occupancy       only occupied x detected shows
  ridge_heating         only sun + stove shows
  irrelevant_neuron     `calcium` is never used
"""

import numpy as np
from awkward_systems import System, columns, registrar, swapped, thinned, two_states

SYSTEMS: dict[str, System] = {}
system = registrar(SYSTEMS)


def whole(values, rng):
    """One of the two whole numbers next to each value, right in the mean."""
    return np.floor(values + rng.random(values.shape)).astype(np.int64)


# ---------------------------------------------------------------- counts


@system("counts", schools=(0.05, 6, 0.4, 2), size=(1, 100, 10, 40), evenness=(0.2, 8, 0.7, 3))
def counts_fishery(parameters, rng):
    """Catches of 25 hauls, many of them empty: fish come in schools; fisheries."""
    schools, size, evenness = columns(parameters)
    met = rng.poisson(np.broadcast_to(schools, (len(schools), 25)))
    return rng.poisson(size / evenness * rng.standard_gamma(met * evenness))[..., None]


@system("counts", outside=(0.01, 0.8, 0.06, 0.3), inside=(0.01, 0.9, 0.12, 0.5))
def counts_households(parameters, rng):
    """Final sizes of outbreaks in 30 households of five (Reed and Frost); epidemics."""
    outside, inside = columns(parameters)
    ill = rng.binomial(5, np.broadcast_to(outside, (len(outside), 30)))
    healthy = 5 - ill
    for _ in range(4):
        ill = thinned(healthy, 1 - (1 - inside) ** ill, rng)
        healthy = healthy - ill
    return (5 - healthy)[..., None]


# ---------------------------------------------------------------- censored


@system("censored", level=(-6, 16, 1, 9), spread=(0.2, 8, 1, 4), memory=(0, 0.98, 0.3, 0.85))
def censored_photometer(parameters, rng):
    """Light under drifting clouds, by a sensor that saturates at 0 and at 10; optics."""
    level, spread, memory = parameters.T
    cloud, out = rng.standard_normal(len(level)), []
    for shock in rng.standard_normal((60, len(level))):
        cloud = memory * cloud + np.sqrt(1 - memory**2) * shock
        out.append(np.clip(level + spread * cloud, 0, 10))
    return np.stack(out, axis=1)[..., None]


@system(
    "censored", mean=(0.3, 50, 3, 14), clumping=(0.1, 6, 0.4, 2), aging=(-0.15, 0.15, -0.07, 0.07)
)
def censored_ticks(parameters, rng):
    """Ticks on 25 deer by age, negative binomial, counted up to 10 only; parasitology."""
    mean, clumping, aging = columns(parameters)
    burden = mean * np.exp(aging * (np.arange(25) - 12))
    ticks = rng.poisson(burden / clumping * rng.standard_gamma(clumping, burden.shape))
    return np.minimum(ticks, 10)[..., None]


# ---------------------------------------------------------------- wide ranges


@system(
    "wide",
    population=(10, 1e5, 100, 3000),
    selection=(-0.2, 0.2, -0.06, 0.06),
    start=(0.05, 0.95, 0.3, 0.7),
)
def wide_drift(parameters, rng):
    """Allele frequency under drift and selection over 40 generations; population genetics."""
    population, selection, start = parameters.T
    alleles, frequency, out = 2 * whole(population, rng), start, []
    for _ in range(40):
        favored = frequency * np.exp(selection)
        frequency = thinned(alleles, favored / (1 - frequency + favored), rng) / alleles
        out.append(frequency)
    return np.stack(out, axis=1)[..., None]


@system("wide", rate=(10, 1e5, 1000, 20000), dead_time=(1e-6, 1e-2, 3e-5, 1e-3))
def wide_dead_time(parameters, rng):
    """Counts of a detector with dead time behind 15 absorbers, 10 seconds each; radiation."""
    rate, dead_time = columns(parameters)
    arriving = rate * np.geomspace(1, 0.01, 15)
    return rng.poisson(10 * arriving / (1 + arriving * dead_time))[..., None]


@system("wide", transmissivity=(1e-6, 1e-2, 3e-5, 1e-3), storage=(1e-6, 1e-2, 3e-5, 1e-3))
def wide_pumping(parameters, rng):
    """Water level near a pumped well, 15 readings in a day (Theis); hydrogeology."""
    transmissivity, storage = columns(parameters)
    seconds = np.geomspace(60, 86400, 15)
    u = 10**2 * storage / (4 * transmissivity * seconds)
    grid, step = np.linspace(0, 25, 101, retstep=True)
    integrand = np.exp(-u[..., None] * np.exp(grid))
    well = step * (integrand.sum(axis=-1) - 0.5 * integrand[..., 0])
    fall = 1e-3 / (4 * np.pi * transmissivity) * well
    relative, absolute = rng.standard_normal((2, *fall.shape))
    return (fall * (1 + 0.03 * relative) + 0.01 * absolute)[..., None]


# ---------------------------------------------------------------- heavy tails


@system(
    "tails", rate=(0.02, 5, 0.2, 1.5), regularity=(0.3, 2.5, 0.6, 1.5), b_value=(0.5, 2, 0.75, 1.4)
)
def tails_earthquakes(parameters, rng):
    """Gap before and energy of 40 earthquakes (Weibull, Gutenberg-Richter); seismology."""
    rate, regularity, b_value = columns(parameters)
    gap = rng.exponential(size=(len(rate), 40)) ** (1 / regularity) / rate
    energy = (1 - rng.random(gap.shape)) ** (-1.5 / b_value)
    return np.stack([gap, energy], axis=-1)


@system("tails", location=(20, 500, 100, 300), scale=(3, 150, 20, 80), shape=(-0.4, 0.8, -0.1, 0.5))
def tails_floods(parameters, rng):
    """Highest flow of 50 years, generalized extreme value; hydrology."""
    location, scale, shape = columns(parameters)
    shape = np.where(np.abs(shape) < 1e-9, 1e-9, shape)
    gumbel = rng.gumbel(size=(len(shape), 50))
    return (location + scale * np.expm1(shape * gumbel) / shape)[..., None]


@system("tails", along=(-15, 15, -6, 6), offshore=(0.05, 12, 0.8, 5))
def tails_lighthouse(parameters, rng):
    """Where 20 flashes of a turning lighthouse hit the straight coast (Cauchy); Gull's puzzle."""
    along, offshore = columns(parameters)
    angle = np.pi * (rng.random((len(along), 20)) - 0.5)
    return (along + offshore * np.tan(angle))[..., None]


# ---------------------------------------------------------------- near-deterministic


@system(
    "deterministic",
    amplitude=(1, 100, 20, 70),
    eccentricity=(0, 0.9, 0.2, 0.65),
    period=(5, 40, 10, 25),
    argument=(0, 2 * np.pi, 1, 5),
)
def deterministic_orbit(parameters, rng):
    """Radial velocity of a star with a planet, told almost without error; astronomy."""
    amplitude, eccentricity, period, argument = columns(parameters)
    anomaly = np.mod(2 * np.pi * np.arange(60) / period, 2 * np.pi)
    eccentric = np.full_like(anomaly, np.pi)
    for _ in range(12):
        error = eccentric - eccentricity * np.sin(eccentric) - anomaly
        eccentric = eccentric - error / (1 - eccentricity * np.cos(eccentric))
    stretch = np.sqrt((1 + eccentricity) / (1 - eccentricity))
    true = 2 * np.arctan2(stretch * np.sin(eccentric / 2), np.cos(eccentric / 2))
    velocity = amplitude * (np.cos(true + argument) + eccentricity * np.cos(argument))
    return (velocity + 1e-4 * rng.standard_normal(velocity.shape))[..., None]


@system("deterministic", turn=(0, 0.5, 0.08, 0.42), coupling=(0, 1, 0.25, 0.85))
def deterministic_circle_map(parameters, rng):
    """Angle of a forced rotor (circle map) from a random start, nothing else random; physics."""
    turn, coupling = parameters.T
    phase, out = rng.random(len(turn)), []
    for _ in range(60):
        phase = np.mod(phase + turn - coupling / (2 * np.pi) * np.sin(2 * np.pi * phase), 1)
        out.append(2 * np.pi * phase)
    return np.stack(out, axis=1)[..., None]


# ---------------------------------------------------------------- many parameters


def _peak(number):
    """Ranges of one peak, whose place stays in its own part of the spectrum."""
    middle = 8 * number
    return {
        f"area_{number}": (2, 500, 50, 250),
        f"place_{number}": (middle - 4, middle + 4, middle - 2, middle + 2),
        f"width_{number}": (0.4, 4, 0.8, 2.2),
    }


@system("many", **_peak(1), **_peak(2), **_peak(3), **_peak(4))
def many_spectrum(parameters, rng):
    """Counts in 40 channels, four peaks upon a background; gamma-ray spectroscopy."""
    peaks = parameters.reshape(-1, 4, 3, 1)
    area, place, width = peaks[:, :, 0], peaks[:, :, 1], peaks[:, :, 2]
    shape = np.exp(-(((np.arange(40) - place) / width) ** 2) / 2)
    height = area / (np.sqrt(2 * np.pi) * width)
    return rng.poisson(2 + (height * shape).sum(axis=1))[..., None]


def _food_web():
    """Growth of three species and the pressure of each upon each."""
    ranges = {f"growth_{i}": (0.05, 1.5, 0.4, 1.1) for i in "abc"}
    for i in "abc":
        for j in "abc":
            ranges[f"press_{i}{j}"] = (0.3, 2.5, 0.7, 1.6) if i == j else (0, 1, 0.1, 0.5)
    return ranges


@system("many", **_food_web())
def many_competitors(parameters, rng):
    """Three competing species (Ricker) in a changing environment, 60 years; ecology."""
    growth, press = parameters[:, :3], parameters[:, 3:].reshape(-1, 3, 3)
    species, out = np.full(growth.shape, 0.5), []
    for weather in rng.standard_normal((60, *growth.shape)):
        pressure = (press @ species[..., None])[..., 0]
        species = species * np.exp(growth - pressure + 0.2 * weather) + 1e-3
        out.append(species)
    return np.stack(out, axis=1)


@system(
    "many",
    **{f"difficulty_{j + 1}": (-3, 3, -1.5, 1.5) for j in range(10)},
    ability_spread=(0.1, 4, 0.6, 2),
)
def many_questions(parameters, rng):
    """Right and wrong answers of 30 pupils to 10 questions (Rasch); education."""
    difficulty, spread = parameters[:, None, :10], parameters[:, 10][:, None, None]
    ability = spread * rng.standard_normal((len(parameters), 30, 1))
    return rng.random((len(parameters), 30, 10)) < 1 / (1 + np.exp(difficulty - ability))


# ---------------------------------------------------------------- short


@system("short", diversity=(2, 300, 25, 120), tilt=(-2, 2, -0.8, 0.8), misread=(0, 0.45, 0.04, 0.2))
def short_site_frequencies(parameters, rng):
    """Site frequencies of 24 chromosomes, ancestral state at times misread; genomics (T=1)."""
    diversity, tilt, misread = columns(parameters)
    copies = np.arange(1, 24)
    expected = diversity / copies * np.exp(-tilt * (copies - 1) / 22)
    return rng.poisson((1 - misread) * expected + misread * expected[:, ::-1])[:, None, :]


@system(
    "short",
    x=(0, 6, 1.5, 4.5),
    y=(0, 6, 1.5, 4.5),
    brightness=(10, 3000, 200, 1000),
    width=(0.4, 3, 0.7, 1.6),
    background=(0.1, 20, 1, 6),
)
def short_star(parameters, rng):
    """A star upon 6 x 6 pixels in one exposure; astronomy (T=1, D=36)."""
    x, y, brightness, width, background = columns(parameters)
    middles = np.arange(6) + 0.5
    across = np.exp(-(((middles - x) / width) ** 2) / 2)
    down = np.exp(-(((middles - y) / width) ** 2) / 2)
    height = brightness / (2 * np.pi * width**2)
    light = height[..., None] * down[:, :, None] * across[:, None, :]
    return rng.poisson(background + light.reshape(-1, 36))[:, None, :]


# ---------------------------------------------------------------- long


@system(
    "long",
    transcription=(0.05, 5, 0.4, 2),
    mrna_decay=(0.02, 0.5, 0.05, 0.25),
    translation=(0.05, 3, 0.2, 1.2),
    protein_decay=(0.01, 0.3, 0.02, 0.1),
)
def long_gene_expression(parameters, rng):
    """Messenger by tau-leaping, its many proteins by Langevin noise, 1000 leaps; cell biology."""
    transcription, mrna_decay, translation, protein_decay = parameters.T
    born = rng.poisson(transcription, (1000, len(transcription)))
    mrna, protein, out = np.zeros(len(transcription)), np.zeros(len(transcription)), []
    for new, shock in zip(born, rng.standard_normal(born.shape), strict=True):
        made, gone = translation * mrna, protein_decay * protein
        protein = np.maximum(protein + made - gone + np.sqrt(made + gone) * shock, 0)
        mrna = mrna + new - np.minimum(rng.poisson(mrna_decay * mrna), mrna)
        out.append(np.stack([mrna, protein], axis=-1))
    return np.stack(out, axis=1)


@system("long", depth=(0.2, 4, 0.6, 2.2), tilt=(-1, 1, -0.3, 0.3), noise=(0.1, 2, 0.4, 1.1))
def long_ice_ages(parameters, rng):
    """Climate in two wells, cold and warm, pushed across by noise, 1000 steps; geophysics."""
    depth, tilt, noise = parameters.T
    x, out = np.where(rng.random(len(depth)) < 0.5, -1.0, 1.0), []
    kicks = np.sqrt(0.1) * noise * rng.standard_normal((1000, len(depth)))
    for kick in kicks:
        x = np.clip(x + 0.1 * (depth * (x - x**3) + tilt) + kick, -2.2, 2.2)
        out.append(x)
    return np.stack(out, axis=1)[..., None]


# ---------------------------------------------------------------- regimes


@system(
    "regime",
    calm=(0.1, 3, 0.4, 1.1),
    ratio=(1.2, 12, 2.5, 6),
    to_storm=(0.005, 0.4, 0.02, 0.1),
    to_calm=(0.01, 0.6, 0.05, 0.25),
)
def regime_volatility(parameters, rng):
    """Daily returns of calm and stormy months, volatility times `ratio` in storms; finance."""
    calm, ratio, to_storm, to_calm = parameters.T
    storm = two_states(to_storm, to_calm, 150, rng)
    volatility = calm[:, None] * np.where(storm, ratio[:, None], 1)
    return (volatility * rng.standard_normal(storm.shape))[..., None]


# ---------------------------------------------------------------- exchangeable


@system(
    "exchangeable",
    swapped([("place_a", "supply_a"), ("place_b", "supply_b")]),
    place_a=(-8, 8, -5, -2),
    supply_a=(0.1, 5, 1.5, 3.5),
    place_b=(-8, 8, 1, 5),
    supply_b=(0.1, 5, 0.6, 1.8),
)
def exchangeable_two_chambers(parameters, rng):
    """Uplift at 8 stations above two magma chambers, six surveys; volcanology."""
    place, supply = parameters[:, [0, 2], None], parameters[:, [1, 3], None]
    stations = np.linspace(-7, 7, 8)
    uplift = (supply / (1 + ((stations - place) / 2) ** 2) ** 1.5).sum(axis=1)
    return uplift[:, None, :] + 0.15 * rng.standard_normal((len(uplift), 6, 8))


@system(
    "exchangeable",
    swapped([("frequency_a", "strength_a"), ("frequency_b", "strength_b")]),
    frequency_a=(0.05, 1.6, 0.2, 0.5),
    strength_a=(0.05, 4, 0.5, 1.5),
    frequency_b=(0.05, 1.6, 0.8, 1.3),
    strength_b=(0.05, 4, 1, 2.5),
)
def exchangeable_two_rhythms(parameters, rng):
    """Sum of two brain rhythms whose phases wander, in noise; electroencephalography."""
    frequency, strength = parameters[:, [0, 2], None], parameters[:, [1, 3], None]
    wander = np.cumsum(0.1 * rng.standard_normal((len(parameters), 2, 80)), axis=-1)
    start = 2 * np.pi * rng.random((len(parameters), 2, 1))
    waves = strength * np.cos(frequency * np.arange(80) + start + wander)
    return (waves.sum(axis=1) + 0.4 * rng.standard_normal((len(parameters), 80)))[..., None]


@system(
    "exchangeable",
    swapped([("service_a",), ("service_b",)]),
    service_a=(0.05, 4, 0.3, 0.8),
    service_b=(0.05, 4, 1.5, 3),
)
def exchangeable_two_servers(parameters, rng):
    """Time in the shop of 60 customers, two servers of different speed, one line; queues."""
    rows = np.arange(len(parameters))
    arrivals = np.cumsum(rng.exponential(size=(60, len(rows))), axis=0)
    free, out = np.zeros(parameters.shape), []
    for arrival in arrivals:
        idle = (free <= arrival[:, None]).all(axis=1)
        server = np.where(idle, rng.integers(2, size=len(rows)), free.argmin(axis=1))
        service = parameters[rows, server] * rng.exponential(size=len(rows))
        leaving = np.maximum(arrival, free[rows, server]) + service
        free[rows, server] = leaving
        out.append(leaving - arrival)
    return np.stack(out, axis=1)[..., None]


@system(
    "exchangeable",
    swapped([("rate_1", "size_1"), ("rate_2", "size_2"), ("rate_3", "size_3")]),
    rate_1=(0.05, 5, 0.5, 2.5),
    size_1=(10, 220, 35, 60),
    rate_2=(0.05, 5, 0.5, 2.5),
    size_2=(10, 220, 90, 115),
    rate_3=(0.05, 5, 0.5, 2.5),
    size_3=(10, 220, 145, 180),
)
def exchangeable_three_units(parameters, rng):
    """Gap and size of 40 spikes from three neurons at one electrode; spike sorting."""
    rates, sizes = parameters[:, 0::2], parameters[:, 1::2]
    firing = rng.exponential(size=(len(rates), 40, 3)) / rates[:, None, :]
    unit, gap = firing.argmin(axis=-1), firing.min(axis=-1)
    size = np.take_along_axis(sizes, unit, axis=1)
    return np.stack([gap, size + 8 * rng.standard_normal(size.shape)], axis=-1)


@system(
    "exchangeable",
    swapped([("first",), ("second",)]),
    first=(0.05, 10, 0.2, 0.6),
    second=(0.05, 10, 1.2, 4),
)
def exchangeable_two_steps(parameters, rng):
    """Dwell times of a molecular motor that needs two chemical steps in line; biophysics."""
    first, second = columns(parameters)
    one, other = rng.exponential(size=(2, len(first), 50))
    return (one / first + other / second)[..., None]


@system(
    "exchangeable",
    swapped([("pull_a", "jitter_a"), ("pull_b", "jitter_b")]),
    pull_a=(0.01, 0.9, 0.05, 0.2),
    jitter_a=(0.05, 3, 0.2, 0.7),
    pull_b=(0.01, 0.9, 0.3, 0.7),
    jitter_b=(0.05, 3, 1, 2.2),
)
def exchangeable_two_fish(parameters, rng):
    """Left and right end of a pair of fish in a channel, told without names; animal movement."""
    pull, jitter = parameters[:, [0, 2]], parameters[:, [1, 3]]
    place, out = np.zeros(pull.shape), []
    for shock in rng.standard_normal((80, *pull.shape)):
        place = (1 - pull) * place + jitter * shock
        out.append(np.sort(place, axis=1))
    return np.stack(out, axis=1)


# ---------------------------------------------------------------- mirrored


@system(
    "mirrored",
    lambda truth: [dict(truth, offset=-truth["offset"])],
    offset=(-6, 6, 1, 4),
    speed=(0.05, 2, 0.3, 1.2),
    nearest=(0, 30, 8, 22),
)
def mirrored_sonar(parameters, rng):
    """Distance to a ship that passes on one side or the other; sonar."""
    offset, speed, nearest = columns(parameters)
    distance = np.hypot(offset, speed * (np.arange(30) - nearest))
    return (distance + 0.2 * rng.standard_normal(distance.shape))[..., None]


@system(
    "mirrored",
    lambda truth: [dict(truth, selection=-truth["selection"])],
    selection=(-0.4, 0.4, 0.06, 0.25),
    mutation=(0.001, 0.15, 0.01, 0.06),
    population=(20, 500, 50, 250),
)
def mirrored_rarer_allele(parameters, rng):
    """Frequency of the rarer of two alleles, whichever that is, from one half; genetics."""
    selection, mutation, population = parameters.T
    size, frequency, out = whole(population, rng), np.full(len(selection), 0.5), []
    for _ in range(40):
        favored = frequency * np.exp(selection)
        expected = favored / (1 - frequency + favored)
        expected = expected + mutation * (1 - 2 * expected)
        frequency = thinned(size, expected, rng) / size
        out.append(np.minimum(frequency, 1 - frequency))
    return np.stack(out, axis=1)[..., None]


def _flip_flop(truth):
    """The twin with absorption and elimination exchanged, in another volume."""
    absorption, elimination = truth["absorption"], truth["elimination"]
    volume = truth["volume"] * elimination / absorption
    return [{"absorption": elimination, "elimination": absorption, "volume": volume}]


@system(
    "mirrored",
    _flip_flop,
    absorption=(0.05, 4, 0.8, 2),
    elimination=(0.05, 4, 0.15, 0.5),
    volume=(0.5, 80, 10, 35),
)
def mirrored_flip_flop(parameters, rng):
    """Blood level of a drug taken by mouth; fast in and slow out, or slow in and fast out."""
    absorption, elimination, volume = columns(parameters)
    hours = np.array([0.25, 0.5, 1, 1.5, 2, 3, 4, 6, 8, 12, 18, 24])
    mean, gap = (absorption + elimination) / 2, np.abs(absorption - elimination) + 1e-9
    shape = np.exp(-(mean - gap / 2) * hours) - np.exp(-(mean + gap / 2) * hours)
    level = 100 / volume * absorption * shape / gap
    relative, absolute = rng.standard_normal((2, *level.shape))
    return (level * np.exp(0.1 * relative) + 0.03 * absolute)[..., None]


# ---------------------------------------------------------------- ridges


@system(
    "ridge", occupied=(0.05, 1, 0.35, 0.85), detected=(0.05, 1, 0.35, 0.85), calls=(0.1, 12, 1, 6)
)
def ridge_occupancy(parameters, rng):
    """Frog calls at 50 ponds, one visit each; only occupied x detected shows; wildlife."""
    occupied, detected, calls = columns(parameters)
    at_home = rng.random((len(occupied), 50)) < occupied
    heard = at_home & (rng.random(at_home.shape) < detected)
    return (heard * (1 + rng.poisson(np.broadcast_to(calls, heard.shape))))[..., None]


@system("ridge", sun=(0, 5, 1, 3.5), stove=(0, 5, 1, 3.5), cooling=(0.02, 0.7, 0.08, 0.35))
def ridge_heating(parameters, rng):
    """Warming of a hut by sun and by stove, of which only the sum shows; building physics."""
    sun, stove, cooling = parameters.T
    warmth, out = np.zeros(len(sun)), []
    for draft in rng.standard_normal((50, len(sun))):
        warmth = warmth + sun + stove - cooling * warmth + draft
        out.append(warmth)
    return np.stack(out, axis=1)[..., None]


# ---------------------------------------------------------------- angles


@system("angles", home=(-np.pi, np.pi, -2, 2), focus=(0.1, 30, 1.5, 9), lost=(0, 0.9, 0.1, 0.5))
def angles_pigeons(parameters, rng):
    """Vanishing angles of 40 pigeons, a part of them lost, the rest von Mises; homing."""
    home, focus, lost = columns(parameters)
    homing = rng.vonmises(0, np.broadcast_to(focus, (len(home), 40))) + home
    anywhere = 2 * np.pi * rng.random(homing.shape)
    angle = np.where(rng.random(homing.shape) < lost, anywhere, homing)
    return (np.mod(angle + np.pi, 2 * np.pi) - np.pi)[..., None]


# ---------------------------------------------------------------- swarms


@system(
    "swarm", gathering=(0, 1.5, 0.1, 0.8), aligning=(0, 2, 0.2, 1.2), jitter=(0.02, 1.5, 0.15, 0.7)
)
def swarm_school(parameters, rng):
    """Places of three fish in the plane that gather and align; collective motion (D=6)."""
    gathering, aligning, jitter = (value[..., None] for value in columns(parameters))
    place, velocity = rng.standard_normal((2, len(parameters), 3, 2))
    out = []
    for push in rng.standard_normal((60, *place.shape)):
        to_middle = place.mean(axis=1, keepdims=True) - place
        to_others = velocity.mean(axis=1, keepdims=True) - velocity
        force = gathering * to_middle + aligning * to_others - 0.2 * velocity
        velocity = velocity + 0.3 * force + jitter * push
        place = place + 0.3 * velocity
        out.append(place.reshape(-1, 6))
    return np.stack(out, axis=1)


@system(
    "swarm",
    sensitivity=(0.1, 3, 0.5, 2),
    top_speed=(2, 25, 7, 16),
    spacing=(4, 16, 7, 12),
    jitter=(0.02, 2, 0.15, 0.8),
)
def swarm_ring_road(parameters, rng):
    """Speeds of six cars on a ring road, each minding the gap ahead; traffic (D=6)."""
    sensitivity, top_speed, spacing, jitter = columns(parameters)
    place = 10 * np.arange(6) + 1.5 * rng.standard_normal((len(parameters), 6))
    speed, out = np.broadcast_to(top_speed / 2, place.shape), []
    for k, noise in enumerate(rng.standard_normal((120, *place.shape))):
        gap = np.roll(place, -1, axis=1) - place
        gap[:, -1] += 60
        wanted = top_speed / 2 * (1 + np.tanh((gap - spacing) / 3))
        speed = speed + 0.2 * sensitivity * (wanted - speed) + jitter * np.sqrt(0.2) * noise
        place = place + 0.2 * speed
        if k % 2:
            out.append(speed)
    return np.stack(out, axis=1)


# ---------------------------------------------------------------- correlated signals


@system(
    "correlated",
    slow_east=(-1, 1, -0.5, 0.5),
    slow_north=(-1, 1, -0.5, 0.5),
    noise=(0.02, 1, 0.08, 0.4),
)
def correlated_seismic_array(parameters, rng):
    """One wave at five seismometers, a little later at some of them; seismology."""
    slow_east, slow_north, noise = (value[..., None] for value in columns(parameters))
    east, north = np.array([0, 1, -0.8, 0.3, -0.5]), np.array([0, 0.2, 0.7, -1, -0.6])
    time = np.arange(60)[:, None] - slow_east * east - slow_north * north
    wave = np.zeros(time.shape)
    for frequency in (0.25, 0.45, 0.7, 1.0):
        cosine, sine = rng.standard_normal((2, len(time), 1, 1))
        wave += cosine * np.cos(frequency * time) + sine * np.sin(frequency * time)
    return wave + noise * rng.standard_normal(wave.shape)


@system(
    "correlated",
    ratio=(0.1, 3, 0.5, 1.8),
    reversion=(0.02, 1, 0.1, 0.6),
    wobble=(0.03, 2, 0.15, 0.7),
    volatility=(0.1, 3, 0.5, 1.5),
)
def correlated_prices(parameters, rng):
    """Two prices bound to each other, a random walk and its follower; finance."""
    ratio, reversion, wobble, volatility = parameters.T
    leader, spread, out = np.zeros(len(ratio)), np.zeros(len(ratio)), []
    for news, gossip in rng.standard_normal((100, 2, len(ratio))):
        leader = leader + volatility * news
        spread = (1 - reversion) * spread + wobble * gossip
        out.append(np.stack([leader, ratio * leader + spread], axis=-1))
    return np.stack(out, axis=1)


@system(
    "correlated",
    upper_store=(0, 0.95, 0.25, 0.75),
    lower_store=(0, 0.95, 0.25, 0.75),
    rain=(0.1, 5, 0.7, 2.5),
    noise=(0.01, 1, 0.05, 0.4),
)
def correlated_river_gauges(parameters, rng):
    """Three gauges down a river, each lake smoothing what comes from above; hydrology."""
    upper_store, lower_store, rain, noise = parameters.T
    upper, middle, lower = np.zeros((3, len(rain)))
    out = []
    for shock in rng.standard_normal((100, len(rain))):
        upper = 0.9 * upper + rain * shock
        middle = upper_store * middle + (1 - upper_store) * upper
        lower = lower_store * lower + (1 - lower_store) * middle
        out.append(np.stack([upper, middle, lower], axis=-1))
    flow = np.stack(out, axis=1)
    return flow + noise[:, None, None] * rng.standard_normal(flow.shape)


# ---------------------------------------------------------------- irrelevant


@system(
    "irrelevant",
    drive=(0.1, 4, 0.6, 2.5),
    leak=(0.01, 0.4, 0.03, 0.15),
    noise=(0.1, 3, 0.4, 1.5),
    calcium=(0, 10, 2, 8),
)
def irrelevant_neuron(parameters, rng):
    """Spikes and voltage of a leaky neuron in 50 bins; nothing uses `calcium`; neuroscience."""
    drive, leak, noise, _ = parameters.T
    voltage, spikes, out = np.zeros(len(drive)), np.zeros(len(drive)), []
    for k, shock in enumerate(rng.standard_normal((400, len(drive)))):
        voltage = voltage + drive - leak * voltage + noise * shock
        fires = voltage > 10
        voltage, spikes = np.where(fires, 0, voltage), spikes + fires
        if k % 8 == 7:
            out.append(np.stack([spikes, voltage], axis=-1))
            spikes = np.zeros(len(drive))
    return np.stack(out, axis=1)


# ---------------------------------------------------------------- plain


@system("plain", stiffness=(0.3, 30, 2, 12), bond=(0.1, 3, 0.5, 1.8), force=(0, 1.5, 0.1, 0.6))
def plain_polymer(parameters, rng):
    """Places of 50 monomers of a stiff chain pulled upward, in space; polymer physics (D=3)."""
    stiffness, bond, force = columns(parameters)
    pull = force * np.array([0.0, 0.0, 1.0])
    direction, out = rng.standard_normal((len(force), 3)), []
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    for bend in rng.standard_normal((50, len(force), 3)):
        direction = direction + pull + bend / np.sqrt(stiffness)
        direction = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        out.append(bond * direction)
    return np.cumsum(np.stack(out, axis=1), axis=1)


@system("plain", threshold=(-4, 4, -1.5, 1.5), slope=(0.2, 8, 0.8, 4), lapse=(0, 0.4, 0.03, 0.2))
def plain_staircase(parameters, rng):
    """Level and answer of 60 trials, easier after a miss, harder after a hit; psychophysics."""
    threshold, slope, lapse = parameters.T
    level, out = np.full(len(slope), 2.0), []
    for uniform in rng.random((60, len(slope))):
        seen = 1 / (1 + np.exp(-slope * (level - threshold)))
        hit = uniform < lapse / 2 + (1 - lapse) * seen
        out.append(np.stack([level, hit], axis=-1))
        level = level + np.where(hit, -0.3, 0.5)
    return np.stack(out, axis=1)
