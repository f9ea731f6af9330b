"""What a run has inferred: by trials a `Posterior`, by generations an `Evolution`."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning import runs
from turing_learning.analysis import (
    UNKNOWN,
    WHY_UNKNOWN_OF_TRIALS,
    Judgment,
    Verdict,
    replace_unknown,
)
from turing_learning.config import Configuration, ConfigurationError
from turing_learning.errors import LARGEST_COUNT, integer
from turing_learning.families import Network
from turing_learning.identifiability import Check, read_check
from turing_learning.report import Judged, counted, shown
from turing_learning.report.tabular import (
    describe_unknown,
    judged,
    parameter_rows,
    parameter_table,
    parameter_texts,
)
from turing_learning.store import RunFolderError
from turing_learning.systems import Laboratory, System

from ._folder import CALIBRATION, RunFolder
from ._record import Jury, Record, units_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray
    from rich.text import Text

CHECK = "check/check.json"
"""File of a run folder in which a check says whether to believe the run."""

POOL = "pool.json"
"""File of a run folder in which the last pool that it was in says the same."""

TIMINGS = ("seconds_total", "seconds_per_generation")
"""Entries of a result that differ between two runs of the same configuration and seed."""

_NOT_STORED = ("path", "record")
_OMITTED_IF_EMPTY = (
    "failed_simulations",
    "networks",
    "covariance",
    "modes",
    "not_identified",
    "ridge",
    "wandering",
)


@dataclass(frozen=True)
class Mode:
    """One of the solutions of a run of trials.

    Attributes
    ----------
    weight
        Share of the draws that belong to it, 0 to 1.
    estimate
        Name -> median of these draws, in the parameter's unit; along a ridge as that of the run.
    interval
        Name -> lower and upper end of their central 90 %.
    """

    weight: float
    estimate: dict[str, float]
    interval: dict[str, list[float]]


@dataclass(frozen=True, repr=False)
class Result(Judged):
    """What a run has inferred; models and errors are dicts name -> number.

    All of them are in the parameters' units: wheel speeds as fractions of the largest, a field of
    view in rad, parameters of a custom system in the units in which their ranges were given.

    Models are stated in the agents' parameters, to be compared with theirs. Those of a network
    (`models.hidden`) are the outputs that it comes to in each sensor state; its weights are in
    `networks`.

    A run of trials has a `Posterior`, a run of generations an `Evolution`.

    Attributes
    ----------
    scenario
        Name of the scenario.
    generations
        Number of completed generations; of a run of trials, batches of them.
    seed
        Seed of the run.
    complete
        Whether all generations that were asked for are completed.
    truth
        The agents' parameters; None where there is no truth.
    best_model
        The model with the highest subjective fitness in the last generation: the paper's rule.
    estimate
        See `Posterior` and `Evolution`.
    interval
        Lower and upper end, for each parameter, of what the estimate leaves open: nine of ten hold
        the truth, see `turing_learning.analysis.interval`. Both are NaN, in `result.json` null,
        where the run is still moving or not yet examined, where phases differ, where classifiers still tell its models,
        and where the models have never moved. Of several solutions (`Posterior.modes`) it spans
        all, from the lowest end of them to the highest; between them most values are wrong.
    absolute_error, estimate_absolute_error
        Of `best_model` and of `estimate`; None where there is no truth.
    mae, estimate_mae
        Their means over the parameters; None where there is no truth.
    paper_absolute_error
        What the paper reports for `best_model`; None where it reports nothing.
    selection_stopped
        Number of generations in which all classifiers accepted, or rejected, every model.
    seconds_total
        Time the run took in all sessions (s), compilation included.
    seconds_per_generation
        Median over the generations (s).
    trials
        Number of trials: executions of the simulator or the laboratory, whatever the number of
        replicas in one.
    path
        The run folder, absolute; None for a run that is kept in memory.
    record
        Where what the run has stored is; None for a result alone, as one of a run in memory is that
        comes from another process.
    failed_simulations
        Of a custom system: "count", and the first of them "listed" with generation, parameters and
        reason. None, and not in `result.json`, for simulated robots.
    networks
        Of black-box models: the weights of "best_model", and of "estimate": the typical network of
        the last generations whose steady outputs are nearest to the estimate. None, and not in
        `result.json`, for other models.
    found
        What the run itself says of whether to believe it; `judgment` also has what `check` and
        `pool` say.
    """

    scenario: str
    generations: int
    seed: int
    complete: bool
    truth: dict[str, float] | None
    best_model: dict[str, float]
    estimate: dict[str, float]
    interval: dict[str, list[float]]
    absolute_error: dict[str, float] | None
    estimate_absolute_error: dict[str, float] | None
    mae: float | None
    estimate_mae: float | None
    paper_absolute_error: dict[str, float] | None
    selection_stopped: int
    seconds_total: float
    seconds_per_generation: float
    trials: int
    path: Path | None = field(default=None, compare=False)
    record: Record | None = field(default=None, compare=False, repr=False)
    failed_simulations: dict[str, Any] | None = None
    networks: dict[str, dict[str, float]] | None = None
    found: tuple[Verdict, ...] = (Verdict.MOVING,)

    @property
    @abstractmethod
    def length(self) -> str:
        """How long the run was, for tables: "1000 generations", "300 trials"."""

    @property
    @abstractmethod
    def progress(self) -> tuple[int, int]:
        """How far the run is: what is done, and what was asked for, in trials or generations."""

    @property
    def judgment(self) -> Judgment:
        """Whether to believe the run.

        By itself, by its check, and by the last pool that it was in, and why.
        """
        check = self.checked
        if check is None:
            return Judgment(self.said)
        return check.judgment

    @property
    def checked(self) -> Check | None:
        """The check of this estimate, if it is complete; None without."""
        with suppress(KeyError, TypeError, ValueError):
            return read_check(self._said_by(CHECK), self.said)
        return None

    @property
    def said(self) -> tuple[Verdict, ...]:
        """What the run says of itself, and the last pool that it was in: all but its check."""
        with suppress(KeyError, TypeError, ValueError):
            return (*self.found, *map(Verdict, self._said_by(POOL)["verdicts"]))
        return self.found

    def _said_by(self, name: str) -> dict[str, Any]:
        """Return what a check or a pool has left, by the name of its file, if it was of this estimate; else nothing."""
        with suppress(RunFolderError, RuntimeError, AttributeError, KeyError, TypeError):
            content = self._record().said_by(name)
            # else the run has gone on since
            if content.get("settings", content)["estimate"] == self.estimate:
                return content
        return {}

    @property
    def unknown(self) -> str:
        """Why the ends of which intervals are not known, in one sentence.

        Empty if all are, or where the verdict says so.
        """
        if {Verdict.PHASES, Verdict.UNEXAMINED, Verdict.MOVING, Verdict.TOLD} & {*self.found}:
            return ""
        if self.configuration.run.trials:
            return describe_unknown(self.interval, why=WHY_UNKNOWN_OF_TRIALS)
        return describe_unknown(self.interval)

    @property
    def system(self) -> System:
        """What was observed."""
        system = self.configuration.system
        if self.in_laboratory:
            return Laboratory.of(system)
        return system

    @property
    def labels(self) -> dict[str, str]:
        """Name -> name and unit of each parameter, for tables.

        Names alone where the run is not there any more.
        """
        with suppress(RuntimeError, ConfigurationError, RunFolderError):
            return with_unit(units_of(self.configuration.system, self.estimate))
        return {name: name for name in self.estimate}

    @property
    def in_laboratory(self) -> bool:
        """Whether robots in a laboratory were observed, real or emulated ones.

        The run folder says so.
        """
        return self.path is not None and RunFolder(self.path).laboratory_path.exists()

    @property
    def simulated_model(self) -> np.ndarray:
        """What is simulated (P,): the estimate, or the weights of the network that comes nearest to it."""
        model = self.estimate
        if self.networks is not None:
            model = self.networks["estimate"]
        return np.array(list(model.values()))

    @property
    def history(self) -> "xarray.Dataset":
        """Every generation's populations, step sizes and fitness values.

        Returns
        -------
        xarray.Dataset
            Along `generation`, from 0, and with `individual` for models, `classifier_individual`
            for classifiers:

            * `model` (generation, individual, parameter): parameters of the models, in units as in
              the result; for networks their weights.
            * `model_step_size` (generation, individual, parameter): in numbers of the search; for a
              custom system -1 to 1 is the range of the first models.
            * `model_fitness` (generation, individual): share of the judgments that took the model
              for genuine, 0 to 1 (equation 1).
            * `classifier`, `classifier_step_size` (generation, classifier_individual, weight):
              weights of the networks.
            * `classifier_fitness` (generation, classifier_individual): mean of specificity and
              sensitivity, 0 to 1 (equation 2).
            * `best_model`, `typical_model` (generation, parameter): as in `coevolution.Generation`.
            * `selection` (generation): 0 active, 1 all classifiers accept every model, 2 all reject
              every model.

            A run with a thin history has, in place of both populations, their steps and their
            fitness, `model_fitness_quantiles` and `classifier_fitness_quantiles` (generation,
            quantile): least, quartiles and largest. The generations of a run of trials are its
            batches, and `trials` (generation) is how many were spent by then.

            All have the attribute `long_name`, and `units` where they have one; `parameter` has the
            unit of each parameter.
        """
        return self.stored().history()

    @property
    def configuration(self) -> Configuration:
        """What ran."""
        return self._record().configuration

    def report(self, path: str | Path | None = None, *, force: bool = False) -> Path:
        """Write the report of the run, one HTML file: see `turing_learning.runs.report`."""
        return runs.report(self, path, force=force)

    @property
    def plot(self) -> "runs.Plots":
        """Pictures on matplotlib axes.

        `plot.parameters(ax=None)`, `plot.fitness`, `plot.motion`, `plot.distributions`.
        """
        return runs.Plots(self)

    def check(self, **options: Any) -> Check:
        """Check whether the estimate can be believed.

        See `turing_learning.runs.check`, which has the options.
        """
        runs.refuse_unknown_part(options)
        return runs.check(self, **options)

    def stored(self) -> Record:
        """Return the record of the run, if it is where it was.

        Reject a folder that is gone, or holds another run now.
        """
        record = self._record()
        record.require_there()
        return record

    def _record(self) -> Record:
        if self.record is None:
            raise RuntimeError(
                "`history` must belong to a run; got a result alone, as one of a run in memory is "
                "that comes from another process. Give the run a folder, with `out`."
            )
        return self.record

    @property
    def calibration(self) -> Mapping[str, np.ndarray] | None:
        """Samples (S, T, D) that the run has stored to calibrate detectors with, "genuine" and "abnormal"; None without."""
        folder = None if self.path is None else RunFolder(self.path)
        if folder is None or not folder.calibration_path.exists():
            return None
        return dict(folder.read(CALIBRATION))

    @property
    def network(self) -> Network | None:
        """The network that was learned for the run, as recorded; None where the models are others."""
        if self.record is not None and isinstance(self.record.arguments.simulate, Network):
            return self.record.arguments.simulate
        if self.path is None:
            return None
        return RunFolder(self.path).network()

    @property
    def jury(self) -> Jury:
        """Who judges in a run of trials at its end, see `Posterior.jury`.

        Nobody in a run of generations.
        """
        return ()

    def to_json(self) -> dict[str, Any]:
        """Return what `result.json` holds."""
        names = [item.name for item in fields(self) if item.name not in _NOT_STORED]
        content = {name: getattr(self, name) for name in names}
        content["interval"] = replace_unknown(None, self.interval)
        verdicts = content.pop("found")
        content["verdict"] = verdicts[0]
        content["verdicts"] = list(verdicts)
        for name in _OMITTED_IF_EMPTY:
            if not content.get(name):
                content.pop(name, None)
        return content

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each parameter: estimate, ends of its 90 % interval, best model.

        Unit, truth and error if known.
        """
        return parameter_table(**self._columns)

    def table(self) -> list[list[str]]:
        """Return the same as texts, the headings first."""
        return parameter_texts(**self._columns)

    @property
    def _columns(self) -> dict[str, Mapping[str, Any] | None]:
        return {
            "unit": {} if self.record is None else units_of(self.system, self.estimate),
            "estimate": self.estimate,
            "interval": self.interval,
            "best_model": self.best_model,
            "truth": self.truth,
            "absolute_error": self.estimate_absolute_error,
        }

    def _shown(self) -> "tuple[str, Sequence[str], Sequence[Sequence[str]], Sequence[str | Text]]":
        paper = self.paper_absolute_error
        headings, rows = parameter_rows(
            self.labels,
            {
                "estimate": self.estimate,
                "90 %": self.interval,
                "true": self.truth,
                "error": self.estimate_absolute_error,
                "best model": self.best_model,
                "its error": self.absolute_error,
                "paper": paper and {name: f"{value:g}" for name, value in paper.items()},
            },
        )
        remarks = []
        errors = {"mean absolute error": self.estimate_mae, "of the best model": self.mae}
        means = [f"{name} {shown(value)}" for name, value in errors.items() if value is not None]
        if means:
            remarks.append(", ".join(means))
        if self.networks:
            remarks.append("networks: their steady outputs; their weights are in the result")
        if self.selection_stopped:
            stopped = counted(self.selection_stopped, "generation")
            remarks.append(f"selection stopped in {stopped}")
        if self.unknown:
            remarks.append(self.unknown)
        judgment = self.judgment
        state = "" if self.complete else " (incomplete)"
        head = f"{self.scenario}, seed {self.seed}, {self.length}{state}"
        head += f", {self.seconds_total:.1f} s: {judgment.verdict}"
        return head, headings, rows, [*remarks, judged(judgment)]


@dataclass(frozen=True, repr=False)
class Posterior(Result):
    """What a run of trials has inferred: a distribution of the parameters, given the agents.

    `estimate` is the median of its draws if the run has settled, along a ridge the model on it that
    is nearest to that; else what its classifiers make likeliest after the last batch. Other
    attributes are those of `Result`.

    Attributes
    ----------
    covariance
        Name -> name -> covariance of two parameters, in their units: what matching leaves open, see
        `draws`. None, and not in `result.json`, where the run has not settled or phases differ.
    modes
        Its solutions, that of most draws first, each with an interval of its own; none where the
        run has not settled. `estimate` is that of the first.
    not_identified
        Names of parameters of which the run says too little. `interval`, and those of the modes,
        are all of the range that was searched, which may be wider than that of the first models.
        The draws of such a parameter may cover less, but that is not known. Not in `result.json`
        if there are none.
    ridge
        What shows of parameters that lie along a ridge, such as "mobility x heat": models in range
        that have the same are as good, and intervals span them. Not in `result.json` if there is
        none.
    """

    covariance: dict[str, dict[str, float]] | None = None
    modes: tuple[Mode, ...] = ()
    not_identified: tuple[str, ...] = ()
    ridge: tuple[str, ...] = ()

    @property
    def length(self) -> str:
        """How long the run was, for tables: "300 trials"."""
        return counted(self.trials, "trial")

    @property
    def progress(self) -> tuple[int, int]:
        """Trials that are spent, and the budget."""
        return self.trials, self.configuration.run.trials

    @property
    def unknown(self) -> str:
        """Also which parameters are not identified, and what shows along a ridge."""
        sentences = []
        if self.not_identified:
            listed = ", ".join(self.not_identified)
            sentences.append(f"Not identified, so the interval is the whole range: {listed}.")
        if self.ridge:
            sentences.append(described_ridge(self.ridge))
        return " ".join(sentences) or super().unknown

    @property
    def settled(self) -> bool:
        """Whether the run has `draws`."""
        return self.covariance is not None

    def draws(self, count: int | None = None, seed: int = 0) -> np.ndarray:
        """Return draws of the parameters from what the estimate leaves open: the joint uncertainty.

        Their central 90 %, and the estimate, are in the `interval` of a parameter that the
        judgments identify. Their covariance is `covariance`.

        Parameters
        ----------
        count
            How many, drawn from those that the run has, with replacement; None returns these as
            they are.
        seed
            Of the drawing, >= 0.

        Returns
        -------
        (count, P)
            In the parameters' units, in the order of `estimate`.

        Raises
        ------
        RuntimeError
            If the run has none, as it has not settled, or as phases differ.
        """
        draws = self.stored().draws() if self.settled else None
        if draws is None:
            got = "none. Give more `trials`."
            if Verdict.PHASES in self.found:
                got = f"one whose phases differ. {Verdict.PHASES.meaning}"
            raise RuntimeError(f"`draws` must be of a run that has settled; got {got}")
        if count is None:
            return draws.copy()
        rng = np.random.default_rng(integer("seed", seed))
        return draws[rng.integers(len(draws), size=integer("count", count, 1, LARGEST_COUNT))]

    @property
    def jury(self) -> Jury:
        """Who judges at its end, kind by kind: the best of the whole run, the fittest last.

        And random ones.
        """
        return self._record().jury()

    def to_json(self) -> dict[str, Any]:
        """Return what `result.json` holds."""
        content = super().to_json()
        if self.modes:
            content["modes"] = list(map(asdict, self.modes))
        return content


@dataclass(frozen=True, repr=False)
class Evolution(Result):
    """What a run of generations has inferred: where its population of models has come to.

    `estimate` is the median of the typical models of the last generations, see
    `turing_learning.analysis.estimate`. Other attributes are those of `Result`.

    Attributes
    ----------
    wandering
        What the typical models of the end wandered over, also where the run is still moving: it
        says nothing of the truth.
    """

    wandering: dict[str, list[float]] = field(default_factory=dict)

    @property
    def length(self) -> str:
        """How long the run was, for tables: "1000 generations"."""
        return counted(self.generations, "generation")

    @property
    def progress(self) -> tuple[int, int]:
        """Generations that are completed, and that were asked for."""
        return self.generations, self.configuration.length

    def to_json(self) -> dict[str, Any]:
        """Return what `result.json` holds."""
        content = super().to_json()
        if self.wandering:
            content["wandering"] = replace_unknown(None, self.wandering)
        return content


def result_from_json(content: Mapping[str, Any], record: Record) -> Result:
    """Return the result that `result.json` holds, of the run of a record.

    A ValueError, KeyError or TypeError if it is none.
    """
    values = {name: value for name, value in content.items() if name not in ("verdict", "verdicts")}
    values["interval"] = replace_unknown(UNKNOWN, content["interval"])
    values["found"] = Judgment(content["verdicts"]).verdicts
    values["path"] = record.path
    values["record"] = record
    if record.configuration.run.trials:
        values["modes"] = tuple(Mode(**mode) for mode in content.get("modes", ()))
        values["not_identified"] = tuple(content.get("not_identified", ()))
        values["ridge"] = tuple(content.get("ridge", ()))
        return Posterior(**values)
    values["wandering"] = replace_unknown(UNKNOWN, content["wandering"])
    return Evolution(**values)


def described_ridge(ridge: Sequence[str], tellers: str = "the run") -> str:
    """Return a sentence that says what shows along a ridge, as far as one or more runs tell."""
    verb, kept = ("shows", "it") if len(ridge) == 1 else ("show", "these")
    return (
        f"As far as {tellers} can tell, some parameters lie along a ridge, of which only {' and '.join(ridge)} {verb}: "
        f"other values that keep {kept} are as good."
    )


def named(names: Sequence[str], values: np.ndarray) -> dict[str, float]:
    """Return values (P,) by the names of the parameters."""
    return dict(zip(names, values.tolist(), strict=True))


def with_unit(units: Mapping[str, str]) -> dict[str, str]:
    """Return name -> name and unit."""
    return {name: f"{name} ({unit})" if unit else name for name, unit in units.items()}
