"""The methods of section 4.5 and beside it: least squares with theorem 1, and likelihood-free inference."""

import logging
import warnings
from collections.abc import Sequence
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.coevolution import Samples
from turing_learning.errors import integer, optional, require
from turing_learning.evolution import EvolutionStrategy, generation_rng
from turing_learning.purposes import LEAST_SQUARES_MODELS, LEAST_SQUARES_TRIALS
from turing_learning.swarm import MixedSwarm, Scenario

from ._experiment import Stop

LATE_SHARE = 0.3
"""Share of the generations, the last ones, that the typical model of `least_squares` is about."""
CLOSE = 1e-6
"""Agreement of a minimum that was searched for with the one that the theorem states."""


def least_squares(
    scenario: Scenario, seed: int = 1, *, generations: int = 1000, parents: int = 50, offspring: int = 50,
    threads: int | None = None, should_stop: Stop | None = None,
) -> dict[str, np.ndarray] | None:  # fmt: skip
    """Infer a controller by least squares, with the optimizer and the trials of Turing Learning (paper, section 4.5).

    Returns the best model (P,) of the last generation in its one trial, the paper's rule; and the
    typical one, the median over the last three tenths of the generations of the median of all
    models; None if it was stopped. Speeds are divided by the robot's largest: in cm/s and rad/s,
    the difference of the wheels would have a seventh of the weight of their sum.
    """
    integer("generations", generations, 1)
    source = MixedSwarm(scenario, threads)
    parameters = len(scenario.parameter_names)
    seeds = (LEAST_SQUARES_MODELS, seed)
    optimizer = EvolutionStrategy(parameters, parents=parents, offspring=offspring, seed=seeds)
    models = np.empty((0, 0))
    errors = np.empty(0)
    medians = np.empty((generations, parameters))
    for generation in range(generations):
        if should_stop is not None and should_stop():
            return None
        models = optimizer.ask()
        samples = source.collect(models, generation_rng((LEAST_SQUARES_TRIALS, seed), generation))
        errors = squared_errors(samples, scenario.input_scale)
        optimizer.tell(-errors)
        medians[generation] = np.median(models, axis=0)
    late = medians[-max(1, round(LATE_SHARE * generations)) :]
    return {"best": models[int(np.argmin(errors))], "typical": np.median(late, axis=0)}


def squared_errors(samples: Samples, scale: Sequence[float] | np.ndarray = (1.0,)) -> np.ndarray:
    """Return the squared error (M,) of each model against the agents of its trial, of the mixed swarm (paper, section 4.5).

    It is summed over agents, steps and signals, which are divided by `scale` (D,) or (1,), and
    averaged over C counterfeit samples.
    """
    genuine = samples.genuine
    counterfeit = samples.counterfeit
    models = len(counterfeit)
    signals = genuine.shape[-1]
    rule = f"hold as many genuine samples for each of the {models} models"
    require(len(genuine) % models == 0, "samples", rule, f"{len(genuine)} in all")
    divisor = array("scale", scale, "D")
    fits = len(divisor) in (1, signals) and (divisor > 0).all()
    require(fits, "scale", f"be {signals} finite numbers above 0, or one", divisor.tolist())
    agents = genuine.reshape(-1, models, *genuine.shape[1:])
    return np.square((agents[:, :, None] - counterfeit) / divisor).sum(axis=(0, 3, 4)).mean(axis=1)


def least_squares_optimum(
    probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike
) -> np.ndarray:
    """Return the model (n,) with the smallest expected squared error, for n states with probabilities (T, n) in T time steps.

    State i gets the mean over time of the expected value of the agent's outputs (n,), weighted by
    the probability of the state, or the plain mean if it never occurs. Paper, section 4.5, theorem
    1 and corollaries 2 and 3; the third for any number of states.
    """
    chances, outputs = _checked(probabilities, values)
    expected = chances @ outputs
    weights = chances.sum(axis=0)
    # A state that never occurs has no weights: the plain mean stands for it.
    never = weights == 0
    optimum = (chances * expected[:, None]).sum(axis=0) / np.where(never, 1.0, weights)
    return np.where(never, expected.mean(), optimum)


def expected_squared_error(
    model: np.typing.ArrayLike, probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike
) -> float:
    """Return the expected squared error of a model (n,) of an agent with outputs `values` (n,), summed over T time steps.

    `probabilities` (T, n) are those of the states, of both alike. Paper, section 4.5, the proof of
    theorem 1.
    """
    chances, outputs = _checked(probabilities, values)
    squares = np.square(np.asarray(model, dtype=np.float64)[:, None] - outputs)
    return float(np.einsum("ti,tj,ij->", chances, chances, squares))


def _checked(
    probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    chances = array("probabilities", probabilities, "T n")
    sums = chances.sum(axis=1)
    fits = (chances >= 0).all() and np.allclose(sums, 1)
    rule = "be 0 or more and sum to 1 in every time step"
    require(fits, "probabilities", rule, sums.tolist()[:3])
    return chances, array("values", values, "n", n=chances.shape[1])


@dataclass(frozen=True)
class StatementCheck:
    """How a statement of the paper fares in random cases."""

    statement: str  # in the paper's numbering
    cases: int
    # largest distance of a minimum that was searched for from the one that is stated
    difference: float
    distance: float  # smallest distance of that minimum from the agent's outputs

    @property
    def holds(self) -> bool:
        """Whether the minimum is where it is stated to be, and not at the agent."""
        return self.difference < CLOSE < self.distance


def check_statements(cases: int, seed: int = 0) -> tuple[StatementCheck, ...]:
    """Check theorem 1 and its corollaries, in random cases each, by a search for the least expected error."""
    integer("cases", cases, 1)
    rng = np.random.default_rng(seed)
    checks = []
    for statement, states, steps in (
        ("theorem 1 and corollary 1: two states", 2, 1),
        ("corollary 2: three to six states", None, 1),
        ("corollary 3: two states, ten time steps", 2, 10),
    ):
        differences = []
        distances = []
        for _ in range(cases):
            count = states or int(rng.integers(3, 7))
            chances = rng.dirichlet(np.full(count, 5.0), steps)
            outputs = rng.uniform(-1, 1, count)
            minimum = _searched_minimum(chances, outputs, rng)
            differences.append(np.abs(minimum - _stated_minimum(chances, outputs)).max())
            distances.append(np.abs(minimum - outputs).max())
        checks.append(
            StatementCheck(statement, cases, float(max(differences)), float(min(distances)))
        )
    return tuple(checks)


def _searched_minimum(
    chances: np.ndarray, outputs: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Search from a random start: it knows nothing of the statements."""
    from scipy.optimize import minimize

    start = rng.uniform(-3, 3, len(outputs))
    search = minimize(expected_squared_error, start, (chances, outputs), tol=1e-12, method="Powell")
    return np.asarray(search.x)


def _stated_minimum(chances: np.ndarray, outputs: np.ndarray) -> np.ndarray:
    """Return E{Y} in all states for one time step, else the paper's equation for x_1 and x_2."""
    if len(chances) == 1:
        return np.full(len(outputs), chances[0] @ outputs)
    sums = chances.sum(axis=0)
    own_weight = np.square(chances).sum(axis=0) / sums
    other_weight = (chances * (1 - chances)).sum(axis=0) / sums
    return np.asarray(own_weight * outputs + other_weight * outputs[::-1])


HIGHEST_SPEED = 1.5
"""Wheel speeds of models are between minus this and this (share of the maximum): no truth is on the border."""
TURN_RATE_LEVELS = 20
"""Parts into which the cycles are cut, in the order of their turn rates."""
AUTOCORRELATION_LAGS = (1, 10)
"""Of the autocorrelations (cycles)."""
MIXTURE_CYCLES = 50_000
"""Cycles that the mixture is fitted to, at most: the estimate hardly changes with more."""
SPARE_COMPONENTS = 1
"""Components of the mixture beyond the sensor states, for collisions."""
POSTERIOR_DRAWS = 2000
"""Draws of a neural posterior, from which its quantiles are taken."""
MASS_OUTSIDE = 1e-3
"""Mass of the posterior that a later round does not search."""
SUPPORT_DRAWS = 10_000
"""Draws of the posterior that tell where this is."""
BOX_MARGIN = 0.2
"""Margin of the box around these draws, on each side, as a share of its length."""


@dataclass(frozen=True)
class Inferred:
    """What a method has inferred: parameters (P,), and the ends of the central 90 %, None if it has none."""

    estimate: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None

    @classmethod
    def of_posterior(cls, draws: np.ndarray, weights: np.ndarray | None = None) -> "Inferred":
        """Return median and central 90 % of draws (N, P) from a posterior, with weights (N,)."""
        if weights is None:
            weights = np.ones(len(draws))
        low, middle, high = np.quantile(
            draws, (0.05, 0.5, 0.95), axis=0, weights=weights, method="inverted_cdf"
        )
        return cls(middle, low, high)


@dataclass(frozen=True)
class Groups:
    """Groups of `size` trials of a mixed swarm; in those of a group, every replica executes the same model."""

    scenario: Scenario
    size: int = 10

    def __post_init__(self) -> None:
        integer("size", self.size, 1)

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return models (M, P) from the prior: uniform, between -1.5 and 1.5 of the largest wheel speed."""
        return rng.uniform(-HIGHEST_SPEED, HIGHEST_SPEED, (count, len(self.scenario.controller)))

    def observe(self, trials: int, rng: np.random.Generator) -> np.ndarray:
        """Return the motion of the agents (K, T, 2) in trials whose replicas execute models from the prior."""
        return MixedSwarm(self.scenario, threads=1).collect(self.draw(trials, rng), rng).genuine

    def simulate(self, models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the summaries (M, S) of a group of replicas of each model (M, P)."""
        swarm = MixedSwarm(self.scenario, threads=1)
        motion = swarm.collect(np.repeat(models, self.size, axis=0), rng).counterfeit
        return summaries(motion.reshape(len(models), -1, *motion.shape[-2:]), self.scenario)


def wheel_speeds(motion: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Compute wheel speeds, as fractions of the maximum, from speeds along chords (cm/s) and turn rates (rad/s): (..., 2)."""
    linear, angular = motion[..., 0], motion[..., 1]
    chord_over_arc = np.sinc(angular * scenario.trial.control_interval_s / (2 * np.pi))
    # Near a full turn in a cycle the chord says nothing of the arc.
    forward = linear / np.where(np.abs(chord_over_arc) < 1e-3, 1.0, chord_over_arc)
    difference = angular * scenario.robot.wheel_distance_cm / 2
    return (
        np.stack([forward - difference, forward + difference], axis=-1)
        / scenario.robot.maximum_speed_cm_s
    )


def summaries(motion: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Compute the summaries (..., S) of groups with motion (..., C, T, 2); C T is a multiple of 20, T > 10.

    Of both wheels: mean, standard deviation, autocorrelations, covariance; and the means in each
    twentieth of all cycles in the order of the turn rate, which tells the sensor states of reactive
    behaviors apart.
    """
    wheels = wheel_speeds(motion, scenario)
    cycles = wheels.reshape(*wheels.shape[:-3], -1, 2)
    mean = cycles.mean(axis=-2)
    variance = cycles.var(axis=-2) + 1e-9
    centered = wheels - mean[..., None, None, :]
    correlations = []
    for lag in AUTOCORRELATION_LAGS:
        products = centered[..., lag:, :] * centered[..., :-lag, :]
        correlations.append(products.mean(axis=(-3, -2)) / variance)
    covariance = centered.prod(axis=-1).mean(axis=(-2, -1))
    order = np.argsort(cycles[..., 1] - cycles[..., 0], axis=-1)
    ordered = np.take_along_axis(cycles, order[..., None], axis=-2)
    levels = ordered.reshape(*cycles.shape[:-2], TURN_RATE_LEVELS, -1, 2).mean(axis=-2)
    flat_levels = levels.reshape(*levels.shape[:-2], -1)
    columns = [mean, np.sqrt(variance), *correlations, covariance[..., None], flat_levels]
    return np.concatenate(columns, axis=-1)


def baseline(name: str) -> ModuleType:
    """Return a package of the extra `baselines`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return optional(name, name.partition(".")[0], "baselines")


def fit_mixture(genuine: np.ndarray, scenario: Scenario, seed: int) -> Inferred:
    """Infer a reactive behavior from the levels of the wheel speeds in the agents' motion (K, T, 2): centers of a mixture.

    The heaviest components count, in the order of their weights: the rarest level is that of the
    last sensor state.
    """
    wheels = wheel_speeds(genuine, scenario).reshape(-1, 2)
    count = min(len(wheels), MIXTURE_CYCLES)
    chosen = np.random.default_rng(seed).choice(wheels, count, replace=False)
    states = scenario.sensor.states
    mixtures = baseline("sklearn.mixture")
    mixture = mixtures.GaussianMixture(states + SPARE_COMPONENTS, n_init=3, random_state=seed).fit(
        chosen
    )
    heaviest = np.argsort(-mixture.weights_)[:states]
    return Inferred(mixture.means_[heaviest].ravel())


class _BudgetSpentError(Exception):
    """As many groups have been simulated as were granted."""


def infer_by_abc_smc(
    groups: Groups,
    observed: np.ndarray,
    evaluations: int,
    seed: int,
    should_stop: Stop | None = None,
) -> Inferred | None:
    """Infer a behavior by ABC-SMC as `pyabc` does it, from summaries (S,) of the agents' motion; None if it was stopped.

    `evaluations` groups are simulated, in populations of a size that leaves room for about ten; the
    last complete one counts.
    """
    integer("evaluations", evaluations, 100)
    pyabc = baseline("pyabc")
    names = groups.scenario.parameter_names
    rng = np.random.default_rng(seed)
    spent = 0
    stop = should_stop or (lambda: False)

    def simulate(model: dict[str, float]) -> dict[str, np.ndarray]:
        nonlocal spent
        # pyabc cannot be asked to stop: an error of the simulator ends its run.
        if spent == evaluations or stop():
            raise _BudgetSpentError
        spent += 1
        return {"summaries": groups.simulate(np.array([[model[name] for name in names]]), rng)[0]}

    logger = logging.getLogger("ABC")
    with warnings.catch_warnings(), ExitStack() as after:
        # Hold back what pyabc says, seed its draws, and leave all as it was.
        after.callback(logger.setLevel, logger.level)
        after.callback(np.random.set_state, np.random.get_state())  # noqa: NPY002
        logger.setLevel(logging.ERROR)
        np.random.seed(seed)  # noqa: NPY002
        warnings.simplefilter("ignore")
        uniform = pyabc.RV("uniform", -HIGHEST_SPEED, 2 * HIGHEST_SPEED)
        prior = pyabc.Distribution(**dict.fromkeys(names, uniform))
        method = pyabc.ABCSMC(
            simulate,
            prior,
            pyabc.AdaptivePNormDistance(p=1),
            population_size=round(2 * evaluations**0.5),
            sampler=pyabc.sampler.SingleCoreSampler(),
        )
        history = method.new("sqlite://", {"summaries": observed})
        try:
            method.run()
        except _BudgetSpentError:
            if spent < evaluations:
                return None
        table, weights = history.get_distribution(t=history.max_t)
        return Inferred.of_posterior(table[list(names)].to_numpy(), weights)


def infer_by_npe(
    groups: Groups, observed: np.ndarray, evaluations: int, seed: int, should_stop: Stop | None = None, *,
    rounds: int = 1,
) -> Inferred | None:  # fmt: skip
    """Infer a behavior by neural posterior estimation as `sbi` does it: a flow on standardized summaries; None if stopped.

    Each round but the first draws its models where the posterior of the round before has its mass;
    all train the network. Greenberg and others, Automatic posterior transformation for
    likelihood-free inference, 2019; Deistler and others, Truncated proposals for scalable and
    hassle-free simulation-based inference, 2022.
    """
    enough = rounds >= 1 and evaluations >= 20 * rounds
    rule = "be at least 20 in each of 1 or more rounds"
    require(enough, "evaluations", rule, f"{evaluations} in {rounds}")
    torch = baseline("torch")
    sbi = baseline("sbi.inference")
    utils = baseline("sbi.utils")

    def tensor(array: np.ndarray) -> Any:
        return torch.as_tensor(array, dtype=torch.float32)

    rng = np.random.default_rng(seed)
    with ExitStack() as after:
        # Hold back what sbi says, take one thread, seed what torch draws, and leave all as it was.
        after.enter_context(torch.random.fork_rng(devices=[]))
        after.enter_context(warnings.catch_warnings())
        after.enter_context(redirect_stdout(StringIO()))
        after.enter_context(redirect_stderr(StringIO()))
        after.callback(torch.set_num_threads, torch.get_num_threads())
        torch.set_num_threads(1)
        warnings.simplefilter("ignore")
        torch.manual_seed(seed)
        highest = torch.full((len(groups.scenario.controller),), HIGHEST_SPEED)
        prior = utils.BoxUniform(-highest, highest)
        method = sbi.NPE(prior, show_progress_bars=False, tracker=SILENT_TRACKER)
        proposal: Any = prior
        posterior: Any = None
        for group in np.array_split(np.arange(evaluations), rounds):
            if should_stop is not None and should_stop():
                return None
            if posterior is not None:
                proposal = truncated(utils, posterior, -highest, highest)
            models = proposal.sample((len(group),))
            simulated = groups.simulate(models.numpy().astype(np.float64), rng)
            method.append_simulations(models, tensor(simulated)).train(force_first_round_loss=True)
            posterior = method.build_posterior().set_default_x(tensor(observed))
        draws = posterior.sample((POSTERIOR_DRAWS,), show_progress_bars=False)
        return Inferred.of_posterior(draws.numpy())


def truncated(utils: Any, posterior: Any, low: Any, high: Any) -> Any:
    """Return the uniform prior between two tensors (P,), truncated to where the posterior has its mass.

    It is drawn from a box around that mass.
    """
    inside = utils.get_density_thresholder(
        posterior, quantile=MASS_OUTSIDE, num_samples_to_estimate_support=SUPPORT_DRAWS
    )
    draws = posterior.sample((SUPPORT_DRAWS,), show_progress_bars=False)
    lowest = draws.min(dim=0).values
    highest = draws.max(dim=0).values
    margin = BOX_MARGIN * (highest - lowest)
    box = utils.BoxUniform((lowest - margin).clamp(min=low), (highest + margin).clamp(max=high))
    return utils.RestrictedPrior(box, inside, sample_with="rejection")


def _ignored(*arguments: Any, **options: Any) -> None:
    """Take the place of a method that logs."""


SILENT_TRACKER = SimpleNamespace(
    log_dir=None,
    log_metric=_ignored,
    log_metrics=_ignored,
    log_params=_ignored,
    add_figure=_ignored,
    flush=_ignored,
)
"""In place of sbi's log files."""
