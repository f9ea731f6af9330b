"""Arrays at a door: shape, type and finiteness, checked in one place."""

from typing import Any, NoReturn

import numpy as np

from .errors import RefusedError, Text, brief, refuse, require

# By the kind of the array that is wanted (NumPy's letters): kinds that are converted to it, and
# how messages call it.
_KINDS = {"f": "fiu", "i": "iu", "u": "u", "b": "b"}
_NOUNS = {"f": "numbers", "i": "integers", "u": "non-negative integers", "b": "truth values"}


def array(
    name: str,
    value: Any,
    shape: str,
    *,
    finite: bool = True,
    dtype: Any = np.float64,
    empty: bool = False,
    remedy: Text = "",
    place: str = "",
    error: type[RefusedError] = RefusedError,
    **sizes: int,
) -> np.ndarray:
    """Return a value as an array of a shape and type, itself where it fits, else a copy; reject anything else.

    Masked values, complex numbers, text and objects are rejected, not converted; so are numbers
    with a fraction for integers, NaN and infinity unless `finite` is False, and axes of size 0
    unless `empty` is True. The shape has letters for the axes, as in docs/symbols.md: "K T D". A
    number fixes an axis, "..." stands for any axes before the others, a letter that comes twice has
    one size, and `sizes` are those that letters must have.
    """
    axes = shape.split()
    dtype = np.dtype(dtype)

    def rejected(rule: str, got: str, remedy: Text = remedy) -> NoReturn:
        refuse(name, rule, got, remedy, place=place, error=error)

    if np.ma.isMaskedArray(value) and np.ma.getmaskarray(value).any():
        rejected(
            "have no masked values", "a masked array", remedy or "Fill them, or leave them out."
        )
    try:
        numbers = np.asarray(value)
    except Exception:
        # Rows of different lengths, or objects that fail
        rejected(f"be an array of shape {_symbols(axes, sizes)}", f"a {type(value).__name__}")
    if not _convertible(numbers, dtype):
        got = f"an array of {numbers.dtype}" if numbers.shape else brief(value)
        rejected(f"be an array of {_NOUNS[dtype.kind]}", got)
    if not _fits(numbers.shape, axes, sizes, empty):
        rule = f"be of shape {_symbols(axes, sizes)}"
        if 0 in numbers.shape and not empty:
            rule += " and not empty"
        rejected(rule, str(numbers.shape))
    if finite and numbers.dtype.kind == "f" and numbers.size and not _all_finite(numbers):
        position = tuple(map(int, np.argwhere(~np.isfinite(numbers))[0]))
        rejected("be finite", f"{numbers[position]} at {position} of {_letters(axes)}")
    return numbers.astype(dtype, copy=False)


def check_tank(tank_cm: Any) -> None:
    """Reject width and height of a tank (cm) that are not two lengths; None is no tank."""
    if tank_cm is None:
        return
    fits = np.shape(tank_cm) == (2,) and all(0 < side < np.inf for side in tank_cm)
    require(fits, "tank_cm", "be two finite numbers above 0, or None", brief(tank_cm))


def _convertible(numbers: np.ndarray, dtype: "np.dtype[Any]") -> bool:
    """Return whether an array can become one of `dtype` without losing anything."""
    if numbers.dtype.kind in _KINDS[dtype.kind]:
        return True
    if numbers.dtype.kind != "f":
        return False
    # NumPy takes an empty list for floats
    if numbers.size == 0:
        return True
    integral = np.isfinite(numbers).all() and (numbers == np.floor(numbers)).all()
    return dtype.kind in "iu" and bool(integral)


def _all_finite(numbers: np.ndarray) -> bool:
    # Minimum and maximum are finite only where all values are: half the time of a look at each
    # value.
    return bool(np.isfinite(numbers.min()) and np.isfinite(numbers.max()))


def _fits(shape: tuple[int, ...], axes: list[str], sizes: dict[str, int], empty: bool) -> bool:
    if 0 in shape and not empty:
        return False
    if axes and axes[0] == "...":
        axes = axes[1:]
        shape = shape[max(len(shape) - len(axes), 0) :]
    if len(shape) != len(axes):
        return False
    expected = dict(sizes)
    for axis, size in zip(axes, shape, strict=True):
        if axis.isdigit():
            expected[axis] = int(axis)
        if expected.setdefault(axis, size) != size:
            return False
    return True


def _letters(axes: list[str]) -> str:
    """Return "(K, T, D)", as Python writes a tuple."""
    comma = "," if len(axes) == 1 else ""
    return f"({', '.join(axes)}{comma})"


def _symbols(axes: list[str], sizes: dict[str, int]) -> str:
    """Return "(M, P)", or "(M, P) = (any, 4)" where some sizes are fixed."""
    if sizes.keys().isdisjoint(axes):
        return _letters(axes)
    expected = []
    for axis in axes:
        if axis in sizes:
            expected.append(str(sizes[axis]))
        elif axis.isdigit() or axis == "...":
            expected.append(axis)
        else:
            expected.append("any")
    return f"{_letters(axes)} = {_letters(expected)}"
