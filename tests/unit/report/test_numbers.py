"""Numbers as a reader sees them."""

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from turing_learning.analysis import WHY_UNKNOWN
from turing_learning.report import short_number, shown
from turing_learning.report.tabular import (
    comma_separated,
    describe_unknown,
    parameter_table,
    parameter_texts,
    tables,
)


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (-0.70004, 3, "-0.700"),
        (9999.0, 3, "9999.000"),
        (-1.5e300, 3, "-1.50e+300"),
        (0.0123, 3, "0.012"),
        (0.00123, 3, "0.00123"),
        (1e-4, 3, "0.0001"),
        (-1.23456e-7, 3, "-1.23e-07"),
        (0.0, 3, "0.000"),
        (0.0001234, 4, "0.0001234"),
        (12345.0, 4, "1.234e+04"),
    ],
)
def test_numbers_of_any_size_stay_short(value, decimals, text):
    assert short_number(value, decimals) == text


@given(st.floats(-1e300, 1e300))
def test_no_number_loses_more_than_a_twentieth_of_itself(value):
    assert float(short_number(value)) == pytest.approx(value, rel=0.05, abs=0)


@pytest.mark.parametrize(("value", "text"), [(0.5, "50%"), (None, "-"), (float("nan"), "-")])
def test_there_is_a_dash_where_there_is_no_number(value, text):
    assert shown(value, "{:.0%}".format) == text


def test_it_is_said_what_is_unknown_and_why():
    nan = float("nan")
    told = describe_unknown({"a": [nan, nan], "b": [0.0, 0.0], "c": [nan, nan]})
    assert told == f"The 90 % interval is unknown for a, c: {WHY_UNKNOWN}."
    assert describe_unknown({"b": [0.0, 0.0]}) == ""


def test_no_cell_is_cut_beside_long_names_of_rows():
    from rich.console import Console

    name = "persistent+walls+differences+tracker"
    headings = ["model", "accuracy (95 %)", "more than the first", "verdict"]
    row = [name, "0.982 (0.948 to 1.000)", "0.262 (0.150 to 0.370)", "told apart"]
    console = Console(width=80, record=True, file=io.StringIO())
    for table in tables(headings, [row], 80):
        console.print(table)
    text = console.export_text()
    assert all(cell in text for cell in row)
    assert "\N{HORIZONTAL ELLIPSIS}" not in text


@pytest.mark.parametrize(("width", "count"), [(19, 1), (18, 1), (17, 1), (16, 2)])
def test_columns_stand_closer_where_that_spares_a_further_table(width, count):
    assert len(list(tables(["parameter", "a", "b"], [["x", "1.0", "2.0"]], width))) == count


def test_a_table_of_parameters_as_texts_is_what_pandas_writes():
    columns = {
        "unit": {"a, b": "cm", 'q"': "", "c": "rad"},
        "estimate": {"a, b": 0.1 + 0.2, 'q"': -1e-07, "c": 3.0},
        "interval": {"a, b": (0.0, 1.5), 'q"': (None, None), "c": (float("nan"), 2.0)},
        "best_model": None,
        "truth": {"a, b": 1.0, "c": 2.0},
    }
    text = comma_separated(parameter_texts(**columns))
    assert text == parameter_table(**columns).to_csv(lineterminator="\n")
