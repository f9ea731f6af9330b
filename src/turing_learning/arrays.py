"""Arrays at a door: shape, type and finiteness, checked in one place."""

from typing import Any, NoReturn

import numpy as np

from .errors import RefusedError, Text, brief, refuse


def array(
    name: str, value: Any, shape: str, *, finite: bool = True, dtype: Any = np.float64, empty: bool = False,
    remedy: Text = "", place: str = "", error: type[RefusedError] = RefusedError, **sizes: int,
) -> np.ndarray:  # fmt: skip
    """Return a value as an array of a shape and type, itself where it fits, else a copy; reject anything else.

    Masked values, complex numbers, text and objects are rejected, not converted; so are numbers with a fraction for
    integers, NaN and infinity unless `finite` is False, and axes of size 0 unless `empty` is True. The shape has letters
    for the axes, as in docs/symbols.md: "K T D". A number fixes an axis, "..." stands for any axes before the others, a
    letter that comes twice has one size, and `sizes` are those that letters must have.
    """
    axes, want = shape.split(), np.dtype(dtype)

    def rejected(rule: str, got: str, instead: Text = remedy) -> NoReturn:
        refuse(name, rule, got, instead, place=place, error=error)

    if np.ma.isMaskedArray(value) and np.ma.getmaskarray(value).any():
        rejected("have no masked values", "a masked array", remedy or "Fill them, or leave them out.")
    try:
        given = np.asarray(value)
    except Exception:  # rows of different lengths, or objects that fail
        rejected(f"be an array of shape {_symbols(axes, sizes)}", f"a {type(value).__name__}")
    floats, kinds = given.dtype.kind == "f", {"f": "fiu", "i": "iu", "u": "u", "b": "b"}[want.kind]
    fits = given.dtype.kind in kinds or (floats and given.size == 0)
    if not (fits or (want.kind in "iu" and floats and np.isfinite(given).all() and (given == np.floor(given)).all())):
        noun = {"f": "numbers", "i": "integers", "u": "non-negative integers", "b": "truth values"}[want.kind]
        rejected(f"be an array of {noun}", f"an array of {given.dtype}" if given.shape else brief(value))
    if not _fits(given.shape, axes, sizes, empty):
        also = "" if empty else " and not empty" if 0 in given.shape else ""
        rejected(f"be of shape {_symbols(axes, sizes)}{also}", str(given.shape))
    # minimum and maximum are finite only where all values are: half the time of a look at each value
    if finite and floats and given.size and not (np.isfinite(given.min()) and np.isfinite(given.max())):
        at = tuple(int(k) for k in np.argwhere(~np.isfinite(given))[0])
        rejected("be finite", f"{given[at]} at {at} of {_letters(axes)}")
    return given.astype(want, copy=False)


def _fits(shape: tuple[int, ...], axes: list[str], sizes: dict[str, int], empty: bool) -> bool:
    if axes and axes[0] == "...":
        axes = [f"...{k}" for k in range(len(shape) - len(axes) + 1)] + axes[1:]
    if len(shape) != len(axes) or (not empty and 0 in shape):
        return False
    known = dict(sizes)
    return all(
        size == (int(axis) if axis.isdigit() else known.setdefault(axis, size))
        for axis, size in zip(axes, shape, strict=True)
    )


def _letters(axes: list[str]) -> str:
    return f"({', '.join(axes)}{',' if len(axes) == 1 else ''})"


def _symbols(axes: list[str], sizes: dict[str, int]) -> str:
    """Return "(M, P)", or "(M, P) = (any, 4)" where some sizes are known."""
    if not any(axis in sizes for axis in axes):
        return _letters(axes)
    known = [str(sizes[axis]) if axis in sizes else axis if axis.isdigit() or axis == "..." else "any" for axis in axes]
    return f"{_letters(axes)} = {_letters(known)}"
