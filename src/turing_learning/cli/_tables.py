"""What commands print at their end."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.text import Text

from turing_learning.report import counted, short_number
from turing_learning.report._tabular import tables

if TYPE_CHECKING:
    from turing_learning.detection import Detection, Detector, Motion, SampleVerdict, TimedVerdict
    from turing_learning.interaction import StimulatedSystem
    from turing_learning.results import Result
    from turing_learning.runs import ModelEvaluation
    from turing_learning.swarm import Scenario

MOST_SPELLS = 3  # in a cell


def print_table(console: Console, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table, in parts where the terminal is narrow."""
    for table in tables(headings, rows, console.width):
        console.print(table)


def print_result(console: Console, result: "Result", path: Path) -> None:
    """Print what a run has inferred, and where its files are, by the path of its folder as it was given."""
    from turing_learning.results import RunFolder

    console.print(result)
    if (report := RunFolder(path).report_path).exists():
        console.print(f"report: {report}", soft_wrap=True)
    console.print(f"run:    {path}", soft_wrap=True)


def print_post_evaluation(console: Console, found: "ModelEvaluation") -> None:
    """Print the best of the last models of a run in a laboratory, or how many times they have been observed again."""
    times = counted(found.repeats, "time")
    text = f"the last models have been observed again {len(found.fitness)} of {times}"
    if found.best_model is not None:
        text = f"the last models, observed again {times}; the best: {named_numbers(found.best_model.items())}"
    if found.absolute_error is not None:
        text += f"; absolute errors: {named_numbers(found.absolute_error.items())}"
    console.print(text, soft_wrap=True)


def named_numbers(values: Iterable[tuple[str, float]]) -> str:
    """Return names and numbers in one line."""
    return " ".join(f"{name} {short_number(value)}" for name, value in values)


def plain_console(*, stderr: bool = False) -> Console:
    """Return where text is printed as it is: names of files and individuals may hold brackets."""
    return Console(stderr=stderr, markup=False, highlight=False)


def print_scenarios(console: Console, scenarios: dict[str, "Scenario"]) -> None:
    """Print every scenario's name, what it is, and its agents' parameters."""
    from turing_learning.models import ReactiveModel

    for name, scenario in scenarios.items():
        console.print(Text(name, style="bold") + f"  {scenario.description}", soft_wrap=True)
        names, view = ReactiveModel(scenario.sensor.states).parameter_names, scenario.sensor.field_of_view
        values = [f"{name} = {speed:g}" for name, speed in zip(names, scenario.controller, strict=True)]
        if view > 0 or scenario.representation == "morphology":  # else a line of sight, as everywhere
            values.append(f"field of view {view:.4g} rad")
        objects = f", {scenario.objects.count} objects" if scenario.objects.count else ""
        bodies = f"{scenario.agents} agents, {scenario.replicas} replica{objects}"
        console.print(f"    {bodies}; {', '.join(values)}", soft_wrap=True)


def print_stimulated(console: Console, systems: Mapping[str, "StimulatedSystem"]) -> None:
    """Print the name of every system with stimuli, what it is, its stimuli, and its parameters."""
    for name, system in systems.items():
        console.print(Text(name, style="bold") + f"  {system.title}", soft_wrap=True)
        console.print(
            f"    stimuli {', '.join(system.stimulus.names)}; {system.shown(np.array(system.true))}", soft_wrap=True
        )


def print_verdicts(
    console: Console, detector: "Detector", motion: "Motion", verdicts: "Sequence[SampleVerdict]"
) -> None:
    """Print which individuals are abnormal, by samples."""
    rows = []
    for each in verdicts:
        numbers = (f"{100 * each.genuine_share:.0f} %", f"{each.score:.3f}", f"{each.p_value:.2g}")
        since = "-" if each.since is None else str(each.since)
        rows.append((each.individual, *numbers, "abnormal" if each.abnormal else "normal", since))
    headings = ("individual", "judged genuine", "score", "p-value", "verdict", "since sample")
    print_table(console, headings, rows)
    votes = detector.rule == "unanimous"
    limit = "all samples judged counterfeit" if votes else f"p-value up to {detector.false_alarms:g}"
    samples = f"{counted(motion.samples.shape[1], 'sample')} each of {detector.steps} steps"
    classifiers = counted(len(detector.genomes), "classifier")
    found = sum(verdict.abnormal for verdict in verdicts)
    text = f"{found} of {len(verdicts)} abnormal, by {samples}; rule {detector.rule}, {classifiers}, {limit}"
    console.print(text)


def print_timeline(console: Console, detector: "Detector", verdicts: "Sequence[TimedVerdict]") -> None:
    """Print which individuals of a recording are abnormal, and when."""
    rows = []
    for verdict in verdicts:
        numbers = (f"{verdict.score:.3f}", f"{verdict.strength:.2f}", f"{verdict.threshold:.2f}")
        word = "abnormal" if verdict.abnormal else "normal"
        spells = [f"{begin:.1f} to {end:.1f}" for begin, end in verdict.spells[:MOST_SPELLS]]
        more = len(verdict.spells) - MOST_SPELLS
        when = ", ".join(spells + ([f"{more} more"] if more > 0 else [])) or "-"
        cells = (*numbers, word) if verdict.windows else (*"---", "no window")
        rows.append((verdict.individual, str(verdict.windows), *cells, when))
    headings = ("individual", "windows", "score", "evidence", "threshold", "verdict", "when (s)")
    print_table(console, headings, rows)
    found = sum(verdict.abnormal for verdict in verdicts)
    by = f"by windows of {detector.steps} steps; rule {detector.rule}, {len(detector.genomes)} classifiers"
    console.print(f"{found} of {len(verdicts)} abnormal, {by}")


def print_standings(
    console: Console, found: "Detection", timed: "Sequence[TimedVerdict]", *, seconds: bool, steps: int
) -> None:
    """Print how unlike normal ones individuals are, the most unlike first, and what can be promised."""
    from turing_learning.detection._present import standings

    print_table(console, *standings(found, timed, seconds=seconds))
    called = sum(bool(each.abnormal) for each in found.individuals)
    others = [(ranking, each) for ranking in found.rankings[1:] for each in ranking.individuals]
    ways = [f"{each.individual} ({ranking.name})" for ranking, each in others if each.rank == 1]
    by = f"ranked by {found.rankings[0].name}" + f"; the other ways put first: {', '.join(ways)}" * bool(ways)
    console.print(f"{called} of {len(timed)} abnormal, by windows of {steps} steps; {by}")
    for remark in found.remarks:
        console.print(remark)
