"""Several runs of one configuration, told as one."""

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.analysis import (
    OF_CHECKS,
    UNKNOWN,
    Judgment,
    Verdict,
    absolute_error,
    is_known,
    mixed_interval,
    pooled_estimate,
    pooled_interval,
    r_hat,
    replace_unknown,
)
from turing_learning.config import PROSE, flat_settings
from turing_learning.errors import brief, check, in_words, require
from turing_learning.report import Judged, counted, shown
from turing_learning.report.tabular import describe_unknown, judged, parameter_rows, parameter_table
from turing_learning.store import RunFolderError, RunStorageError

from ._folder import RunFolder, how_to_resume
from ._record import units_of
from ._result import POOL, Posterior, Result, described_ridge, named, with_unit

if TYPE_CHECKING:
    import pandas as pd
    import xarray
    from rich.text import Text

AGREE, DISAGREE = 1.2, 1.5
"""R-hat up to which runs are said to agree, and above which to disagree; runs that agree reach the
second if they wander slowly."""

AGREE_BIRGE, DISAGREE_BIRGE = 1.5, 2.0
"""The same for the Birge ratio of runs of trials; two runs whose intervals hold exceed the second
in one case of twenty."""

_FREE = (
    "run.seed",
    "run.threads",
    "run.checkpoint_every",
    "run.history",
    "scenario.headings",
    "scenario.origin",
    *PROSE,
)
"""Settings in which pooled runs may differ.

But for the seed, none of them changes the result. Older runs know
nothing of headings and origins, and samples that are measured otherwise are others."""

_MEASURED = ("scenario.digest", "scenario.center", "scenario.input_scale")
"""Settings that follow from the samples: their last digits depend on the processor."""
_LAST_DIGITS = 1e-9
"""Largest share by which other settings differ that two processors compute from the same recordings."""

_LONGEST = 60  # characters of a value in a message


@dataclass(frozen=True, repr=False)
class Pooled(Judged):
    """What several runs of one configuration, with other seeds, have inferred together.

    Dicts are name -> number.

    Estimates, ends of intervals and errors are in the units of the parameters, as in `Result`.

    Attributes
    ----------
    scenario
        Name of the scenario.
    generations
        Of each run; of runs of trials, the most batches that one has.
    seeds
        Of the runs.
    estimate
        Median of the estimates of the runs; of parameters on a logarithmic scale, of their
        logarithms. Along a `ridge`, the estimate of the run on it that is nearest to that: medians
        are beside a ridge.
    interval
        Lower and upper end, for each parameter, of what the runs leave open together: nine of ten
        hold the truth, also where runs settle in different regions, see
        `turing_learning.analysis.pooled_interval`. Both are NaN where no run has moved and no two
        differ.
    agreement
        R-hat, about 1 where the runs agree, see `turing_learning.analysis.r_hat`; `runs_agree` has
        a word for it. NaN where no run has moved. Of runs of trials the Birge ratio: how far their
        estimates are apart, in units of the deviations of their draws; at most about 1 where they
        agree. NaN where fewer than two have settled.
    estimates
        Name -> the estimates of the runs, in the order of `seeds`.
    truth
        The agents' parameters; None where there is no truth.
    estimate_absolute_error, estimate_mae
        Of `estimate`, and its mean over the parameters; None where there is no truth.
    units
        Name -> unit; empty where a parameter has none.
    trials
        That runs of trials were to spend; None for runs of generations.
    chains
        For each run what its estimate is made of (W, P): the typical models of its last
        generations; of runs of trials draws of the matched estimate, of those alone that have
        settled.
    found
        What is said of each run, without whether it agrees with others, see `Result.verdicts`.
    checked
        How many runs have a check.
    ridge
        What shows of parameters along a ridge, as half of the settled runs or more say, see
        `Posterior`.
    """

    scenario: str
    generations: int
    seeds: tuple[int, ...]
    estimate: dict[str, float]
    interval: dict[str, list[float]]
    agreement: dict[str, float]
    estimates: dict[str, list[float]]
    truth: dict[str, float] | None
    estimate_absolute_error: dict[str, float] | None
    estimate_mae: float | None
    units: dict[str, str] = field(default_factory=dict)
    trials: int | None = None
    found: tuple[tuple[Verdict, ...], ...] = ()
    checked: int = 0
    ridge: tuple[str, ...] = ()
    chains: Mapping[int, np.ndarray] = field(default_factory=dict, compare=False)

    def to_xarray(self) -> "xarray.Dataset":
        """Return `chains` as ArviZ takes them (`arviz.summary`, `arviz.plot_pair`).

        A variable for each parameter, (chain, draw).

        Chains are runs, named by their seeds. The models of a run of generations wander with its
        populations: they say how far runs agree, and are no draws of a posterior.
        """
        import xarray

        remedy = "Resume them with more trials."
        if Verdict.PHASES in self.verdicts:
            remedy = Verdict.PHASES.meaning
        require(self.chains, "pool", "have a run that has settled", "none", remedy)
        values = np.stack(list(self.chains.values()))
        dims = ("chain", "draw")
        seeds = {"chain": list(self.chains)}
        variables = {}
        for k, (name, label) in enumerate(self.labels.items()):
            variables[name] = (dims, values[..., k], {"long_name": label})
        coordinates = seeds | {"draw": np.arange(values.shape[1])}
        return xarray.Dataset(variables, coords=coordinates, attrs={"scenario": self.scenario})

    @property
    def labels(self) -> dict[str, str]:
        """Name -> name and unit, for tables."""
        return with_unit({name: self.units.get(name, "") for name in self.estimate})

    @property
    def counts(self) -> dict[Verdict, int]:
        """What is said of how many runs; without "converged"."""
        counts = Counter(chain.from_iterable(self.found))
        del counts[Verdict.CONVERGED]
        # in the order in which verdicts are shown
        return {verdict: counts[verdict] for verdict in Verdict if counts[verdict]}

    @property
    def judgment(self) -> Judgment:
        """Whether to believe the runs.

        Whether they disagree, and what is said of half of them or more.

        What only a check says is said of half of those that were checked.
        """
        verdicts = []
        for verdict, count in self.counts.items():
            voters = self.checked if verdict in OF_CHECKS else len(self.found)
            if 2 * count >= voters:
                verdicts.append(verdict)
        if "disagree" in self.runs_agree.values():
            verdicts.append(Verdict.DISAGREE)
        return Judgment(tuple(verdicts), dissent=bool(self.counts))

    @property
    def runs_agree(self) -> dict[str, str]:
        """Whether runs settle in the same region.

        "agree" (R-hat up to 1.2), "disagree" (above 1.5), "unclear"; or "unknown".

        For the Birge ratio of runs of trials the bounds are 1.5 and 2.
        """
        most_agreeing = AGREE
        least_disagreeing = DISAGREE
        if self.trials is not None:
            most_agreeing = AGREE_BIRGE
            least_disagreeing = DISAGREE_BIRGE
        words = {}
        for name, value in self.agreement.items():
            if not is_known(value):
                words[name] = "unknown"
            elif value <= most_agreeing:
                words[name] = "agree"
            elif value > least_disagreeing:
                words[name] = "disagree"
            else:
                words[name] = "unclear"
        return words

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each parameter.

        Estimate, ends of its 90 % interval, R-hat or Birge ratio, and what else is known.
        """
        measure = "r_hat" if self.trials is None else "birge"
        return parameter_table(
            unit=self.units,
            estimate=self.estimate,
            interval=self.interval,
            truth=self.truth,
            absolute_error=self.estimate_absolute_error,
            **{measure: self.agreement},
            runs=self.runs_agree,
        )

    def _shown(self) -> "tuple[str, Sequence[str], Sequence[Sequence[str]], Sequence[str | Text]]":
        seeds = ", ".join(map(str, self.seeds))
        length = counted(self.generations, "generation")
        word = "R-hat"
        if self.trials is not None:
            length = counted(self.trials, "trial")
            word = "Birge"
        agreement_shown = {}
        agreement = {}
        for name, value in self.agreement.items():
            agreement_shown[name] = shown(value, "{:.2f}".format)
            agreement[name] = [value]
        headings, rows = parameter_rows(
            self.labels,
            {
                "estimate": self.estimate,
                "90 %": self.interval,
                "true": self.truth,
                "error": self.estimate_absolute_error,
                word: agreement_shown,
                "runs": self.runs_agree,
            },
        )
        remarks = []
        for name, agree in self.runs_agree.items():
            if agree == "disagree":
                estimates = ", ".join(map(shown, self.estimates[name]))
                remarks.append(f"runs disagree on {name}: {estimates}")
        if self.ridge:
            remarks.append(described_ridge(self.ridge, "the runs"))
        why = {}
        if self.trials is not None:
            why = {"why": "at most one run has settled; resume them with more trials"}
        if Verdict.PHASES in self.verdicts:
            why = {"why": "phases differ, which more trials do not change"}
        remarks += [
            describe_unknown(self.interval, **why),
            describe_unknown(agreement, "Whether runs agree", **why),
        ]
        head = f"{self.scenario}, {len(self.seeds)} runs, seeds {seeds}, {length}: {self.verdict}"
        runs = len(self.found)
        for verdict, count in self.counts.items():
            # what is said of all runs is said in the judgment
            if count < runs:
                remarks.append(f"{count} of {runs} runs: {verdict}")
        return head, headings, rows, [*filter(None, remarks), judged(self.judgment)]


def pool(runs: Sequence[Result]) -> Pooled:
    """Tell several runs of the same system and configuration as one.

    Their estimate, its interval, and whether they agree.

    The interval of one run speaks of the wandering of that run. Where runs settle in different
    regions it is far too narrow; that of the pool counts their scatter too.

    Of runs of trials the draws are mixed_interval (a linear opinion pool): where runs agree, the
    interval of the pool is that of one run, as the samples may be the same for all; where they do
    not, it spans them. Runs that have not settled are left out of estimate and interval, unless
    none has settled; then the interval is not known.

    Parameters
    ----------
    runs
        Two or more complete runs with other seeds, as `infer` returns them or `load_run` opens
        them. Where runs disagree, the interval of fewer than four is very wide.

    Returns
    -------
    Pooled
        What they have inferred together. In the folders of the runs, `pool.json` says whether they
        agree.

    Raises
    ------
    ConfigurationError
        If there are fewer than two, one is not complete, two have the same seed, or they are of
        different systems, samples or settings. Simulators, and live sources of samples, cannot be
        compared.

    Source
    ------
    docs/decisions/0026.

    Examples
    --------
    >>> import turing_learning as tl
    >>> runs = [tl.infer("aggregation", seed=seed) for seed in (1, 2, 3, 4)]  # doctest: +SKIP
    >>> print(tl.pool(runs))  # doctest: +SKIP
    """
    runs = _comparable(runs)
    configuration = runs[0].configuration
    names = configuration.scenario.parameter_names
    # Draws are mixed; generations are compared as chains of one search
    if isinstance(runs[0], Posterior):
        together = _mixed([run for run in runs if isinstance(run, Posterior)])
    else:
        together = _wandering(runs)
    truth = configuration.scenario.truth
    errors: dict[str, Any] = {"estimate_absolute_error": None, "estimate_mae": None}
    if truth is not None:
        error = absolute_error(together.estimate, np.asarray(truth, dtype=float))
        errors["estimate_absolute_error"] = named(names, error)
        errors["estimate_mae"] = float(error.mean())
    # the one object UNKNOWN instead of NaN, by which pools of the same runs are equal
    agreement = {}
    for name, value in named(names, together.agreement).items():
        agreement[name] = value if is_known(value) else UNKNOWN
    interval = dict(zip(names, together.interval.tolist(), strict=True))
    pooled = Pooled(
        scenario=configuration.scenario.name,
        generations=max(run.generations for run in runs),
        seeds=tuple(run.seed for run in runs),
        estimate=named(names, together.estimate),
        interval=replace_unknown(UNKNOWN, interval),
        agreement=agreement,
        estimates={name: [run.estimate[name] for run in runs] for name in names},
        truth=runs[0].truth,
        units=units_of(configuration.system, names),
        trials=configuration.run.trials or None,
        chains=together.chains,
        ridge=together.ridge,
        checked=sum(run.checked is not None for run in runs),
        found=tuple(_without_dissent(run.verdicts) for run in runs),
        **errors,
    )
    _note(pooled, runs)
    return pooled


@dataclass(frozen=True)
class _Together:
    """What several runs say of the parameters together."""

    chains: dict[int, np.ndarray]  # seed -> (W, P)
    estimate: np.ndarray  # (P,)
    interval: np.ndarray  # (P, 2)
    agreement: np.ndarray  # (P,)
    ridge: tuple[str, ...] = ()


def _mixed(runs: Sequence[Posterior]) -> _Together:
    """Mix the draws of runs of trials; those that have not settled count only if none has."""
    system = runs[0].configuration.system
    settled = [run for run in runs if run.settled]
    chains = {run.seed: run.draws() for run in settled}
    estimates = np.array([list(run.estimate.values()) for run in settled or runs])
    intervals = [list(run.interval.values()) for run in settled]
    bounds, agreement = mixed_interval(list(chains.values()), intervals, estimates.shape[1])
    # on the scale of each parameter, which takes models (runs, 1, P)
    estimate = system.on_scales(estimates[:, None], lambda values: np.median(values[:, 0], axis=0))
    ridge = _common_ridge(settled)
    if ridge:
        # medians of models along a ridge are beside it
        widths = np.maximum(np.diff(bounds)[:, 0], np.finfo(float).tiny)
        distances = (np.abs(estimates - estimate) / widths).max(axis=1).round(9)
        on_ridge = [k for k, run in enumerate(settled) if run.ridge == ridge]
        nearest = min(on_ridge, key=lambda k: (distances[k], settled[k].seed))
        estimate = estimates[nearest]
    return _Together(chains, estimate, bounds, agreement, ridge)


def _common_ridge(settled: Sequence[Posterior]) -> tuple[str, ...]:
    """Return what shows along a ridge, as half of the runs or more say; nothing if fewer do."""
    ridges = Counter(run.ridge for run in settled if run.ridge)
    if not ridges:
        return ()
    # of two that as many runs state, the first by its text
    ridge, votes = min(ridges.items(), key=lambda stated: (-stated[1], stated[0]))
    return ridge if 2 * votes >= len(settled) else ()


def _wandering(runs: Sequence[Result]) -> _Together:
    """Put together where the last typical models of runs of generations wander."""
    configuration = runs[0].configuration
    chains = {}
    for run in runs:
        models = run.history["typical_model"].to_numpy()
        window = configuration.run.estimated_from(len(models))
        chains[run.seed] = configuration.described(models[-window:])
    typical = np.stack(list(chains.values()))
    return _Together(
        chains=chains,
        estimate=configuration.system.on_scales(typical, pooled_estimate),
        interval=configuration.system.on_scales(typical, pooled_interval),
        agreement=r_hat(typical),
    )


def _without_dissent(verdicts: Sequence[Verdict]) -> tuple[Verdict, ...]:
    """Return verdicts on a run alone, without whether it agrees with others."""
    return tuple(verdict for verdict in verdicts if verdict is not Verdict.DISAGREE)


def _note(pooled: Pooled, runs: Sequence[Result]) -> None:
    """Let each run remember what the pool says of it, in its folder or in memory."""
    agreement = {name: [value] for name, value in pooled.agreement.items()}
    dissent = [verdict for verdict in pooled.verdicts if verdict is Verdict.DISAGREE]
    for run in runs:
        content = {
            "seeds": pooled.seeds,
            "agreement": replace_unknown(None, agreement),
            "verdicts": dissent,
            "estimate": run.estimate,
        }
        if run.path is not None:
            folder = RunFolder(run.path)
            # a pool of runs that others read, or that cannot be written, says the same
            with suppress(RunFolderError, RunStorageError, OSError), folder.locked():
                folder.write(POOL, content)
        elif run.record is not None:
            run.record.beside[POOL] = content


def _comparable(results: Any) -> list[Result]:
    """Return two or more results of complete runs of one configuration, whose seeds differ."""
    needed = partial(check, name="runs")
    runs = list(results)
    remedy = "Make more runs of the same configuration with other seeds."
    needed(len(runs) >= 2, rule="be at least 2", got=len(runs), remedy=remedy)
    for run in runs:
        ahead = "Let it run to its end."
        if run.path is not None and not run.complete:
            ahead = f"Resume it with {in_words(how_to_resume(run.path, run.configuration))}."
        got = f"seed {run.seed} stopped after {run.length}"
        needed(run.complete, rule="be complete", got=got, remedy=ahead, place=str(run.path or ""))
    reference = flat_settings(runs[0].configuration)
    for run in runs[1:]:
        settings = flat_settings(run.configuration)
        different = _differences(reference, settings)
        # others have other centers and scales, too
        key = min(different, key=lambda key: key != "scenario.digest", default="")
        got = f"{key} = {brief(reference.get(key), _LONGEST)} with seed {runs[0].seed} and "
        got += f"{brief(settings.get(key), _LONGEST)} with seed {run.seed}"
        rule = "be of the same system and configuration"
        remedy = "Pool runs that differ in their seed alone."
        needed(not different, rule=rule, got=got, remedy=remedy, place=str(run.path or ""))
    seeds: set[int] = set()
    for run in runs:
        rule = "have different seeds"
        got = f"seed {run.seed} twice"
        remedy = "The same seed gives the same run: make one with another."
        fresh = run.seed not in seeds
        needed(fresh, rule=rule, got=got, remedy=remedy, place=str(run.path or ""))
        seeds.add(run.seed)
    return runs


def _differences(reference: dict[str, Any], settings: dict[str, Any]) -> list[str]:
    """Return the settings in which two runs differ and must not, to be pooled."""
    origin = reference.get("scenario.origin")
    same_recordings = bool(origin) and origin == settings.get("scenario.origin")
    different = []
    for key in reference | settings:
        value = reference.get(key)
        other = settings.get(key)
        same = key in _FREE or value == other
        if same_recordings and not same:
            same = key in _MEASURED or _close(value, other)
        if not same:
            different.append(key)
    return different


def _close(value: Any, other: Any) -> bool:
    """Return whether two settings are numbers, or as many, that differ in their last digits alone."""
    first_number, second_number = np.asarray(value), np.asarray(other)
    if (
        first_number.dtype.kind != "f"
        or second_number.dtype.kind != "f"
        or first_number.shape != second_number.shape
    ):
        return False
    return np.allclose(first_number, second_number, rtol=_LAST_DIGITS, atol=0)
