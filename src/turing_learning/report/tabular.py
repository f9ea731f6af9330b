"""Results as a reader sees them in print, on terminals and in notebooks: a line, a table, remarks."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from turing_learning.analysis import WHY_UNKNOWN, Judgment, Verdict, is_known

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.table import Table
    from rich.text import Text

MOST_DECIMALS = 5
"""Places after the point, beyond which a column has exponents."""

LARGEST_FIXED = 1e4
"""Beyond it numbers are shown with an exponent."""

ALARMING = ("abnormal", "disagree", "it is at the bound", "the estimate does not fit")
UNLIMITED_WIDTH = 100_000
"""Characters of a line where no terminal says how many there are."""
NARROWEST_WORDS = 24
"""Characters to which a column of words may shrink."""


def short_number(value: float, decimals: int = 3) -> str:
    """Return a number in a few characters, whatever its size, and never as 0 unless it is.

    Parameters
    ----------
    value
        Any number.
    decimals
        Places after the point of common numbers, >= 2; as many significant digits of those that
        would keep only one, or none.

    Examples
    --------
    >>> [short_number(value) for value in (-0.7, 0.012, 0.00012, 0.0, 1.5e7)]
    ['-0.700', '0.012', '0.00012', '0.000', '1.50e+07']
    """
    if abs(value) >= LARGEST_FIXED:
        return f"{value:.{decimals - 1}e}"
    if 0 < abs(value) < 10.0 ** (1 - decimals):
        return f"{value:.{decimals}g}"
    return f"{value:.{decimals}f}"


def has_errors(heading: str) -> bool:
    """Return whether a column holds errors, by its heading."""
    return heading.endswith("error")


def aligned(
    values: Sequence[float | None], nothing: str = "-", decimals: int = 4, *, rough: bool = False
) -> list[str]:
    """Return the numbers of a column, all with as many places after the point, or all with an exponent.

    There are at least so many places, and more for small numbers. Of a `rough` column, such as errors, a number
    of some millionths keeps one digit.

    >>> aligned([8.43, 0.35, None, -0.0021]), aligned([0.0231, 4.112e-5]), aligned([1.2e-7, 3.0])
    (['8.4300', '0.3500', '-', '-0.0021'], ['0.02310', '0.00004'], ['1.200e-07', '3.000e+00'])
    >>> aligned([9.4e-6, 0.0012]), aligned([9.4e-6, 0.0012], rough=True)
    (['9.400e-06', '1.200e-03'], ['0.000009', '0.001200'])
    """
    sizes = []
    for value in values:
        if value is not None and is_known(value) and value != 0:
            sizes.append(abs(value))
    smallest = min(sizes, default=1.0)
    largest = max(sizes, default=0.0)
    # Place after the point of the first digit of the smallest number.
    first_digit = -math.floor(math.log10(smallest))
    form = "{:.3e}".format
    # Columns of tiny numbers alone have exponents a place earlier
    most_decimals = MOST_DECIMALS - 1
    if largest >= 1e-4:
        most_decimals = MOST_DECIMALS + rough
    if first_digit <= most_decimals and largest < LARGEST_FIXED:
        digits = min(first_digit + 1, MOST_DECIMALS)
        form = f"{{:.{max(decimals, first_digit, digits)}f}}".format
    return [shown(value, form, nothing) for value in values]


def shown(
    value: float | None, form: Callable[[float], str] = short_number, nothing: str = "-"
) -> str:
    """Return a number as it stands in a table.

    Parameters
    ----------
    value
        A number; None where there is none, NaN where it is not known.
    form
        Makes the text of a number.
    nothing
        What stands there without one.

    Examples
    --------
    >>> shown(0.5), shown(0.5, "{:.0%}".format), shown(None), shown(float("nan"))
    ('0.500', '50%', '-', '-')
    """
    if value is None or not is_known(value):
        return nothing
    return form(value)


def counted(number: int, noun: str) -> str:
    """Return a number of things in words.

    Examples
    --------
    >>> counted(1, "run"), counted(30, "run")
    ('1 run', '30 runs')
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def describe_unknown(
    interval: Mapping[str, Sequence[float]],
    subject: str = "The 90 % interval",
    why: str = WHY_UNKNOWN,
) -> str:
    """Say in one sentence of which names something, two ends or other numbers, is not known, and why; nothing if of none."""
    names = [name for name, values in interval.items() if not is_known(*values)]
    if not names:
        return ""
    return f"{subject} is unknown for {', '.join(names)}: {why}."


class Tabular:
    """Show a result by its first line, its table and remarks: in `print`, by rich on terminals, and in notebooks."""

    def to_dataframe(self) -> "pd.DataFrame":
        """Return the result as a table."""
        raise NotImplementedError

    def _shown(self) -> "tuple[str, Sequence[str], Sequence[Sequence[str]], Sequence[str | Text]]":
        """Return the first line, headings and rows of the table, and remarks."""
        raise NotImplementedError

    def __rich_console__(
        self, console: "Console", options: "ConsoleOptions"
    ) -> "Iterator[RenderableType]":
        from rich.text import Text

        head, headings, rows, remarks = self._shown()
        yield Text(head, style="bold")
        yield from tables(headings, rows, options.max_width)
        for remark in remarks:
            yield Text(remark) if isinstance(remark, str) else remark

    def __str__(self) -> str:
        from rich.console import Console

        file = io.StringIO()
        Console(file=file, width=UNLIMITED_WIDTH, color_system=None, force_jupyter=False).print(
            self
        )
        return "\n".join(line.rstrip() for line in file.getvalue().splitlines())

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._shown()[0].rstrip(':')}>"

    def _repr_html_(self) -> str:
        head, *_, remarks = self._shown()
        table = self.to_dataframe().to_html(float_format=short_number, na_rep="-", border=0)
        lines = "<br>".join(escape(str(remark)) for remark in remarks)
        return f"<p>{escape(head)}</p>{table}<p>{lines}</p>"


class Judged(Tabular):
    """A result with a judgment: whether to believe it."""

    @property
    def judgment(self) -> Judgment:
        """Whether to believe it, and why."""
        raise NotImplementedError

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """All that is to be said of whether to believe it, in words."""
        return self.judgment.verdicts

    @property
    def verdict(self) -> Verdict:
        """Whether to believe it, in a word: the first of `verdicts`."""
        return self.judgment.verdict


def tables(headings: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> "Iterator[Table]":
    """Yield a table for a terminal: words to the left, numbers to the right, alarming words in red.

    Where a terminal of `width` characters has no room for a column, columns stand closer; if that is
    not enough, it and those after it come in a further table, which begins with the first column
    again. Columns of words wrap before they do so.
    """
    from rich.table import Table
    from rich.text import Text

    is_number = []
    least_widths = []
    for k, heading in enumerate(headings):
        cells = [row[k] for row in rows]
        is_number.append(all(cell[:1] in "-0123456789" or cell == "inf" for cell in cells))
        width_of_column = max(map(len, (heading, *cells)))
        # the first column does not wrap
        if not is_number[k] and k > 0:
            width_of_column = min(width_of_column, NARROWEST_WORDS)
        least_widths.append(width_of_column)
    remaining = list(range(1, len(headings)))
    # one character between columns, rather than two, where that spares a further table
    gaps = len(remaining)
    gap = 2
    if sum(least_widths) + gaps <= width < sum(least_widths) + 2 * gaps:
        gap = 1
    while remaining:
        chosen = [0]
        # A table has at least one column beside the first.
        taken = least_widths[0]
        while remaining and (len(chosen) == 1 or taken + gap + least_widths[remaining[0]] <= width):
            taken += gap + least_widths[remaining[0]]
            chosen.append(remaining.pop(0))
        table = Table(box=None, padding=(0, gap, 0, 0), pad_edge=False, header_style="dim")
        for k in chosen:
            # the first column has the names of rows, also where these are numbers
            if is_number[k] and k != 0:
                table.add_column(headings[k], justify="right", no_wrap=True)
            else:
                table.add_column(headings[k], no_wrap=k == 0)
        for row in rows:
            texts = []
            for k in chosen:
                alarming = row[k].startswith(ALARMING)
                texts.append(Text(row[k], style="bold red" if alarming else ""))
            table.add_row(*texts)
        yield table


def judged(judgment: Judgment) -> "Text":
    """Say whether to believe a result, in the color of its verdict."""
    from rich.text import Text

    color = {"good": "green", "bad": "red", "warning": "yellow"}[judgment.look]
    return Text(judgment.line, style=f"bold {color}")


def parameter_rows(
    labels: Mapping[str, str], columns: Mapping[str, Mapping[str, Any] | None]
) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows of a table.

    Parameters
    ----------
    labels
        Name of a parameter -> its label.
    columns
        Heading -> name -> number, two ends, or word. A column that is None is left out.
    """
    headings = ["parameter"]
    texts = [list(labels.values())]
    for heading, column in columns.items():
        if column is not None:
            headings.append(heading)
            values = [column[name] for name in labels]
            texts.append(_cells(values, rough=has_errors(heading)))
    return headings, list(map(list, zip(*texts, strict=True)))


def _cells(values: Sequence[Any], *, rough: bool = False) -> list[str]:
    """Return the texts of a column of numbers, of intervals, or with words."""
    if any(isinstance(value, str) for value in values):
        return [value if isinstance(value, str) else shown(value) for value in values]
    if not any(isinstance(value, Sequence) for value in values):
        return aligned(values, decimals=3, rough=rough)
    # the ends of a narrow interval would look alike
    narrow = any(high - low < 0.01 for low, high in values)
    decimals = 4 if narrow else 3
    intervals = []
    for low, high in values:
        interval = "-"
        if is_known(low, high):
            interval = f"{short_number(low, decimals)} to {short_number(high, decimals)}"
        intervals.append(interval)
    return intervals


def parameter_table(**columns: Mapping[str, Any] | None) -> "pd.DataFrame":
    """Return a row for each parameter, of columns name -> value; "interval" becomes `low` and `high`.

    A column that is None, or an empty text in every row, is left out.
    """
    import pandas as pd

    return pd.DataFrame(_filled(columns)).rename_axis("parameter")


def parameter_texts(**columns: Mapping[str, Any] | None) -> list[list[str]]:
    """Return the rows of the same table as texts, the headings first; what is not known is empty."""
    filled = _filled(columns)
    rows = [["parameter", *filled]]
    for name in filled["estimate"]:
        row = [name]
        for column in filled.values():
            value: Any = column.get(name)
            if isinstance(value, str):
                row.append(value)
            elif is_known(value):
                row.append(str(float(value)))
            else:
                row.append("")
        rows.append(row)
    return rows


def comma_separated(rows: Iterable[Sequence[str]]) -> str:
    """Return rows of texts as CSV, as pandas writes it."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _filled(columns: Mapping[str, Mapping[str, Any] | None]) -> dict[str, Mapping[str, Any]]:
    """Return the columns that a table of parameters has."""
    filled: dict[str, Mapping[str, Any]] = {}
    for heading, column in columns.items():
        if column is None:
            continue
        if heading == "interval":
            filled["low"] = {name: low for name, (low, _) in column.items()}
            filled["high"] = {name: high for name, (_, high) in column.items()}
        elif any(value != "" for value in column.values()):
            filled[heading] = column
    return filled
