"""Neural posterior estimation, with the package `sbi`."""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from ._groups import LARGEST, Groups, Inferred, baseline

DRAWS = 2000
"""From the posterior."""
OUTSIDE = 1e-3
"""Mass of the posterior that a later round does not search."""
AROUND = 10_000
"""Draws of the posterior that tell where this is."""
MARGIN = 0.2
"""Of the box around these draws, on each side, as a share of its length."""


def infer_by_npe(
    groups: Groups,
    observed: np.ndarray,
    evaluations: int,
    seed: int,
    should_stop: Callable[[], bool] | None = None,
    *,
    rounds: int = 1,
) -> Inferred | None:
    """Infer a behavior by neural posterior estimation as `sbi` does it by default: a flow on standardized summaries.

    With several rounds, each but the first draws its models from the part of the prior in which the posterior of the round
    before has its mass (truncated sequential estimation), and all rounds train the network.

    Parameters
    ----------
    groups
        Simulates models.
    observed : (S,)
        Summaries of the agents' motion.
    evaluations
        Groups to be simulated, at least 20 in a round.
    seed
        Of everything.
    should_stop
        Asked before every round.
    rounds
        Number of rounds, >= 1.

    Returns
    -------
    Inferred or None
        None if it was stopped.

    Raises
    ------
    ImportError
        If sbi is not installed.
    ValueError
        If there are no rounds, or too few evaluations for them.

    Source
    ------
    Greenberg, Nonnenmacher, Macke, Automatic posterior transformation for likelihood-free inference, 2019; Deistler,
    Goncalves, Macke, Truncated proposals for scalable and hassle-free simulation-based inference, 2022.
    """
    if rounds < 1 or evaluations < 20 * rounds:
        raise ValueError(
            f"`evaluations` must be at least 20 in each of 1 or more rounds; got {evaluations} in {rounds}."
        )
    torch, sbi = baseline("torch"), baseline("sbi.inference")
    rng = np.random.default_rng(seed)
    with _quiet(torch, seed):
        end = torch.full((len(groups.scenario.controller),), LARGEST)
        prior = baseline("sbi.utils").BoxUniform(-end, end)
        method = sbi.NPE(prior, show_progress_bars=False, tracker=_NoTracker())
        posterior: Any = None
        for part in np.array_split(np.arange(evaluations), rounds):
            if should_stop is not None and should_stop():
                return None
            models = (prior if posterior is None else _truncated(posterior)).sample((len(part),))
            found = groups.simulate(models.numpy().astype(np.float64), rng)
            method.append_simulations(models, _tensor(torch, found)).train(force_first_round_loss=True)
            posterior = method.build_posterior().set_default_x(_tensor(torch, observed))
        return Inferred.of_posterior(posterior.sample((DRAWS,), show_progress_bars=False).numpy())


def _tensor(torch: Any, array: np.ndarray) -> Any:
    return torch.as_tensor(array, dtype=torch.float32)


def _truncated(posterior: Any) -> Any:
    """Return the uniform prior where the posterior has its mass, to be drawn by rejection from a box around draws of the posterior.

    Of the whole prior, next to no draw may lie there, and all that are rejected would be kept in memory.
    """
    utils = baseline("sbi.utils")
    inside = utils.get_density_thresholder(posterior, quantile=OUTSIDE, num_samples_to_estimate_support=AROUND)
    draws = posterior.sample((AROUND,), show_progress_bars=False)
    least, most = draws.min(dim=0).values, draws.max(dim=0).values
    margin = MARGIN * (most - least)
    box = utils.BoxUniform((least - margin).clamp(min=-LARGEST), (most + margin).clamp(max=LARGEST))
    return utils.RestrictedPrior(box, inside, sample_with="rejection")


@contextmanager
def _quiet(torch: Any, seed: int) -> "Iterator[None]":
    """Hold back what sbi says, take one thread, and seed torch's global random numbers; leave all as it was."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with (
            torch.random.fork_rng(devices=[]),
            warnings.catch_warnings(),
            redirect_stdout(StringIO()),
            redirect_stderr(StringIO()),
        ):
            warnings.simplefilter("ignore")
            torch.manual_seed(seed)
            yield
    finally:
        torch.set_num_threads(threads)


class _NoTracker:
    """Takes the place of sbi's log files."""

    log_dir = None

    def log_metric(self, name: str, value: float, step: int | None = None) -> None:
        """Drop it."""

    def log_metrics(self, metrics: dict[str, float], step: int | None = None) -> None:
        """Drop them."""

    def log_params(self, params: dict[str, Any]) -> None:
        """Drop them."""

    def add_figure(self, name: str, figure: Any, step: int | None = None) -> None:
        """Drop it."""

    def flush(self) -> None:
        """Do nothing."""
