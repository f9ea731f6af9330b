"""Approximate Bayesian computation by sequential Monte Carlo, with the package `pyabc`."""

import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from ._groups import LARGEST, Groups, Inferred, baseline


class _BudgetSpentError(Exception):
    """As many groups have been simulated as were granted."""


def infer_by_abc_smc(
    groups: Groups,
    observed: np.ndarray,
    evaluations: int,
    seed: int,
    should_stop: Callable[[], bool] | None = None,
) -> Inferred | None:
    """Infer a behavior by ABC-SMC as `pyabc` does it by default, with an adaptive distance.

    The last complete population counts. Populations have a size that leaves room for about ten.

    Parameters
    ----------
    groups
        Simulates models.
    observed : (S,)
        Summaries of the agents' motion.
    evaluations
        Groups to be simulated, >= 100.
    seed
        Of everything.
    should_stop
        Asked before every group.

    Returns
    -------
    Inferred or None
        None if it was stopped.

    Raises
    ------
    ImportError
        If pyabc is not installed.
    ValueError
        If there are too few evaluations for two populations.
    """
    if evaluations < 100:
        raise ValueError(f"`evaluations` must be at least 100; got {evaluations}.")
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

    with _quiet(seed):
        prior = pyabc.Distribution(**{name: pyabc.RV("uniform", -LARGEST, 2 * LARGEST) for name in names})
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


@contextmanager
def _quiet(seed: int) -> "Iterator[None]":
    """Hold back what pyabc says, and seed the global random numbers that it uses; leave all as it was."""
    logger = logging.getLogger("ABC")
    level, state = logger.level, np.random.get_state()  # noqa: NPY002
    logger.setLevel(logging.ERROR)
    np.random.seed(seed)  # noqa: NPY002
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        np.random.set_state(state)  # noqa: NPY002
        logger.setLevel(level)
