"""The table of a study: one entry per run, statistics per parameter, medians per generation; read from the folders of the runs."""

import json
import logging
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning._files import digest_of
from turing_learning.analysis import absolute_error, name_failure
from turing_learning.config import to_toml
from turing_learning.report import Tabular, shown
from turing_learning.runs import FINISHED, RUNNING, TIMINGS, RunFolder
from turing_learning.store import RunFolderError, check_folder

from ._backends import COMPLETE, FAILED, STOPPED, WAITING
from ._plan import BEHAVIORS, CONTROLLER, FAILURE, SEED, Plan, StudyFolder

if TYPE_CHECKING:
    import pandas as pd

GOOD_ERROR = 0.05
"""MAE of the estimate below which a run is good."""
FAIR_ERROR = 0.1
"""MAE of the estimate below which a run is fair."""

TRACED_MODELS = ("best", "typical")
"""Models of each generation that a run records."""
MODELS = ("best_model", "estimate")
"""Models that a run infers."""
ERRORS = {"best_model": "absolute_error", "estimate": "estimate_absolute_error"}

Convergence = tuple[dict[str, Any], dict[str, np.ndarray]]
"""Settings of a configuration, and medians over its complete runs in each generation: "best_model" and
"typical_model" (G, P), of networks their steady outputs; their absolute errors "best_error" and
"typical_error"; the means of these, "best_mae" and so on."""

NO_TRUTH = "no truth"
_COUNTS = ("generations", "trials", "selection_stopped", "mae", "estimate_mae")
FAILURES_SHOWN = 10
"""Runs that failed and are listed one by one, at most."""
CONFIGURATIONS_SHOWN = 12
"""Configurations in a printed table, at most; the files have all."""

_LOGGER = logging.getLogger("turing_learning")

BEHAVIORS_PAPER = (0.01, 0.02, 0.07, 0.05)
"""Mean absolute errors of 1000 runs of random behaviors: paper, section 4.6.4."""


@dataclass(frozen=True)
class StudyRun:
    """One run of a study.

    Attributes
    ----------
    number
        From 1, in the order of the plan.
    settings
        In which it differs from other runs.
    state
        "complete", "stopped", "failed", or "waiting".
    reason
        Why it failed.
    result
        What `result.json` holds but the timings; None until the run is complete.
    seconds
        Time the run took (s), which makes no two runs different.
    """

    number: int
    settings: dict[str, Any]
    state: str
    reason: str = ""
    result: dict[str, Any] | None = None
    seconds: float | None = field(default=None, compare=False)

    @property
    def seed(self) -> int:
        """Seed of the run."""
        return self.settings[SEED]

    @property
    def complete(self) -> bool:
        """Whether all generations are completed."""
        return self.result is not None

    @property
    def estimate_mae(self) -> float | None:
        """MAE of the estimate; None until the run is complete, or where there is no truth."""
        if self.result is None:
            return None
        return self.result["estimate_mae"]

    @property
    def says(self) -> str:
        """What the run says of itself without the truth, such as "converged"; "-" until it is complete, and of old ones."""
        if self.result is None:
            return "-"
        return self.result.get("verdict", "-")

    @property
    def verdict(self) -> str:
        """How good the run is: "good", "fair", "poor (how it misses the truth)", or why there is no result."""
        if self.result is None:
            return self.state
        if self.estimate_mae is None:
            return NO_TRUTH
        if self.estimate_mae < FAIR_ERROR:
            return "good" if self.estimate_mae < GOOD_ERROR else "fair"
        estimate = np.array(list(self.result["estimate"].values()))
        truth = np.array(list(self.result["truth"].values()))
        return f"poor ({name_failure(estimate, truth)})"


@dataclass(frozen=True)
class ParameterSummary:
    """Statistics of one parameter over the complete runs of one configuration.

    Attributes
    ----------
    group
        The settings of the configuration; empty if the study has only one.
    parameter
        Its name.
    model
        "best_model" or "estimate".
    runs
        Number of complete runs.
    mean, median
        Of the absolute errors, in the parameter's unit; wheel speeds are fractions of the largest.
    standard_deviation
        Of the absolute errors, with n - 1; None for a single run.
    paper
        The paper's mean of the absolute error of the best model; None where it has none.
    """

    group: dict[str, Any]
    parameter: str
    model: str
    runs: int
    mean: float
    standard_deviation: float | None
    median: float
    paper: float | None


@dataclass(frozen=True, repr=False)
class StudyResult(Tabular):
    """What a study has found.

    Attributes
    ----------
    scenario
        Name of the scenario.
    title
        The same for a heading.
    runs
        All runs, in order.
    summaries
        Statistics of the absolute errors, configuration by configuration, parameter by parameter;
        in the parameters' units, wheel speeds as fractions of the largest.
    path
        The study folder.
    """

    scenario: str
    title: str
    runs: tuple[StudyRun, ...]
    summaries: tuple[ParameterSummary, ...]
    path: Path = field(compare=False)

    @property
    def complete(self) -> bool:
        """Whether all runs are complete."""
        return all(run.complete for run in self.runs)

    @property
    def failed(self) -> tuple[StudyRun, ...]:
        """The runs that failed, each with its reason."""
        return tuple(run for run in self.runs if run.state == FAILED)

    @property
    def unfinished(self) -> tuple[StudyRun, ...]:
        """The runs that have not been begun, or can go on."""
        return tuple(run for run in self.runs if run.state in (STOPPED, WAITING))

    @property
    def maes(self) -> tuple[float, ...]:
        """MAE of the estimate of the complete runs, in order; wheel speeds count as fractions of the largest."""
        return tuple(run.estimate_mae for run in self.runs if run.estimate_mae is not None)

    @property
    def groups(self) -> tuple[dict[str, Any], ...]:
        """The configurations that have complete runs."""
        groups = []
        for summary in self.summaries:
            if summary.group not in groups:
                groups.append(summary.group)
        return tuple(groups)

    @property
    def varying(self) -> list[str]:
        """Settings that are not the same in all runs, but for what chance decides."""
        return [key for key in self.runs[0].settings if key not in (SEED, CONTROLLER)]

    def below(self, limit: float) -> int:
        """Return the number of complete runs whose estimate has an MAE below a limit."""
        return sum(mae < limit for mae in self.maes)

    def kinds(self) -> dict[str, int]:
        """Return how good runs are -> number of runs, good ones first; without those that have no truth to be compared with."""
        counts: Counter[str] = Counter()
        for run in self.runs:
            verdict = run.verdict
            if run.state == FAILED:
                # What follows a colon differs from run to run.
                verdict = f"failed ({run.reason.partition(':')[0]})"
            counts[verdict] += 1
        del counts[NO_TRUTH]

        def order(entry: tuple[str, int]) -> tuple[Any, ...]:
            verdict, count = entry
            return (verdict != "good", verdict != "fair", -count, verdict)

        return dict(sorted(counts.items(), key=order))

    def verdicts(self) -> dict[str, int]:
        """Return what the complete runs say of themselves, such as "converged" -> number of runs, the most frequent first."""
        return dict(Counter(run.says for run in self.runs if run.complete).most_common())

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each run: its settings, state and verdict, models, errors and ends of intervals; as runs.csv."""
        import pandas as pd

        names = list(dict.fromkeys(row.parameter for row in self.summaries))
        return pd.DataFrame(run_rows(self, names)).set_index("run")

    def _shown(self) -> tuple[str, list[str], list[list[str]], list[str]]:
        groups = self.groups
        rows = []
        for group in groups[:CONFIGURATIONS_SHOWN]:
            values = list(map(str, group.values()))
            for name, numbers, paper in error_rows(self, group):
                rows.append([name, *values, *map(shown, numbers), shown(paper, "{:.2f}".format)])
        headings = ["parameter"]
        if groups:
            headings += [key.rpartition(".")[2] for key in groups[0]]
        headings += ["error", "std", "median", "best model", "std", "median", "paper"]
        remarks = []
        if rows:
            remarks.append(
                "Absolute errors of the estimate and of the best model, over the runs; paper: mean."
            )
        if len(groups) > CONFIGURATIONS_SHOWN:
            remarks.append(
                f"and {len(groups) - CONFIGURATIONS_SHOWN} more configurations in summary.csv"
            )
        remarks += _counted("verdicts of the runs", self.verdicts())
        remarks += _counted("against the truth", self.kinds())
        for run in self.failed[:FAILURES_SHOWN]:
            remarks.append(f"run {run.number}  seed {run.seed}  failed: {run.reason}")
        return f"{self.title}: {describe(self)}", headings, rows, remarks


def _counted(title: str, counts: Mapping[str, int]) -> list[str]:
    """Return a line that says how often each word is said; none without words."""
    if not counts:
        return []
    words = [f"{count} {word}" for word, count in counts.items()]
    return [f"{title}: {', '.join(words)}"]


def error_rows(
    result: StudyResult, group: dict[str, Any]
) -> list[tuple[str, list[float | None], float | None]]:
    """Return a row for each parameter of a configuration: its name, statistics of errors, and the paper's mean error.

    Statistics are mean, standard deviation and median of the errors of the estimate, then of the
    best model.
    """
    summaries: dict[str, dict[str, ParameterSummary]] = {}
    for row in result.summaries:
        if row.group == group:
            summaries.setdefault(row.parameter, {})[row.model] = row
    rows = []
    for name, summary_of in summaries.items():
        estimate = summary_of["estimate"]
        best = summary_of["best_model"]
        statistics = [estimate.mean, estimate.standard_deviation, estimate.median]
        statistics += [best.mean, best.standard_deviation, best.median]
        rows.append((name, statistics, best.paper))
    return rows


def describe(result: StudyResult) -> str:
    """Say in one sentence how many runs there are and how good they are."""
    done = sum(run.complete for run in result.runs)
    text = f"{done} of {len(result.runs)} runs complete"
    if result.failed:
        text += f", {len(result.failed)} failed"
    if result.maes:
        text += f"; MAE of the estimate below {GOOD_ERROR:g} in {result.below(GOOD_ERROR)}"
        text += f", below {FAIR_ERROR:g} in {result.below(FAIR_ERROR)}"
    return text


def read_run(folder: StudyFolder, plan: Plan, number: int) -> StudyRun:
    """Read how a run stands; one whose files are damaged, or that is another one, counts as stopped, and the log says so."""
    path = folder.run_path(number)
    settings = plan.settings[number - 1]
    run = RunFolder(path)
    failure = None
    with suppress(OSError, ValueError, RecursionError):
        failure = json.loads((path / FAILURE).read_text(encoding="utf-8"))
    try:
        # A run that has its result may still be drawing, or was killed while it did.
        if run.result_path.exists() and (manifest := run.manifest())["state"] != RUNNING:
            result = run.read(run.result_path.name)
            if result["complete"]:
                configuration = plan.configuration(number)
                digest = digest_of(to_toml(configuration).encode())
                if manifest.get("configuration_sha256") != digest:
                    # A newer version may write the same configuration in other words.
                    rule = "hold the run of its number"
                    same = run.configuration() == configuration
                    check_folder(same, "study", rule, f"{path}, another run", "Restore it.")
                # Without timings, the same runs give the same table whoever executed them.
                untimed = {name: value for name, value in result.items() if name not in TIMINGS}
                seconds = result["seconds_total"]
                return StudyRun(number, settings, COMPLETE, result=untimed, seconds=seconds)
        elif run.exists() and run.manifest()["state"] == FINISHED:
            raise run.damaged(run.result_path.name, "it is missing")
    except RunFolderError as error:
        _LOGGER.warning("Run %d of the study is left out until it is resumed: %s", number, error)
    if isinstance(failure, dict):
        return StudyRun(number, settings, FAILED, str(failure.get("reason", "")))
    return StudyRun(number, settings, STOPPED if path.exists() else WAITING)


def read_study(folder: StudyFolder, plan: Plan) -> StudyResult:
    """Read all runs of a study and summarize them."""
    runs = tuple(read_run(folder, plan, number) for number in plan.numbers)
    scenario = plan.base.scenario
    summaries = []
    for group, own_runs in members(plan, runs):
        for name, model in product(scenario.parameter_names, MODELS):
            errors = errors_of(own_runs, model, name)
            if errors.size:
                deviation = None
                if len(errors) > 1:
                    deviation = float(errors.std(ddof=1))
                summaries.append(
                    ParameterSummary(
                        group=group,
                        parameter=name,
                        model=model,
                        runs=len(own_runs),
                        mean=float(errors.mean()),
                        standard_deviation=deviation,
                        median=float(np.median(errors)),
                        paper=paper_of(plan, own_runs, name),
                    )
                )
    return StudyResult(scenario.name, scenario.title, runs, tuple(summaries), folder.path)


def members(plan: Plan, runs: Iterable[StudyRun]) -> list[tuple[dict[str, Any], list[StudyRun]]]:
    """Return the settings and the complete runs of each configuration."""
    groups: dict[str, tuple[dict[str, Any], list[StudyRun]]] = {}
    for run in runs:
        if run.complete:
            group = plan.group(run.number)
            _, own_runs = groups.setdefault(json.dumps(group, sort_keys=True), (group, []))
            own_runs.append(run)
    return list(groups.values())


def paper_of(plan: Plan, runs: Sequence[StudyRun], name: str) -> float | None:
    """Return the paper's error of a parameter, where it has one for the configuration of these runs."""
    if plan.behaviors:
        scenario = plan.configuration(runs[0].number).swarm
        drawn = {name: getattr(scenario, name) for name in ("controller", "title", "description")}
        if scenario != replace(BEHAVIORS, **drawn):
            return None
        return BEHAVIORS_PAPER[plan.base.scenario.parameter_names.index(name)]
    # Configurations that differ from the paper's have no errors of the paper's.
    printed = set()
    for run in runs:
        errors = (run.result or {}).get("paper_absolute_error") or {}
        printed.add(errors.get(name))
    return printed.pop() if len(printed) == 1 else None


def errors_of(runs: Iterable[StudyRun], model: str, name: str) -> np.ndarray:
    """Return the absolute errors of a parameter over the complete runs that have them."""
    errors = []
    for run in runs:
        if run.result is not None:
            errors.append((run.result[ERRORS[model]] or {}).get(name))
    return np.array([error for error in errors if error is not None], dtype=float)


def convergences(folder: StudyFolder, plan: Plan, runs: Iterable[StudyRun]) -> list[Convergence]:
    """Compute the medians of each configuration, from the runs that are complete and have a truth."""
    convergences = []
    for group, own_runs in members(plan, runs):
        described = plan.configuration(own_runs[0].number).described
        curves = []
        for run in own_runs:
            traces = RunFolder(folder.run_path(run.number)).traces()
            if traces is not None and run.result and run.result["truth"]:
                truth = np.array(list(run.result["truth"].values()))
                curves.append(_curves(traces, truth, described))
        if curves:
            # Runs that stop within their tolerance are shorter than others.
            shortest = min(len(run["best_mae"]) for run in curves)
            medians = {}
            for name in curves[0]:
                medians[name] = np.median([run[name][:shortest] for run in curves], axis=0)
            convergences.append((group, medians))
    return convergences


def _curves(
    traces: Mapping[str, np.ndarray],
    truth: np.ndarray,
    described: Callable[[np.ndarray], np.ndarray],
) -> dict[str, np.ndarray]:
    """Return what a `Convergence` has, of one run."""
    curves = {}
    for model in TRACED_MODELS:
        models = described(traces[f"{model}_model"])
        errors = absolute_error(models, truth)
        curves[f"{model}_model"] = models
        curves[f"{model}_error"] = errors
        curves[f"{model}_mae"] = errors.mean(axis=-1)
    return curves


def run_rows(result: StudyResult, names: Sequence[str]) -> list[dict[str, Any]]:
    """Return what runs.csv holds of each run; names are those of the parameters."""
    columns = ["truth"]
    for model in MODELS:
        columns += [model, ERRORS[model]]
    rows = []
    for run in result.runs:
        content = run.result or {}
        intervals = content.get("interval") or {}
        row: dict[str, Any] = {"run": run.number, "seed": run.seed}
        for key in result.varying:
            row[key] = run.settings[key]
        row |= {"state": run.state, "verdict": run.verdict, "reason": run.reason}
        for name in _COUNTS:
            row[name] = content.get(name)
        for column in columns:
            values = content.get(column) or {}
            for name in names:
                row[f"{column}_{name}"] = values.get(name)
        for side, bound in enumerate(("low", "high")):
            for name in names:
                interval = intervals.get(name) or (None, None)
                row[f"interval_{bound}_{name}"] = interval[side]
        rows.append(row)
    return rows


def write_tables(
    folder: StudyFolder, result: StudyResult, medians: Sequence[Convergence], names: Sequence[str]
) -> None:
    """Write runs.csv, summary.csv and convergence.csv; the same runs give the same bytes, whoever executed them."""
    import pandas as pd

    def write(
        name: str, rows: Iterable[dict[str, Any]], columns: Sequence[str] | None = None
    ) -> None:
        """Write rows as CSV, whose cells keep their types; lists and tables in them are JSON."""
        cells = []
        for row in rows:
            texts = dict(row)
            for key, cell in row.items():
                if isinstance(cell, list | dict):
                    texts[key] = json.dumps(cell)
            cells.append(texts)
        folder.write(name, pd.DataFrame(cells, columns=columns, dtype=object))

    keys = result.varying
    write("runs.csv", run_rows(result, names))
    summaries = []
    for summary in result.summaries:
        row = {key: summary.group.get(key) for key in keys} | vars(summary)
        # The paper prints errors of the best model.
        if summary.model != "best_model":
            row["paper"] = None
        summaries.append(row)
    statistics = [statistic.name for statistic in fields(ParameterSummary)][1:]
    write("summary.csv", summaries, [*keys, *statistics])
    columns = [f"{model}_model" for model in TRACED_MODELS]
    columns += [f"{model}_error" for model in TRACED_MODELS]
    maes = [f"{model}_mae" for model in TRACED_MODELS]
    # A row for each generation of each group
    generations = []
    for group, curves in medians:
        for g in range(len(curves["best_mae"])):
            row = {key: group.get(key) for key in keys} | {"generation": g}
            for column in columns:
                for p, name in enumerate(names):
                    row[f"{column}_{name}"] = curves[column][g, p]
            for mae in maes:
                row[mae] = curves[mae][g]
            generations.append(row)
    named = [f"{column}_{name}" for column, name in product(columns, names)]
    write("convergence.csv", generations, [*keys, "generation", *named, *maes])
