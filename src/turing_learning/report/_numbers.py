"""Numbers as a reader sees them."""

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
