"""Results in a notebook: their first line and their table."""

from html import escape
from typing import TYPE_CHECKING

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
