"""What the squared error leads to if the inputs of models and agents are independent: theorem 1 and its corollaries."""

from dataclasses import dataclass

import numpy as np

CLOSE = 1e-6  # agreement of a minimum that was searched for with the one that the theorem states


def least_squares_optimum(probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike) -> np.ndarray:
    """Return the model with the smallest expected squared error.

    With probabilities that do not change, every state gets the expected value of the agent's output; otherwise state i gets
    the mean of that expected value over time, weighted by the probability of the state.

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

    Raises
    ------
    ValueError
        If the shapes do not fit, or the rows are no probabilities.

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

    Raises
    ------
    ValueError
        If the shapes do not fit, or the rows are no probabilities.

    Source
    ------
    Paper, section 4.5, the expected error in the proof of theorem 1.
    """
    chances, outputs = _checked(probabilities, values)
    squares = np.square(np.asarray(model, dtype=np.float64)[:, None] - outputs)
    return float(np.einsum("ti,tj,ij->", chances, chances, squares))


def _checked(probabilities: np.typing.ArrayLike, values: np.typing.ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    chances, outputs = np.asarray(probabilities, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if chances.ndim != 2 or chances.size == 0 or outputs.shape != chances.shape[1:]:
        raise ValueError(
            f"`probabilities` must be of shape (T, n) and `values` of shape (n,); got {chances.shape} and {outputs.shape}."
        )
    sums = chances.sum(axis=1)
    if not ((chances >= 0).all() and np.allclose(sums, 1)):
        raise ValueError(f"`probabilities` must be 0 or more and sum to 1 in every time step; got {sums.tolist()[:3]}.")
    return chances, outputs


@dataclass(frozen=True)
class Check:
    """How a statement fares in random cases.

    Attributes
    ----------
    statement
        Which, in the paper's numbering.
    cases
        Number of cases.
    difference
        Largest distance of a minimum that was searched for from the one that is stated.
    distance
        Smallest distance of that minimum from the agent's outputs.
    """

    statement: str
    cases: int
    difference: float
    distance: float

    @property
    def holds(self) -> bool:
        """Whether the minimum is where it is stated to be, and not at the agent."""
        return self.difference < CLOSE < self.distance


def check_statements(cases: int, seed: int = 0) -> tuple[Check, ...]:
    """Check theorem 1 and its corollaries in random cases by searching for the minimum of the expected squared error.

    Parameters
    ----------
    cases
        Number of cases of each statement, >= 1.
    seed
        Seed of the cases.

    Raises
    ------
    ValueError
        If there is no case.

    Source
    ------
    Paper, section 4.5.
    """
    if cases < 1:
        raise ValueError(f"`cases` must be at least 1; got {cases}.")
    rng = np.random.default_rng(seed)
    return (
        _check("theorem 1 and corollary 1: two states", cases, rng, states=2, steps=1),
        _check("corollary 2: three to six states", cases, rng, states=None, steps=1),
        _check("corollary 3: two states, ten time steps", cases, rng, states=2, steps=10),
    )


def _check(statement: str, cases: int, rng: np.random.Generator, *, states: int | None, steps: int) -> Check:
    differences, distances = [], []
    for _ in range(cases):
        count = states or int(rng.integers(3, 7))
        chances = rng.dirichlet(np.full(count, 5.0), steps)
        outputs = rng.uniform(-1, 1, count)
        found = _search(chances, outputs, rng)
        differences.append(np.abs(found - _stated(chances, outputs, steps)).max())
        distances.append(np.abs(found - outputs).max())
    return Check(statement, cases, float(max(differences)), float(min(distances)))


def _search(chances: np.ndarray, outputs: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Find the minimum from a random start, knowing nothing of the statements."""
    from scipy.optimize import minimize

    start = rng.uniform(-3, 3, len(outputs))
    return minimize(expected_squared_error, start, (chances, outputs), tol=1e-12, method="Powell").x


def _stated(chances: np.ndarray, outputs: np.ndarray, steps: int) -> np.ndarray:
    """Return the minimum as the paper states it: E{Y} where nothing changes, otherwise its equation for x_1 and x_2."""
    if steps == 1:
        return np.full(len(outputs), chances[0] @ outputs)
    sums = chances.sum(axis=0)
    own, other = np.square(chances).sum(axis=0) / sums, (chances * (1 - chances)).sum(axis=0) / sums
    return own * outputs + other * outputs[::-1]
