"""What commands print at their end."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import turing_learning as tl

if TYPE_CHECKING:
    from rich.console import Console


def plain_console(*, stderr: bool = False) -> "Console":
    """Return where text is printed as it is: names of files and individuals may hold brackets."""
    from rich.console import Console

    return Console(stderr=stderr, markup=False, highlight=False)


def print_table(console: "Console", headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table, in parts where the terminal is narrow."""
    from turing_learning.report.tabular import tables

    for table in tables(headings, rows, console.width):
        console.print(table)


def print_files(console: "Console", **files: Path) -> None:
    """Print where files are, of those that exist."""
    for name, path in files.items():
        if path.exists():
            console.print(f"{name}: {path}", soft_wrap=True)


def named_numbers(values: Iterable[tuple[str, float]]) -> str:
    """Return names and numbers in one line."""
    return " ".join(f"{name} {tl.report.short_number(value)}" for name, value in values)


def print_result(
    console: "Console", result: "tl.Result", path: Path
) -> "tl.runs.ModelEvaluation | None":
    """Print what a run has inferred, and where its files are, by the path that was given.

    Of a run in a laboratory print and return what was found when its last models were observed again.
    """
    console.print(result)
    print_files(console, report=tl.runs.RunFolder(path).report_path)
    console.print(f"run:    {path}", soft_wrap=True)
    evaluation = tl.runs.read_post_evaluation(path)
    if evaluation is not None:
        times = tl.report.counted(evaluation.repeats, "time")
        text = f"the last models have been observed again {len(evaluation.fitness)} of {times}"
        if evaluation.best_model is not None:
            text = f"the last models, observed again {times}; the best: {named_numbers(evaluation.best_model.items())}"
        if evaluation.absolute_error is not None:
            text += f"; absolute errors: {named_numbers(evaluation.absolute_error.items())}"
        console.print(text, soft_wrap=True)
    return evaluation


def print_study(console: "Console", result: "tl.StudyResult") -> None:
    """Print the table of a study, how good the runs are, which failed, and where the files are."""
    console.print(result)
    print_files(console, report=result.path / "report.html", tables=result.path / "summary.csv")
    console.print(f"study:  {result.path}", soft_wrap=True)
