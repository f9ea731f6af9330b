"""What is printed at the end: inferred, true, absolute error, the paper's figure."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from ._live import number

if TYPE_CHECKING:
    from turing_learning.runs import Result
    from turing_learning.swarm import Scenario


CAPTION = "error: absolute; paper: the absolute error that the paper reports for the best model"


def print_result(console: Console, result: "Result") -> None:
    """Print the table of a run, how long it took, and where its files are."""
    console.print(result_table(result))
    console.print(
        f"{result.generations} generations in {result.seconds_total:.1f} s, "
        f"{1000 * result.seconds_per_generation:.1f} ms each (median)",
        highlight=False,
    )
    if result.selection_stopped:
        console.print(f"selection stopped in {result.selection_stopped} generations", style="bold red", highlight=False)
    if result.path is not None:
        _print_places(console, result)


def _print_places(console: Console, result: "Result") -> None:
    report = result.path / "report.html" if result.path else None
    if report is not None and report.exists():
        console.print(f"report: {report}", markup=False, highlight=False, soft_wrap=True)
    console.print(f"run:    {result.path}", markup=False, highlight=False, soft_wrap=True)


def result_table(result: "Result") -> Table:
    """Return the table inferred / true / absolute error / the paper's figure."""
    state = "" if result.complete else ", not complete"
    table = Table(title=f"{result.scenario}, seed {result.seed}{state}", title_justify="left", caption=CAPTION)
    table.caption_justify = "left"
    table.add_column("parameter")
    for heading in ("estimate", "true", "error", "best model", "error", "paper"):
        table.add_column(heading, justify="right")
    for name, value in result.estimate.items():
        table.add_row(
            name,
            number(value),
            _entry(result.truth, name),
            _entry(result.estimate_absolute_error, name),
            number(result.best_model[name]),
            _entry(result.absolute_error, name),
            _entry(result.paper_absolute_error, name, digits=2),
        )
    table.add_section()
    table.add_row("mean", "", "", _optional(result.estimate_mae), "", _optional(result.mae), "")
    return table


def _entry(values: dict[str, float] | None, name: str, digits: int = 3) -> str:
    return "-" if values is None else _optional(values[name], digits)


def _optional(value: float | None, digits: int = 3) -> str:
    if value is None:
        return "-"
    return f"{value:.{digits}f}" if digits < 3 else number(value)


def print_scenarios(console: Console, scenarios: dict[str, "Scenario"]) -> None:
    """Print every scenario's name, what it is, and its agents' parameters."""
    for name, scenario in scenarios.items():
        console.print(f"[bold]{name}[/bold]  {scenario.description}", highlight=False, soft_wrap=True)
        values = ", ".join(
            f"{key} = {value:g}" for key, value in zip(scenario.parameter_names, scenario.controller, strict=True)
        )
        console.print(
            f"    {scenario.agents} agents, {scenario.replicas} replica; {values}", highlight=False, soft_wrap=True
        )
