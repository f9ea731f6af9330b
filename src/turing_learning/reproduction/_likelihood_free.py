"""Other ways to infer a behavior: ABC-SMC and neural posterior estimation on summaries of the motion, and a mixture."""

import logging
import warnings
from collections.abc import Callable
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from turing_learning.errors import integer, optional, require
from turing_learning.swarm import MixedSwarm, Scenario

LARGEST = 1.5  # wheel speeds of models lie between minus this and this: behind the agents' largest, so no truth is on the border
LEVELS = 20  # parts into which the cycles are cut, in the order of their turn rates
LAGS = (1, 10)  # of the autocorrelations (cycles)
CYCLES = 50_000  # most cycles that the mixture is fitted to: the estimate hardly changes with more
SPARE = 1  # components of the mixture beyond the sensor states, for collisions
DRAWS = 2000  # from a neural posterior
OUTSIDE = 1e-3  # mass of the posterior that a later round does not search
AROUND = 10_000  # draws of the posterior that tell where this is
MARGIN = 0.2  # of the box around these draws, on each side, as a share of its length

Stop = Callable[[], bool]


@dataclass(frozen=True)
class Inferred:
    """What a method has inferred: parameters (P,), and the ends of the central 90 %, None where it has no interval."""

    estimate: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None

    @classmethod
    def of_posterior(cls, draws: np.ndarray, weights: np.ndarray | None = None) -> "Inferred":
        """Return median and central 90 % of draws (N, P) from a posterior, with weights (N,)."""
        weights = np.ones(len(draws)) if weights is None else weights
        low, middle, high = np.quantile(draws, (0.05, 0.5, 0.95), axis=0, weights=weights, method="inverted_cdf")
        return cls(middle, low, high)


@dataclass(frozen=True)
class Groups:
    """Groups of `size` trials of a mixed swarm; in the trials of a group, every replica executes the same model."""

    scenario: Scenario
    size: int = 10

    def __post_init__(self) -> None:
        integer("size", self.size, 1)

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return models (M, P) from the prior: uniform, between -1.5 and 1.5 of the largest wheel speed."""
        return rng.uniform(-LARGEST, LARGEST, (count, len(self.scenario.controller)))

    def observe(self, trials: int, rng: np.random.Generator) -> np.ndarray:
        """Return the motion of the agents (K, T, 2) in trials whose replicas execute models from the prior."""
        return MixedSwarm(self.scenario, threads=1).collect(self.draw(trials, rng), rng).genuine

    def simulate(self, models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the summaries (M, S) of a group of replicas of each model (M, P)."""
        swarm = MixedSwarm(self.scenario, threads=1)
        motion = swarm.collect(np.repeat(models, self.size, axis=0), rng).counterfeit
        return summaries(motion.reshape(len(models), -1, *motion.shape[-2:]), self.scenario)


def wheel_speeds(motion: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Compute wheel speeds (..., 2), as fractions of the maximum, from the motion (..., 2) of robots that nothing pushes.

    The linear speed (cm/s) is measured along the chord of a cycle; the angular speed is in rad/s.
    """
    linear, angular = motion[..., 0], motion[..., 1]
    chord_over_arc = np.sinc(angular * scenario.trial.control_interval_s / (2 * np.pi))
    forward = linear / np.where(np.abs(chord_over_arc) < 1e-3, 1.0, chord_over_arc)
    difference = angular * scenario.robot.wheel_distance_cm / 2
    return np.stack([forward - difference, forward + difference], axis=-1) / scenario.robot.maximum_speed_cm_s


def summaries(motion: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Compute the summaries (..., S) of groups of individuals with motion (..., C, T, 2); C T must be a multiple of 20, T > 10.

    Of both wheels: mean, standard deviation, autocorrelations; their covariance; and their means in each
    twentieth of the group's cycles, in the order of the turn rate, which tells the sensor states of reactive
    behaviors apart.
    """
    wheels = wheel_speeds(motion, scenario)
    cycles = wheels.reshape(*wheels.shape[:-3], -1, 2)
    mean, variance = cycles.mean(axis=-2), cycles.var(axis=-2) + 1e-9
    centered = wheels - mean[..., None, None, :]
    correlations = [(centered[..., lag:, :] * centered[..., :-lag, :]).mean(axis=(-3, -2)) / variance for lag in LAGS]
    covariance = centered.prod(axis=-1).mean(axis=(-2, -1))
    order = np.argsort(cycles[..., 1] - cycles[..., 0], axis=-1)
    sorted_cycles = np.take_along_axis(cycles, order[..., None], axis=-2)
    levels = sorted_cycles.reshape(*cycles.shape[:-2], LEVELS, -1, 2).mean(axis=-2)
    flat = levels.reshape(*levels.shape[:-2], -1)
    return np.concatenate([mean, np.sqrt(variance), *correlations, covariance[..., None], flat], axis=-1)


def baseline(name: str) -> ModuleType:
    """Return a package of the extra `baselines`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return optional(name, name.partition(".")[0], "baselines")


def fit_mixture(genuine: np.ndarray, scenario: Scenario, seed: int) -> Inferred:
    """Infer a reactive behavior from the levels of the wheel speeds in the agents' motion (K, T, 2).

    The estimate are the centers of the heaviest components, in the order of their weights: the rarest level is
    that of the last sensor state. The scenario tells the wheels and the number of sensor states, not the
    controller.
    """
    wheels = wheel_speeds(genuine, scenario).reshape(-1, 2)
    chosen = np.random.default_rng(seed).choice(wheels, min(len(wheels), CYCLES), replace=False)
    states = scenario.sensor.states
    mixture = baseline("sklearn.mixture").GaussianMixture(states + SPARE, n_init=3, random_state=seed).fit(chosen)
    return Inferred(mixture.means_[np.argsort(-mixture.weights_)[:states]].ravel())


class _BudgetSpentError(Exception):
    """As many groups have been simulated as were granted."""


def infer_by_abc_smc(
    groups: Groups, observed: np.ndarray, evaluations: int, seed: int, should_stop: Stop | None = None
) -> Inferred | None:
    """Infer a behavior by ABC-SMC as `pyabc` does it by default, with an adaptive distance; None if it was stopped.

    `observed` are summaries of the agents' motion (S,), `evaluations` the number of groups to be simulated, at
    least 100. The last complete population counts. Populations have a size that leaves room for about ten.
    """
    integer("evaluations", evaluations, 100)
    pyabc = baseline("pyabc")
    names = groups.scenario.parameter_names
    rng, spent = np.random.default_rng(seed), 0
    stop = should_stop or (lambda: False)

    def simulate(model: dict[str, float]) -> dict[str, np.ndarray]:
        nonlocal spent
        if spent == evaluations or stop():
            raise _BudgetSpentError
        spent += 1
        return {"summaries": groups.simulate(np.array([[model[name] for name in names]]), rng)[0]}

    logger = logging.getLogger("ABC")
    with (
        warnings.catch_warnings(),
        ExitStack() as after,
    ):  # hold back what pyabc says, seed what it draws, leave all as it was
        after.callback(logger.setLevel, logger.level)
        after.callback(np.random.set_state, np.random.get_state())  # noqa: NPY002
        logger.setLevel(logging.ERROR)
        np.random.seed(seed)  # noqa: NPY002
        warnings.simplefilter("ignore")
        prior = pyabc.Distribution(**{name: pyabc.RV("uniform", -LARGEST, 2 * LARGEST) for name in names})
        distance, sampler = pyabc.AdaptivePNormDistance(p=1), pyabc.sampler.SingleCoreSampler()
        size = round(2 * evaluations**0.5)
        method = pyabc.ABCSMC(simulate, prior, distance, population_size=size, sampler=sampler)
        history = method.new("sqlite://", {"summaries": observed})
        try:
            method.run()
        except _BudgetSpentError:
            if spent < evaluations:
                return None
        table, weights = history.get_distribution(t=history.max_t)
        return Inferred.of_posterior(table[list(names)].to_numpy(), weights)


def infer_by_npe(
    groups: Groups,
    observed: np.ndarray,
    evaluations: int,
    seed: int,
    should_stop: Stop | None = None,
    *,
    rounds: int = 1,
) -> Inferred | None:
    """Infer a behavior by neural posterior estimation as `sbi` does it by default: a flow on standardized summaries.

    With several rounds, each but the first draws its models from the part of the prior in which the posterior
    of the round before has its mass (truncated sequential estimation), and all rounds train the network. At
    least 20 groups are simulated in a round. None if it was stopped.

    Source
    ------
    Greenberg, Nonnenmacher, Macke, Automatic posterior transformation for likelihood-free inference, 2019; Deistler,
    Goncalves, Macke, Truncated proposals for scalable and hassle-free simulation-based inference, 2022.
    """
    enough = rounds >= 1 and evaluations >= 20 * rounds
    require(enough, "evaluations", "be at least 20 in each of 1 or more rounds", f"{evaluations} in {rounds}")
    torch, sbi, utils = baseline("torch"), baseline("sbi.inference"), baseline("sbi.utils")

    def tensor(array: np.ndarray) -> Any:
        return torch.as_tensor(array, dtype=torch.float32)

    rng = np.random.default_rng(seed)
    silence = warnings.catch_warnings(), redirect_stdout(StringIO()), redirect_stderr(StringIO())
    with ExitStack() as after:  # hold back what sbi says, take one thread, seed what torch draws, leave all as it was
        for context in (torch.random.fork_rng(devices=[]), *silence):
            after.enter_context(context)
        after.callback(torch.set_num_threads, torch.get_num_threads())
        torch.set_num_threads(1)
        warnings.simplefilter("ignore")
        torch.manual_seed(seed)
        end = torch.full((len(groups.scenario.controller),), LARGEST)
        prior = utils.BoxUniform(-end, end)
        method = sbi.NPE(prior, show_progress_bars=False, tracker=_NO_TRACKER)
        posterior: Any = None
        for part in np.array_split(np.arange(evaluations), rounds):
            if should_stop is not None and should_stop():
                return None
            models = (prior if posterior is None else _truncated(utils, posterior)).sample((len(part),))
            found = groups.simulate(models.numpy().astype(np.float64), rng)
            method.append_simulations(models, tensor(found)).train(force_first_round_loss=True)
            posterior = method.build_posterior().set_default_x(tensor(observed))
        return Inferred.of_posterior(posterior.sample((DRAWS,), show_progress_bars=False).numpy())


def _truncated(utils: Any, posterior: Any) -> Any:
    """Return the uniform prior where the posterior has its mass, to be drawn by rejection from a box around draws of the posterior.

    Of the whole prior, next to no draw may lie there, and all that are rejected would be kept in memory.
    """
    inside = utils.get_density_thresholder(posterior, quantile=OUTSIDE, num_samples_to_estimate_support=AROUND)
    draws = posterior.sample((AROUND,), show_progress_bars=False)
    least, most = draws.min(dim=0).values, draws.max(dim=0).values
    margin = MARGIN * (most - least)
    box = utils.BoxUniform((least - margin).clamp(min=-LARGEST), (most + margin).clamp(max=LARGEST))
    return utils.RestrictedPrior(box, inside, sample_with="rejection")


_LOGGED = "log_metric", "log_metrics", "log_params", "add_figure", "flush"
_NO_TRACKER = SimpleNamespace(
    log_dir=None, **dict.fromkeys(_LOGGED, lambda *what, **more: None)
)  # in place of sbi's log files
