"""What is printed at the end: inferred, true, absolute error, the paper's figure."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from turing_learning.report import counted, short_number, shown

if TYPE_CHECKING:
    from turing_learning.analysis import Verdict
    from turing_learning.detection import Detection, Detector, Motion, Ranking, SampleVerdict, TimedVerdict
    from turing_learning.identifiability import Check
    from turing_learning.interaction import StimulatedSystem
    from turing_learning.runs import ModelEvaluation, Result
    from turing_learning.swarm import Scenario


_ALL = ("estimate", "90 %", "true", "error:estimate", "best model", "error:best", "paper")
_WITHOUT_PAPER = _ALL[:-1]
_HALVES = (("estimate", "90 %", "true", "error:estimate"), ("best model", "error:best", "paper"))
_PARTS = (("estimate", "90 %"), ("true", "error:estimate"), ("best model", "error:best", "paper"))
_WITHOUT_TRUTH = ("estimate", "90 %", "best model")
MOST_SPELLS = 3  # in a cell
WIDEST = 1000  # characters, to ask how wide a table would be

CAPTIONS = {
    "90 %": "90 %: the interval of the estimate",
    "error:estimate": "error: absolute",
    "paper": "paper: the error that it reports for the best model",
}


def print_result(console: Console, result: "Result", path: Path) -> None:
    """Print the table of a run, how long it took, and where its files are, by the path of its folder as it was given."""
    for table in _fitting_tables(console, result):
        console.print(table)
    if unknown := result.unknown:
        console.print(unknown)
    print_judgment(console, result.verdicts)
    if result.networks is not None:
        console.print("networks: their steady outputs; their weights are in the result")
    console.print(
        f"{counted(result.generations, 'generation')} in {result.seconds_total:.1f} s, "
        f"{1000 * result.seconds_per_generation:.1f} ms each (median)",
    )
    if result.selection_stopped:
        console.print(
            f"selection stopped in {counted(result.selection_stopped, 'generation')}", style="bold red", highlight=False
        )
    _print_places(console, path)


def print_judgment(console: Console, verdicts: "tuple[Verdict, ...]") -> None:
    """Print whether to believe a result."""
    from turing_learning.analysis import judgment

    style = (
        "bold green"
        if verdicts == ("converged",)
        else "bold yellow"
        if "model rejected" not in verdicts
        else "bold red"
    )
    console.print(judgment(verdicts), style=style)


def print_post_evaluation(console: Console, found: "ModelEvaluation") -> None:
    """Print the best of the last models of a run in a laboratory, or how many times they have been observed again."""
    if found.best_model is None:
        text = f"the last models have been observed again {len(found.fitness)} of {counted(found.repeats, 'time')}"
    else:
        text = (
            f"the last models, observed again {counted(found.repeats, 'time')}; the best: {_numbers(found.best_model)}"
        )
    if found.absolute_error is not None:
        text += f"; absolute errors: {_numbers(found.absolute_error)}"
    console.print(text, soft_wrap=True)


def _numbers(values: dict[str, float]) -> str:
    return " ".join(f"{name} {short_number(value)}" for name, value in values.items())


def _print_places(console: Console, path: Path) -> None:
    from turing_learning.runs import RunFolder

    report = RunFolder(path).report_path
    if report.exists():
        console.print(f"report: {report}", soft_wrap=True)
    console.print(f"run:    {path}", soft_wrap=True)


def _fitting_tables(console: Console, result: "Result") -> list[Table]:
    """Return one table, or on a narrow terminal, which would cut off its numbers, one without the paper's figure, or several."""
    if result.truth is None:
        return [result_table(result, _WITHOUT_TRUTH)]
    for layout in ((_ALL,), (_WITHOUT_PAPER,), _HALVES):
        tables = [result_table(result, _known(result, columns)) for columns in layout]
        if all(_width(console, table) <= console.width for table in tables):
            return tables
    return [result_table(result, _known(result, columns)) for columns in _PARTS]


def _known(result: "Result", columns: tuple[str, ...]) -> tuple[str, ...]:
    """Leave the paper's figure out where the paper has none."""
    return columns if result.paper_absolute_error else tuple(column for column in columns if column != "paper")


def _width(console: Console, table: Table) -> int:
    return Measurement.get(console, console.options.update(width=WIDEST), table).maximum


def result_table(result: "Result", columns: tuple[str, ...] = _ALL) -> Table:
    """Return the table inferred / true / absolute error / the paper's figure, or some of its columns."""
    state = "" if result.complete else ", not complete"
    table = Table(
        title=f"{result.scenario}, seed {result.seed}{state}",
        title_justify="left",
        caption="; ".join(CAPTIONS[column] for column in columns if column in CAPTIONS),
    )
    table.caption_justify = "left"
    table.add_column("parameter" if columns[0] == "estimate" and "best model" in columns else "")
    for column in columns:
        table.add_column(column.partition(":")[0], justify="right")
    labels = result.labels
    for name, value in result.estimate.items():
        entries = (
            short_number(value),
            _ends(*result.interval[name]),
            _entry(result.truth, name),
            _entry(result.estimate_absolute_error, name),
            short_number(result.best_model[name]),
            _entry(result.absolute_error, name),
            _entry(result.paper_absolute_error, name, "{:.2f}".format),
        )
        table.add_row(Text(labels[name]), *_chosen(entries, columns))
    if "error:estimate" in columns or "error:best" in columns:
        table.add_section()
        means = ("", "", "", shown(result.estimate_mae), "", shown(result.mae), "")
        table.add_row("mean", *_chosen(means, columns))
    return table


def _ends(low: float, high: float) -> str:
    return shown(low, lambda value: f"{short_number(value)} to {short_number(high)}")


def _chosen(entries: tuple[str, ...], columns: tuple[str, ...]) -> list[str]:
    return [entries[_ALL.index(column)] for column in columns]


def _entry(values: dict[str, float] | None, name: str, form: Callable[[float], str] = short_number) -> str:
    return shown(None if values is None else values[name], form)


def plain_console(*, stderr: bool = False) -> Console:
    """Return where text is printed as it is: names of files and individuals may hold brackets."""
    return Console(stderr=stderr, markup=False, highlight=False)


def print_scenarios(console: Console, scenarios: dict[str, "Scenario"]) -> None:
    """Print every scenario's name, what it is, and its agents' parameters."""
    for name, scenario in scenarios.items():
        console.print(Text(name, style="bold") + f"  {scenario.description}", soft_wrap=True)
        values, count = ", ".join(_agents(scenario)), scenario.objects.count
        bodies = f"{scenario.agents} agents, {scenario.replicas} replica{f', {count} objects' if count else ''}"
        console.print(f"    {bodies}; {values}", soft_wrap=True)


def print_stimulated(console: Console, systems: Mapping[str, "StimulatedSystem"]) -> None:
    """Print the name of every system with stimuli, what it is, its stimuli, and its parameters."""
    for name, system in systems.items():
        console.print(Text(name, style="bold") + f"  {system.title}", soft_wrap=True)
        console.print(
            f"    stimuli {', '.join(system.stimulus.names)}; {system.shown(np.array(system.true))}", soft_wrap=True
        )


def _agents(scenario: "Scenario") -> list[str]:
    """Say what the agents are: their wheel speeds, and their field of view unless it is a line of sight as everywhere."""
    from turing_learning.models import ReactiveModel

    names, view = ReactiveModel(scenario.sensor.states).parameter_names, scenario.sensor.field_of_view
    speeds = [f"{name} = {speed:g}" for name, speed in zip(names, scenario.controller, strict=True)]
    unusual = view > 0 or scenario.representation == "morphology"
    return [*speeds, f"field of view {view:.4g} rad"] if unusual else speeds


def check_table(found: "Check") -> Table:
    """Return the table parameter / interval / left open / missed by / verdict, in shares of the initial range."""
    table = _headed("parameter", ("interval", "left open", "missed by"), ("",), caption="shares of the initial range")
    for each in found.parameters:
        table.add_row(
            each.parameter,
            shown(each.interval_share, "{:.1%}".format),
            shown(each.open_share, "at most {:.0%}".format),
            shown(each.recovery_error, "{:.1%}".format),
            each.verdict if each.pinned_down else Text(each.verdict, style="bold red"),
        )
    return table


def print_verdicts(
    console: Console, detector: "Detector", motion: "Motion", verdicts: "Sequence[SampleVerdict]"
) -> None:
    """Print which individuals are abnormal, by samples."""
    table = _headed("individual", ("judged genuine", "score", "p-value"), ("verdict",))
    table.add_column("since sample", justify="right")
    for verdict in verdicts:
        table.add_row(
            Text(verdict.individual),
            f"{100 * verdict.genuine_share:.0f} %",
            f"{verdict.score:.3f}",
            f"{verdict.p_value:.2g}",
            _abnormal(verdict.abnormal),
            "-" if verdict.since is None else str(verdict.since),
        )
    console.print(table)
    limit = f"p-value up to {detector.false_alarms:g}"
    if detector.rule == "unanimous":
        limit = "all samples judged counterfeit"
    samples = f"{counted(motion.samples.shape[1], 'sample')} each of {detector.steps} steps"
    classifiers = counted(len(detector.genomes), "classifier")
    found = sum(verdict.abnormal for verdict in verdicts)
    text = f"{found} of {len(verdicts)} abnormal, by {samples}; rule {detector.rule}, {classifiers}, {limit}"
    console.print(text)


def print_timeline(console: Console, detector: "Detector", verdicts: "Sequence[TimedVerdict]") -> None:
    """Print which individuals of a recording are abnormal, and when."""
    table = _headed("individual", ("windows", "score", "evidence", "threshold"), ("verdict", "when (s)"))
    for verdict in verdicts:
        numbers = (f"{verdict.score:.3f}", f"{verdict.strength:.2f}", f"{verdict.threshold:.2f}")
        spells = [f"{begin:.1f} to {end:.1f}" for begin, end in verdict.spells[:MOST_SPELLS]]
        more = len(verdict.spells) - MOST_SPELLS
        table.add_row(
            Text(verdict.individual),
            str(verdict.windows),
            *(numbers if verdict.windows else "---"),
            _abnormal(verdict.abnormal) if verdict.windows else "no window",
            ", ".join(spells + ([f"{more} more"] if more > 0 else [])) or "-",
        )
    console.print(table)
    found = sum(verdict.abnormal for verdict in verdicts)
    by = f"by windows of {detector.steps} steps; rule {detector.rule}, {len(detector.genomes)} classifiers"
    console.print(f"{found} of {len(verdicts)} abnormal, {by}")


def print_standings(
    console: Console, found: "Detection", timed: "Sequence[TimedVerdict]", *, seconds: bool, steps: int
) -> None:
    """Print how unlike normal ones individuals are, the most unlike first, and what can be promised."""
    table = _headed("individual", ("rank", "windows", "score", "p-value"), ("verdict",))
    table.add_column("when (s)" if seconds else "since sample")
    for name, *cells, verdict, when in standing_rows(found, timed, seconds=seconds):
        table.add_row(Text(name), *cells, Text(verdict, style="bold red" if verdict == "abnormal" else ""), when)
    console.print(table)
    called = sum(bool(each.abnormal) for each in found.individuals)
    ways = [f"{each.individuals[k].individual} by {each.name}" for each in found.rankings[1:] for k in _first(each)]
    by = f"ranked by {found.rankings[0].name} (first would be {', '.join(ways)})" if ways else "ranked by it alone"
    console.print(f"{called} of {len(timed)} abnormal, by windows of {steps} steps; {by}")
    for remark in found.remarks:
        console.print(remark)


def standing_rows(found: "Detection", timed: "Sequence[TimedVerdict]", *, seconds: bool) -> list[tuple[str, ...]]:
    """Return individual, rank, windows, score, p-value, verdict, and when, the most unlike individual first."""
    rows: list[tuple[str, ...]] = []
    for k in sorted(range(len(timed)), key=lambda k: found.individuals[k].rank):
        each, spells = found.individuals[k], timed[k].spells
        when = "-"
        if spells:
            when = f"{spells[0][0]:.1f} to {spells[0][1]:.1f}" if seconds else f"{spells[0][0]:g}"
        verdict = "-" if each.abnormal is None else "abnormal" if each.abnormal else "normal"
        score = f"{each.score:.3g}" if each.windows else "-"
        p_value = "-" if each.p_value != each.p_value else f"{each.p_value:.2g}"
        rows.append(
            (
                each.individual,
                str(each.rank),
                str(each.windows),
                score,
                p_value,
                verdict if each.windows else "no window",
                when,
            )
        )
    return rows


def _first(ranking: "Ranking") -> list[int]:
    """Return who is most unlike."""
    return [k for k, each in enumerate(ranking.individuals) if each.rank == 1]


def _headed(first: str, numbers: Sequence[str], others: Sequence[str], caption: str | None = None) -> Table:
    """Return a table with a column of names, some of numbers, and some of words."""
    table = Table(caption=caption, caption_justify="left")
    table.add_column(first)
    for heading in numbers:
        table.add_column(heading, justify="right")
    for heading in others:
        table.add_column(heading)
    return table


def _abnormal(abnormal: bool) -> Text:
    return Text("abnormal", style="bold red") if abnormal else Text("normal")
