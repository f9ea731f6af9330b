"""Genuine and counterfeit samples."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Samples:
    """What the classifiers get to see in one generation: series of D signals over T time steps.

    Attributes
    ----------
    genuine : (K, T, D)
        Samples of the system under investigation; floats, finite.
    counterfeit : (M, C, T, D)
        C samples of each of the M models; floats, finite.

    Raises
    ------
    TypeError
        If one of the two is no array of floats.
    ValueError
        If a shape is wrong or empty, the two disagree in T or D, or a value is not finite.
    """

    genuine: np.ndarray
    counterfeit: np.ndarray

    def __post_init__(self) -> None:
        _check("genuine", self.genuine, "(K, T, D)", 3)
        _check("counterfeit", self.counterfeit, "(M, C, T, D)", 4)
        if self.genuine.shape[-2:] != self.counterfeit.shape[-2:]:
            raise ValueError(
                "`genuine` and `counterfeit` must agree in time steps T and signals D; "
                f"got {self.genuine.shape} and {self.counterfeit.shape}."
            )


def _check(name: str, samples: np.ndarray, symbols: str, dimensions: int) -> None:
    if not isinstance(samples, np.ndarray) or not np.issubdtype(samples.dtype, np.floating):
        received = samples.dtype if isinstance(samples, np.ndarray) else type(samples).__name__
        raise TypeError(f"`{name}` must be an array of floats; got {received}.")
    if samples.ndim != dimensions or samples.size == 0:
        raise ValueError(f"`{name}` must be of shape {symbols} and not empty; got {samples.shape}.")
    # minimum and maximum are finite only where all values are: half the time of a look at each value
    if not (np.isfinite(samples.min()) and np.isfinite(samples.max())):
        place = tuple(int(k) for k in np.argwhere(~np.isfinite(samples))[0])
        raise ValueError(f"`{name}` must be finite; got {samples[place]} at {place} of {symbols}.")
