"""Results in a notebook: their first line and their table."""

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

from ._numbers import short_number

if TYPE_CHECKING:
    import pandas as pd


class Tabular:
    """Give a result a short `repr` and a table in notebooks, from the first line of its text and from `to_dataframe`."""

    def to_dataframe(self) -> "pd.DataFrame":
        """Return the result as a table."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {str(self).partition(chr(10))[0].rstrip(':')}>"

    def _repr_html_(self) -> str:
        head = escape(str(self).partition("\n")[0])
        return f"<p>{head}</p>{self.to_dataframe().to_html(float_format=short_number, na_rep='-', border=0)}"


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
