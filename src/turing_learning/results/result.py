"""What a run has inferred."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from turing_learning.analysis import (
    LEAST_P,
    UNKNOWN,
    Judgment,
    Verdict,
    absolute_error,
    estimate,
    interval,
    replace_unknown,
    settled,
    told,
)
from turing_learning.coevolution import Classifier
from turing_learning.config import Configuration, ConfigurationError
from turing_learning.errors import LARGEST_COUNT, integer
from turing_learning.errors import check as check_setting
from turing_learning.identifiability import Check, read_check
from turing_learning.report import Tabular, counted, is_page, shown
from turing_learning.report.tabular import describe_unknown, judged, parameter_rows, parameter_table
from turing_learning.store import RunFolderError
from turing_learning.systems import Given, Laboratory, System
from turing_learning.targets import refuse_target, writing

from ._paper import paper_absolute_errors
from ._plots import Plots, Shown
from .folder import CALIBRATION, RunFolder
from .history import SELECTION_CODES, Traces

if TYPE_CHECKING:
    import pandas as pd
    import xarray
    from rich.text import Text

_OF_TRUTH = ("truth", "absolute_error", "estimate_absolute_error", "mae", "estimate_mae", "paper_absolute_error")
_WHERE_THERE_ARE_SOME = ("failed_simulations", "networks", "covariance", "modes", "wandering")
LEAST_EXAMINED = 0.01  # p-value of new samples of the estimate below which they differ from the genuine ones
_LAST_BATCHES, _TELLING = 10, 0.75  # of classifiers, whose median fitness in runs of right models is at most 0.62
_COMPARABLE = 20  # fewest generations of networks whose halves can be compared

CHECK, POOL = "check/check.json", "pool.json"
"""Files of a run folder in which others than the run itself say whether to believe it."""

TIMINGS = ("seconds_total", "seconds_per_generation")
"""Entries of a result that differ between two runs of the same configuration and seed."""


Jury = tuple[tuple[Classifier, np.ndarray], ...]
"""Classifiers of a kind, and their genomes (J, Q)."""


class Owner(Shown, Protocol):
    """The run that a result belongs to, in its folder, or in memory, where it has none; `recover` runs another one for a check."""

    @property
    def folder(self) -> RunFolder | None:
        """The files of the run."""

    @property
    def beside(self) -> dict[str, Any]:
        """What a check and a pool say of a run in memory."""

    def require_there(self) -> None:
        """Reject a folder that is gone, or holds another run now."""

    def draws(self) -> np.ndarray | None:
        """Return models that the trials leave open, of a run of trials."""

    def jury(self) -> Jury:
        """Return the classifiers that judge at its end."""

    def report(self, result: "Result", target: Path) -> Path:
        """Write the page of the run."""

    def check(self, result: "Result", /, **options: Any) -> Check:
        """Check whether its estimate can be believed."""

    def recover(self, configuration: Configuration, path: Path | None, given: Given) -> "Result":
        """Run a configuration whose truth is the estimate."""


@dataclass(frozen=True)
class Mode:
    """One of the solutions of a run of trials.

    Attributes
    ----------
    weight
        Share of the draws that belong to it, 0 to 1.
    estimate
        Name -> median of these draws, in the parameter's unit.
    interval
        Name -> lower and upper end of their central 90 %.
    """

    weight: float
    estimate: dict[str, float]
    interval: dict[str, list[float]]


@dataclass(frozen=True, repr=False)
class Result(Tabular):
    """What a run has inferred; models and errors are dicts name -> number.

    All of them are in the parameters' units: wheel speeds as fractions of the largest, a field of view in
    rad, parameters of a custom system in the units in which their ranges were given.

    Models are stated in the agents' parameters, to be compared with theirs. Those of a network
    (`models.hidden`) are the outputs that it comes to in each sensor state; its weights are in `networks`.

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
        Median of the typical models of the last generations, see `turing_learning.analysis.estimate`. Of a run
        of trials, the median of its `draws` if it has settled, else what its classifiers make likeliest after
        the last batch.
    interval
        Lower and upper end, for each parameter, of what the estimate leaves open: nine of ten hold the truth,
        see `turing_learning.analysis.interval`. Both are NaN, in `result.json` null, where the run is still
        moving, where classifiers still tell its models, and where the models have never moved.
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
        Number of trials: executions of the simulator or the laboratory, whatever the number of replicas in
        one.
    covariance
        Name -> name -> covariance of two parameters, in their units, of an estimate from few trials: what
        matching leaves open (see `draws`). None, and not in `result.json`, for other runs, and where the run
        has not settled.
    path
        The run folder, absolute; None for a run that is kept in memory.
    failed_simulations
        Of a custom system: "count", and the first of them "listed" with generation, parameters and reason.
        None, and not in `result.json`, for simulated robots.
    networks
        Of black-box models: the weights of "best_model", and of "estimate": the typical network of the last
        generations whose steady outputs are nearest to the estimate. None, and not in `result.json`, for other
        models.
    found
        What the run itself says of whether to believe it; `judgment` also has what `check` and `pool` say.
    wandering
        What the typical models of the end wandered over, also where the run is still moving: it says nothing of
        the truth. None for runs of trials.
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
    origin: Owner | None = field(default=None, compare=False, repr=False)
    failed_simulations: dict[str, Any] | None = None
    networks: dict[str, dict[str, float]] | None = None
    covariance: dict[str, dict[str, float]] | None = None
    modes: tuple[Mode, ...] = ()
    found: tuple[Verdict, ...] = (Verdict.MOVING,)
    wandering: dict[str, list[float]] | None = None

    @property
    def length(self) -> str:
        """How long the run was: "1000 generations", or "300 trials" of a run with a budget of trials."""
        if self.wandering is not None:
            return counted(self.generations, "generation")
        return counted(self.trials, "trial")

    @property
    def judgment(self) -> Judgment:
        """Whether to believe the run: by itself, by its check, and by the last pool that it was in, and why."""
        check = self.checked
        return Judgment(self.said) if check is None else check.judgment

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """All that is to be said of whether to believe the run, in words."""
        return self.judgment.verdicts

    @property
    def verdict(self) -> Verdict:
        """Whether to believe the run, in a word: the first of `verdicts`."""
        return self.judgment.verdict

    @property
    def checked(self) -> Check | None:
        """The check of this estimate, if it is complete; None without."""
        with suppress(KeyError, TypeError, ValueError):
            return read_check(self._beside(CHECK), self.said)
        return None

    @property
    def said(self) -> tuple[Verdict, ...]:
        """What the run says of itself, and the last pool that it was in: all but its check."""
        with suppress(KeyError, TypeError, ValueError):
            return (*self.found, *map(Verdict, self._beside(POOL)["verdicts"]))
        return self.found

    def _beside(self, name: str) -> dict[str, Any]:
        """Return what a check or a pool has left, in the folder or in memory, if it was of this estimate; else nothing."""
        with suppress(RunFolderError, RuntimeError, AttributeError, KeyError, TypeError):
            content = self._owner().beside[name] if self.path is None else RunFolder(str(self.path)).read(name)
            if content.get("settings", content)["estimate"] == self.estimate:  # the run has not gone on since
                return dict(content)
        return {}

    @property
    def unknown(self) -> str:
        """Why the ends of which intervals are not known, in one sentence; empty if all are, or where the verdict says so."""
        return "" if {Verdict.MOVING, Verdict.TOLD} & {*self.found} else describe_unknown(self.interval)

    @property
    def system(self) -> System:
        """What was observed."""
        configuration = self.configuration
        return Laboratory.of(configuration.system) if self.in_laboratory else configuration.system

    @property
    def labels(self) -> dict[str, str]:
        """Name -> name and unit of each parameter, for tables; names alone where the run is not there any more."""
        with suppress(RuntimeError, ConfigurationError, RunFolderError):
            return with_unit(units_of(self.configuration.system, self.estimate))
        return {name: name for name in self.estimate}

    @property
    def in_laboratory(self) -> bool:
        """Whether robots in a laboratory were observed, real or emulated ones: the run folder says so."""
        return self.path is not None and RunFolder(self.path).laboratory_path.exists()

    @property
    def history(self) -> "xarray.Dataset":
        """Every generation's populations, step sizes and fitness values.

        Returns
        -------
        xarray.Dataset
            Along `generation`, from 0, and with `individual` for models, `classifier_individual` for
            classifiers:

            * `model` (generation, individual, parameter): parameters of the models, in units as in the result;
              for networks their weights.
            * `model_step_size` (generation, individual, parameter): in numbers of the search; for a custom
              system -1 to 1 is the range of the first models.
            * `model_fitness` (generation, individual): share of the judgments that took the model for genuine,
              0 to 1 (equation 1).
            * `classifier`, `classifier_step_size` (generation, classifier_individual, weight): weights of the
              networks.
            * `classifier_fitness` (generation, classifier_individual): mean of specificity and sensitivity, 0
              to 1 (equation 2).
            * `best_model`, `typical_model` (generation, parameter): as in `coevolution.Generation`.
            * `selection` (generation): 0 active, 1 all classifiers accept every model, 2 all reject every
              model.

            A run with a thin history has, in place of both populations, their steps and their fitness,
            `model_fitness_quantiles` and `classifier_fitness_quantiles` (generation, quantile): least,
            quartiles and largest. The generations of a run of trials are its batches, and `trials` (generation)
            is how many were spent by then.

            All have the attribute `long_name`, and `units` where they have one; `parameter` has the unit of
            each parameter.
        """
        return self._there().history()

    def draws(self, count: int | None = None, seed: int = 0) -> np.ndarray:
        """Return draws of the parameters from what an estimate from few trials leaves open: the joint uncertainty.

        Their central 90 %, and the estimate, are in the `interval` of a parameter that the judgments identify.
        Their covariance is `covariance`.

        Parameters
        ----------
        count
            How many, drawn from those that the run has, with replacement; None returns these as they are.
        seed
            Of the drawing, >= 0.

        Returns
        -------
        (count, P)
            In the parameters' units, in the order of `estimate`.

        Raises
        ------
        RuntimeError
            If the run has none: it is one of generations, or has not settled.
        """
        if self.covariance is None or (found := self._there().draws()) is None:
            remedy = "Give `trials`, or more of them."
            raise RuntimeError(f"`draws` must be of a run of trials that has settled; got none. {remedy}")
        if count is None:
            return found.copy()
        rng = np.random.default_rng(integer("seed", seed))
        return found[rng.integers(len(found), size=integer("count", count, 1, LARGEST_COUNT))]

    @property
    def configuration(self) -> Configuration:
        """What ran."""
        return self._owner().configuration

    def report(self, path: str | Path | None = None, *, force: bool = False) -> Path:
        """Write the report of the run, one HTML file.

        Parameters
        ----------
        path
            Where, a name that ends with .html; None takes report.html in the run folder. A page of an earlier
            report is replaced.
        force
            Whether any other file is replaced, too.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            If no path is given and the run is kept in memory, or no page may or can be written there.
        """
        rule, there = "be given for a run that is kept in memory", path is not None or self.path is not None
        check_setting(there, "path", rule, path, "Name an HTML file.")
        origin = self._there()
        if path is None:
            assert self.path is not None
            return origin.report(self, self.path / "report.html")
        target = Path(path)
        refuse_target(target, name="path", suffixes=(".html",), force=force, replaceable=is_page)
        with writing(target, "path"):
            return origin.report(self, target)

    @property
    def plot(self) -> Plots:
        """Pictures on matplotlib axes: `plot.parameters(ax=None)`, `plot.fitness`, `plot.motion`, `plot.distributions`."""
        laboratory = self.path if self.in_laboratory else None
        return Plots(self._there(), simulated_model(self), laboratory)

    def check(self, **options: Any) -> Check:
        """Check whether the estimate can be believed: see docs/identifiability.md.

        Fresh classifiers are trained to tell genuine samples from samples simulated at the estimate, and tested
        on held-out ones; the same is done where each parameter is moved across its range; a run is made whose
        truth is the estimate; and distributions of the motion are compared. Of a run in a folder all of it is
        kept there, and goes on where it was stopped.

        Parameters
        ----------
        **options
            `effort`, `recoveries`, `recovery_generations`, `seed`, `force`, `stage`; of a custom system also
            `genuine`, `simulate`, `recording`, `groups`, `workers` and `timeout_s`: see
            `turing_learning.results.check_run`.

        Raises
        ------
        RunFolderError
            If the folder holds this run no more, or a check with other settings.
        """
        return self._there().check(self, **options)

    def _there(self) -> Owner:
        """Return the run, if it is where it was."""
        origin = self._owner()
        origin.require_there()
        return origin

    def _owner(self) -> Owner:
        if self.origin is None:
            raise RuntimeError(
                "`history` must belong to a run; got a result alone, as one of a run in memory is that comes from another "
                "process. Give the run a folder, with `out`."
            )
        return self.origin

    @property
    def calibration(self) -> Mapping[str, np.ndarray] | None:
        """Samples (S, T, D) that the run has stored to calibrate detectors with, "genuine" and "abnormal"; None without."""
        folder = None if self.path is None else RunFolder(self.path)
        if folder is None or not folder.motion_path.exists():
            return None
        return dict(folder.read(CALIBRATION))

    @property
    def jury(self) -> Jury:
        """Who judges in a run of trials at its end, kind by kind: the best of the whole run, the fittest last; and random ones."""
        return self._owner().jury()

    def to_json(self) -> dict[str, Any]:
        """Return what `result.json` holds."""
        content = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in ("path", "origin")}
        content |= {name: replace_unknown(None, ends) for name in ("interval", "wandering") if (ends := content[name])}
        content |= {"verdict": self.found[0], "verdicts": list(content.pop("found"))}
        content["modes"] = [asdict(mode) for mode in self.modes] or None
        return {name: each for name, each in content.items() if each is not None or name not in _WHERE_THERE_ARE_SOME}

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each parameter: estimate, ends of its 90 % interval, best model; unit, truth and error if known."""
        return parameter_table(
            unit={} if self.origin is None else units_of(self.system, self.estimate),
            estimate=self.estimate,
            interval=self.interval,
            best_model=self.best_model,
            truth=self.truth,
            absolute_error=self.estimate_absolute_error,
        )

    def _shown(self) -> "tuple[str, Sequence[str], Sequence[Sequence[str]], Sequence[str | Text]]":
        state, paper = "" if self.complete else " (incomplete)", self.paper_absolute_error
        head = f"{self.scenario}, seed {self.seed}, {self.length}{state}"
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
        stopped = self.selection_stopped and f"selection stopped in {counted(self.selection_stopped, 'generation')}"
        networks = self.networks and "networks: their steady outputs; their weights are in the result"
        errors = zip(("mean absolute error", "of the best model"), (self.estimate_mae, self.mae), strict=True)
        means = ", ".join(f"{what} {shown(value)}" for what, value in errors if value is not None)
        remarks = [each for each in (means, networks, stopped, self.unknown) if each]
        judgment = self.judgment
        head += f", {self.seconds_total:.1f} s: {judgment.verdict}"
        return head, headings, rows, [*remarks, judged(judgment)]


def summarize(
    traces: Traces,
    seconds: float,
    *,
    origin: Owner,
    complete: bool,
    readout: Mapping[str, np.ndarray],
    failed_simulations: dict[str, Any] | None = None,
) -> Result:
    """Make the result of the completed generations, at least one, which took so many seconds; `readout` is that of its loop."""
    configuration, scenario = origin.configuration, origin.configuration.scenario
    names = scenario.parameter_names
    window, hidden = configuration.run.estimated_from(traces.completed), configuration.models.hidden
    best = configuration.described(traces["best_model"][-1])
    typical = configuration.described(traces["typical_model"][-window:])
    inferred, covariance, networks, wandering = estimate(typical, window), None, None, None
    trials = configuration.trials_after(traces.completed)
    if not configuration.run.trials and origin.folder is not None and origin.folder.laboratory_path.exists():
        trials //= configuration.swarm.replicas  # each executes a model of its own
    if configuration.run.trials:
        certain = told(traces["classifier_fitness_quantiles"][:, 2], _LAST_BATCHES, above=_TELLING)
        tells = certain or float(readout.get("p_value", 1.0)) < LEAST_P
        examined = float(readout["examined"][0]) if "examined" in readout else 1.0
        differs = not tells and examined < LEAST_EXAMINED
        readout = {} if tells or differs else readout
        inferred = readout.get("estimate", typical[-1])
        low, high = readout.get("interval", np.full((2, len(names)), np.nan))
        between = {name: [float(a), float(b)] for name, a, b in zip(names, low, high, strict=True)}
        said = []
        if "interval" not in readout:
            said = [Verdict.TOLD if tells else Verdict.DIFFERENT if differs else Verdict.MOVING]
        elif len(solutions := modes_of(names, readout)) > 1:
            said = [Verdict.SEVERAL]
            inferred = np.array(list(solutions[0].estimate.values()))
            ends = np.array([list(solution.interval.values()) for solution in solutions])
            between = {
                name: [min(low, float(ends[:, k, 0].min())), max(high, float(ends[:, k, 1].max()))]
                for k, (name, (low, high)) in enumerate(between.items())
            }
    else:
        pairs = configuration.system.on_scales(typical, partial(interval, window=window))
        wandering = replace_unknown(UNKNOWN, dict(zip(names, pairs.tolist(), strict=True)))
        said = _said(configuration, traces, window)
        between = dict.fromkeys(names, [UNKNOWN] * 2) if said else wandering
    if hidden:  # the best network, and that typical one whose outputs (W, P) are nearest to those inferred
        nearest = traces["typical_model"][-len(typical) :][np.argmin(np.abs(typical - inferred).sum(axis=1))]
        weights = {"best_model": traces["best_model"][-1], "estimate": nearest}
        networks = {name: named(configuration.parameter_names, values) for name, values in weights.items()}
    else:
        known = zip(configuration.system.parameters.values(), inferred.tolist(), strict=True)
        said += [Verdict.BOUND for parameter, value in known if parameter.bound_at(value)]
    if "draws" in readout:
        rows = zip(names, np.atleast_2d(np.cov(readout["draws"].T)), strict=True)
        covariance = {name: named(names, row) for name, row in rows}
    return Result(
        scenario=scenario.name,
        generations=traces.completed,
        seed=configuration.run.seed,
        trials=trials,
        complete=complete,
        best_model=named(names, best),
        estimate=named(names, inferred),
        interval=replace_unknown(UNKNOWN, between),
        covariance=covariance,
        modes=modes_of(names, readout),
        **_compared(configuration, best, inferred),
        selection_stopped=int(np.count_nonzero(traces["selection"] != SELECTION_CODES["active"])),
        seconds_total=seconds,
        seconds_per_generation=float(np.median(traces["seconds"])),
        path=None if origin.folder is None else origin.folder.path,
        origin=origin,
        failed_simulations=failed_simulations,
        networks=networks,
        found=Judgment(tuple(said)).verdicts,
        wandering=wandering,
    )


def modes_of(names: tuple[str, ...], readout: Mapping[str, np.ndarray]) -> tuple[Mode, ...]:
    """Return the solutions of a run of trials, that of most draws first; none where the run has not settled."""
    if "mode" not in readout:
        return ()
    draws, numbers = readout["draws"], readout["mode"]
    solutions = []
    for number in range(int(numbers.max()) + 1):
        own = draws[numbers == number]
        ends = np.quantile(own, (0.05, 0.95), axis=0).T
        weight = float(len(own) / len(draws))
        solutions.append(
            Mode(weight, named(names, np.median(own, axis=0)), dict(zip(names, ends.tolist(), strict=True)))
        )
    return tuple(solutions)


def _said(configuration: Configuration, traces: Traces, window: int) -> list[Verdict]:
    """Return what speaks against a run of generations by itself; that classifiers tell its models counts once they have settled."""
    alike = configuration.models.start == "middle"  # then the first models have no spread
    spreads = traces["model_spread"][int(alike) :]
    networks = bool(configuration.models.hidden)  # the spread of their weights says nothing
    known = not networks and bool(np.isfinite(spreads).all())
    few = networks and min(window, traces.completed) < _COMPARABLE
    if few or not settled(configuration.described(traces["typical_model"]), window, spreads if known else None).all():
        return [Verdict.MOVING]
    return [Verdict.TOLD] if told(traces["classifier_fitness_quantiles"][:, 2], window) else []


def _compared(configuration: Configuration, best: np.ndarray, inferred: np.ndarray) -> dict[str, Any]:
    """Return what a result says of the truth, where there is one."""
    scenario, simulated = configuration.scenario, configuration.system.simulated
    if scenario.truth is None:
        return dict.fromkeys(_OF_TRUTH)
    names, truth = scenario.parameter_names, np.asarray(scenario.truth, dtype=float)
    errors = {"": absolute_error(best, truth), "estimate_": absolute_error(inferred, truth)}
    papers = paper_absolute_errors(simulated) if simulated and not configuration.models.hidden else None
    return {
        "truth": named(names, truth),
        **{f"{of}absolute_error": named(names, values) for of, values in errors.items()},
        **{f"{of}mae": float(values.mean()) for of, values in errors.items()},
        "paper_absolute_error": papers,
    }


def named(names: tuple[str, ...], values: np.ndarray) -> dict[str, float]:
    """Return values (P,) by the names of the parameters."""
    return dict(zip(names, values.tolist(), strict=True))


def units_of(system: System, names: Iterable[str]) -> dict[str, str]:
    """Return the units of parameters by name, empty where they have none, as the weights of networks."""
    known = system.parameters
    return {name: known[name].unit if name in known else "" for name in names}


def with_unit(units: Mapping[str, str]) -> dict[str, str]:
    """Return name -> name and unit."""
    return {name: f"{name} ({unit})" if unit else name for name, unit in units.items()}


def simulated_model(result: Result) -> np.ndarray:
    """Return what is simulated (P,): the estimate, or the weights of the network that comes nearest to it."""
    return np.array(list((result.networks or {"estimate": result.estimate})["estimate"].values()))
