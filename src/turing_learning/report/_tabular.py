"""Results as a reader sees them in print, on terminals and in notebooks: a line, a table, remarks."""

import io
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from turing_learning.analysis import Verdict, judgment

from ._numbers import short_number, shown

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.table import Table
    from rich.text import Text

ALARMING = ("abnormal", "disagree", "it is at the bound", "the model is rejected")
WIDE = 100_000  # characters, where no terminal says how many there are
LEAST = 24  # characters to which a column of words may shrink


class Tabular:
    """Show a result by its first line, its table and remarks: in `print`, by rich on terminals, and in notebooks."""

    def to_dataframe(self) -> "pd.DataFrame":
        """Return the result as a table."""
        raise NotImplementedError

    def _shown(self) -> "tuple[str, Sequence[str], Sequence[Sequence[str]], Sequence[str | Text]]":
        """Return the first line, headings and rows of the table, and remarks."""
        raise NotImplementedError

    def __rich_console__(self, console: "Console", options: "ConsoleOptions") -> "Iterator[RenderableType]":
        from rich.text import Text

        head, headings, rows, remarks = self._shown()
        yield Text(head, style="bold")
        yield from tables(headings, rows, options.max_width)
        yield from (Text(each) if isinstance(each, str) else each for each in remarks)

    def __str__(self) -> str:
        from rich.console import Console

        file = io.StringIO()
        Console(file=file, width=WIDE, color_system=None, force_jupyter=False).print(self)
        return "\n".join(line.rstrip() for line in file.getvalue().splitlines())

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._shown()[0].rstrip(':')}>"

    def _repr_html_(self) -> str:
        head, *_, remarks = self._shown()
        table = self.to_dataframe().to_html(float_format=short_number, na_rep="-", border=0)
        return f"<p>{escape(head)}</p>{table}<p>{'<br>'.join(escape(str(each)) for each in remarks)}</p>"


def tables(headings: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> "Iterator[Table]":
    """Yield a table for a terminal: words to the left, numbers to the right, alarming words in red.

    Where a terminal of `width` characters has no room for a column, it and those after it come in a further table, which begins
    with the first column again. Columns of words wrap before they do so.
    """
    from rich.table import Table
    from rich.text import Text

    columns = [[row[k] for row in rows] for k in range(len(headings))]
    sizes = [max(map(len, (heading, *cells))) for heading, cells in zip(headings, columns, strict=True)]
    numbers = [all(cell[:1] in "-0123456789" or cell == "inf" for cell in cells) for cells in columns]
    least = [size if number else min(size, LEAST) for size, number in zip(sizes, numbers, strict=True)]
    left = list(range(1, len(headings)))
    while left:
        taken = [0]
        while left and (len(taken) == 1 or sum(least[k] + 2 for k in (*taken, left[0])) - 2 <= width):
            taken.append(left.pop(0))
        table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
        for k in taken:
            number = numbers[k] and k != 0
            table.add_column(headings[k], justify="right" if number else "left", no_wrap=number or k == 0)
        for row in rows:
            table.add_row(*(Text(row[k], style="bold red" if row[k].startswith(ALARMING) else "") for k in taken))
        yield table


def judged(verdicts: tuple[Verdict, ...]) -> "Text":
    """Say whether to believe a result, in the color of its verdict."""
    from rich.text import Text

    color = "green" if verdicts == ("converged",) else "red" if "model rejected" in verdicts else "yellow"
    return Text(judgment(verdicts), style=f"bold {color}")


def parameter_rows(
    labels: Mapping[str, str], columns: Mapping[str, Mapping[str, Any] | None]
) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows of a table from columns heading -> name -> number, two ends, or word; None is left out."""

    def text(value: Any) -> str:
        if isinstance(value, str):
            return value
        if isinstance(value, Sequence):
            return shown(value[0], lambda low: f"{short_number(low)} to {short_number(value[1])}")
        return shown(value)

    known = {heading: column for heading, column in columns.items() if column is not None}
    rows = [[label, *(text(column[name]) for column in known.values())] for name, label in labels.items()]
    return ["parameter", *known], rows


def parameter_table(columns: Mapping[str, Mapping[str, Any] | None]) -> "pd.DataFrame":
    """Return a row for each parameter: columns name -> value, without those that are None; "interval" becomes `low` and `high`."""
    import pandas as pd

    found: dict[str, Mapping[str, Any]] = {}
    for heading, column in columns.items():
        if heading == "interval" and column is not None:
            found["low"], found["high"] = ({name: ends[side] for name, ends in column.items()} for side in (0, 1))
        elif column is not None:
            found[heading] = column
    return pd.DataFrame(found).rename_axis("parameter")
