import copy
import math

import pytest

from turing_learning.analysis import UNKNOWN, is_known, replace_unknown


@pytest.mark.parametrize(
    ("values", "known"),
    [
        ((0.0, 1.0), True),
        ((math.inf,), True),
        ((), True),
        ((math.nan,), False),
        ((1.0, None), False),
    ],
)
def test_none_and_nan_are_not_known(values, known):
    assert is_known(*values) is known


def test_what_is_not_known_is_none_in_a_file_and_one_nan_in_python():
    interval = {"a": [0.5, 0.75], "b": [float("nan"), float("nan")]}
    file = replace_unknown(None, interval)
    assert file == {"a": [0.5, 0.75], "b": [None, None]}
    python = replace_unknown(UNKNOWN, file)
    assert python["a"] == [0.5, 0.75]
    assert all(map(math.isnan, python["b"]))
    assert python == replace_unknown(UNKNOWN, interval) == copy.deepcopy(python)
