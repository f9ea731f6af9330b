"""The metric-based baseline of section 4.5, least squares, and what its error leads to: theorem 1 and its corollaries."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from turing_learning.arrays import array
from turing_learning.coevolution import Samples
from turing_learning.errors import integer, require
from turing_learning.evolution import EvolutionStrategy, Seed, generation_rng
from turing_learning.purposes import LEAST_SQUARES_MODELS, LEAST_SQUARES_TRIALS
from turing_learning.swarm import MixedSwarm, Scenario

LATE = 0.3  # share of the generations, the last ones, that `Inferred.typical` is about
CLOSE = 1e-6  # agreement of a minimum that was searched for with the one that the theorem states


@dataclass(frozen=True, eq=False)
class Inferred:
    """What least squares has inferred."""

    best: (
        np.ndarray
    )  # (P,), of the last generation, with the smallest error: the paper's rule; a model has one trial in it
    typical: np.ndarray  # (P,), the median over the last three tenths of the generations of the median of all models


@dataclass(frozen=True)
class LeastSquares:
    """Infer a scenario's controller by least squares, with the optimizer and the trials of Turing Learning.

    Speeds are divided by the robot's largest, as the classifiers' inputs are: then both wheels count the
    same. In cm/s and rad/s, the difference of the wheels would have a seventh of the weight of their sum.

    Parameters
    ----------
    scenario
        What is observed.
    generations
        Number of generations G, >= 1.
    parents, offspring
        Sizes of the evolution strategy.
    threads
        Number of threads; None takes every processor. It does not change the result.

    Source
    ------
    Paper, section 4.5.
    """

    scenario: Scenario
    generations: int = 1000
    parents: int = 50
    offspring: int = 50
    threads: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        integer("generations", self.generations, 1)

    def infer(self, seed: Seed = 1, should_stop: Callable[[], bool] | None = None) -> Inferred | None:
        """Return the model of the last generation with the smallest error, and the typical model; None if it was stopped.

        `seed` is that of the evolution and of the trials; `should_stop` is asked before every generation.
        """
        numbers = tuple(seed) if isinstance(seed, Sequence) else (seed,)
        source, parameters = MixedSwarm(self.scenario, self.threads), len(self.scenario.parameter_names)
        optimizer = EvolutionStrategy(
            parameters, parents=self.parents, offspring=self.offspring, seed=(LEAST_SQUARES_MODELS, *numbers)
        )
        models, errors = np.empty((0, 0)), np.empty(0)
        medians = np.empty((self.generations, parameters))
        for generation in range(self.generations):
            if should_stop is not None and should_stop():
                return None
            models = optimizer.ask()
            samples = source.collect(models, generation_rng((LEAST_SQUARES_TRIALS, *numbers), generation))
            errors = squared_errors(samples, self.scenario.input_scale)
            optimizer.tell(-errors)
            medians[generation] = np.median(models, axis=0)
        late = medians[-max(1, round(LATE * self.generations)) :]
        return Inferred(models[int(np.argmin(errors))], np.median(late, axis=0))


def squared_errors(samples: Samples, scale: Sequence[float] | np.ndarray = (1.0,)) -> np.ndarray:
    """Compute the squared error of each model against the agents of its own trial.

    Parameters
    ----------
    samples
        Of a mixed swarm: genuine (n_a M, T, D), all models' first agents, then all second ones, and so on;
        counterfeit (M, C, T, D), averaged over C.
    scale : (D,) or (1,)
        What the signals are divided by, > 0.

    Returns
    -------
    (M,)
        Summed over agents, time steps and signals.

    Source
    ------
    Paper, section 4.5, its metric-based method.
    """
    genuine, counterfeit = samples.genuine, samples.counterfeit
    models, signals = len(counterfeit), genuine.shape[-1]
    rule = f"hold as many genuine samples for each of the {models} models"
    require(len(genuine) % models == 0, "samples", rule, f"{len(genuine)} in all")
    divisor = array("scale", scale, "D")
    fits = len(divisor) in (1, signals) and (divisor > 0).all()
    require(fits, "scale", f"be {signals} finite numbers above 0, or one", divisor.tolist())
    agents = genuine.reshape(-1, models, *genuine.shape[1:])
    return np.square((agents[:, :, None] - counterfeit) / divisor).sum(axis=(0, 3, 4)).mean(axis=1)


def least_squares_optimum(probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike) -> np.ndarray:
    """Return the model with the smallest expected squared error.

    With probabilities that do not change, every state gets the expected value of the agent's output; otherwise
    state i gets the mean of that expected value over time, weighted by the probability of the state.

    Parameters
    ----------
    probabilities : (T, n)
        Probability of each of n states in each of T time steps; each row sums to 1.
    values : (n,)
        The agent's output in each state.

    Returns
    -------
    (n,)
        The model's output in each state; for a state that never occurs the expected value over all time steps.

    Source
    ------
    Paper, section 4.5, theorem 1 and corollaries 2 and 3; the third for any number of states.
    """
    chances, outputs = _checked(probabilities, values)
    expected = chances @ outputs
    weights = chances.sum(axis=0)
    never = weights == 0
    optimum = (chances * expected[:, None]).sum(axis=0) / np.where(never, 1.0, weights)
    return np.where(never, expected.mean(), optimum)


def expected_squared_error(
    model: np.typing.ArrayLike, probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike
) -> float:
    """Compute the expected squared error of a model, case by case.

    Parameters
    ----------
    model : (n,)
        The model's output in each state.
    probabilities : (T, n)
        Probability of each state in each time step, of model and agent alike.
    values : (n,)
        The agent's output in each state.

    Returns
    -------
    float
        Summed over time steps and over the n times n cases of each.

    Source
    ------
    Paper, section 4.5, the expected error in the proof of theorem 1.
    """
    chances, outputs = _checked(probabilities, values)
    squares = np.square(np.asarray(model, dtype=np.float64)[:, None] - outputs)
    return float(np.einsum("ti,tj,ij->", chances, chances, squares))


def _checked(probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    chances = array("probabilities", probabilities, "T n")
    sums = chances.sum(axis=1)
    fits = (chances >= 0).all() and np.allclose(sums, 1)
    require(fits, "probabilities", "be 0 or more and sum to 1 in every time step", sums.tolist()[:3])
    return chances, array("values", values, "n", n=chances.shape[1])


@dataclass(frozen=True)
class Check:
    """How a statement fares in random cases."""

    statement: str  # in the paper's numbering
    cases: int
    difference: float  # largest distance of a minimum that was searched for from the one that is stated
    distance: float  # smallest distance of that minimum from the agent's outputs

    @property
    def holds(self) -> bool:
        """Whether the minimum is where it is stated to be, and not at the agent."""
        return self.difference < CLOSE < self.distance


def check_statements(cases: int, seed: int = 0) -> tuple[Check, ...]:
    """Check theorem 1 and its corollaries in random cases by searching for the minimum of the expected squared error.

    There are so many `cases` (>= 1) of each statement; `seed` draws them.
    """
    from scipy.optimize import minimize

    integer("cases", cases, 1)
    rng, checks = np.random.default_rng(seed), []
    for statement, states, steps in (
        ("theorem 1 and corollary 1: two states", 2, 1),
        ("corollary 2: three to six states", None, 1),
        ("corollary 3: two states, ten time steps", 2, 10),
    ):
        differences, distances = [], []
        for _ in range(cases):
            count = states or int(rng.integers(3, 7))
            chances = rng.dirichlet(np.full(count, 5.0), steps)
            outputs = rng.uniform(-1, 1, count)
            # from a random start, knowing nothing of the statements
            start = rng.uniform(-3, 3, count)
            found = minimize(expected_squared_error, start, (chances, outputs), tol=1e-12, method="Powell").x
            if steps == 1:  # E{Y}
                stated = np.full(count, chances[0] @ outputs)
            else:  # the paper's equation for x_1 and x_2
                sums = chances.sum(axis=0)
                own, other = np.square(chances).sum(axis=0) / sums, (chances * (1 - chances)).sum(axis=0) / sums
                stated = own * outputs + other * outputs[::-1]
            differences.append(np.abs(found - stated).max())
            distances.append(np.abs(found - outputs).max())
        checks.append(Check(statement, cases, float(max(differences)), float(min(distances))))
    return tuple(checks)
