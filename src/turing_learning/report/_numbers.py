"""Numbers as a reader sees them."""

import math
from collections.abc import Callable, Mapping, Sequence

from turing_learning.analysis import WHY_UNKNOWN, is_known

MOST_DECIMALS = 5
"""Places after the point, beyond which a column has exponents."""

LARGEST_FIXED = 1e4
"""Beyond it numbers are shown with an exponent."""


def short_number(value: float, decimals: int = 3) -> str:
    """Return a number in a few characters, whatever its size, and never as 0 unless it is.

    Parameters
    ----------
    value
        Any number.
    decimals
        Places after the point of common numbers, >= 2; as many significant digits of those that would keep only one, or none.

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


def aligned(values: Sequence[float | None], nothing: str = "-") -> list[str]:
    """Return the numbers of a column, all with the same number of places after the point, or all with an exponent.

    Examples
    --------
    >>> aligned([8.43, 0.35, None, -0.0021])
    ['8.4300', '0.3500', '-', '-0.0021']
    >>> aligned([1.2e-7, 3.0])
    ['1.200e-07', '3.000e+00']
    """
    sizes = [abs(value) for value in values if value is not None and is_known(value) and value != 0]
    decimals = max(4, 1 - math.floor(math.log10(min(sizes)))) if sizes else 4
    fixed = decimals <= MOST_DECIMALS and max(sizes, default=0.0) < LARGEST_FIXED
    return [shown(value, f"{{:.{decimals}f}}".format if fixed else "{:.3e}".format, nothing) for value in values]


def shown(value: float | None, form: Callable[[float], str] = short_number, nothing: str = "-") -> str:
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
    return form(value) if value is not None and is_known(value) else nothing


def counted(number: int, noun: str) -> str:
    """Return a number of things in words.

    Examples
    --------
    >>> counted(1, "run"), counted(30, "run")
    ('1 run', '30 runs')
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def describe_unknown(
    interval: Mapping[str, Sequence[float]], what: str = "The 90 % interval", why: str = WHY_UNKNOWN
) -> str:
    """Say in one sentence of which parameters something is not known, and why; nothing if it is known of all.

    Parameters
    ----------
    interval
        Name -> two ends, or other numbers.
    what
        What it is, as the sentence begins.
    why
        Why it is not known, as the sentence ends.

    Examples
    --------
    >>> describe_unknown({"speed": [float("nan")] * 2, "turn": [0.1, 0.2]})[:44]
    'The 90 % interval is unknown for speed: the '
    >>> describe_unknown({"turn": [0.1, 0.2]})
    ''
    """
    names = ", ".join(name for name, values in interval.items() if not is_known(*values))
    return f"{what} is unknown for {names}: {why}." if names else ""
