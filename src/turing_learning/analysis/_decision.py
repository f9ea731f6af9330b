"""How often a classifier decides rightly, after several judgments of each individual."""

import numpy as np


def decision_accuracy(agents: np.typing.ArrayLike, models: np.typing.ArrayLike) -> np.ndarray:
    """Compute the decision accuracy of classifiers.

    An individual counts as a model only if it is judged counterfeit in all of its trials. Agents and models have half of
    the weight each.

    Parameters
    ----------
    agents : (..., S, R) bool
        Whether each of S agents was judged genuine in each of R trials; classifiers come first.
    models : (..., M, R) bool
        Whether each of M models was judged genuine.

    Returns
    -------
    (...)
        In [0, 1].

    Raises
    ------
    ValueError
        If an array is not of that shape, or holds something else than 0 and 1.

    Source
    ------
    Paper, section 4.4.
    """
    taken_for_agents = _judged("agents", agents).any(axis=-1).mean(axis=-1)
    taken_for_models = (~_judged("models", models).any(axis=-1)).mean(axis=-1)
    return (taken_for_agents + taken_for_models) / 2


def _judged(name: str, judgments: np.typing.ArrayLike) -> np.ndarray:
    array = np.asarray(judgments)
    if array.ndim < 2 or 0 in array.shape[-2:]:
        raise ValueError(f"`{name}` must be of shape (..., individuals, trials), none of them 0; got {array.shape}.")
    if not np.isin(array, (0, 1)).all():
        raise ValueError(f"`{name}` must hold nothing but 0 and 1; got {array[~np.isin(array, (0, 1))].flat[0]}.")
    return array.astype(bool)
