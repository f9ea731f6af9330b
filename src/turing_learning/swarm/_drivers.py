"""Networks that drive robots instead of wheel speeds for each sensor state."""

from dataclasses import dataclass

import numpy as np

from ..kernels.networks import Networks, new_networks


@dataclass(frozen=True, eq=False)
class Drivers:
    """Which robots of R trials are driven by a network, and by which.

    Parameters
    ----------
    weights : (K, Q)
        Networks, laid out as in `models.ElmanModel`; finite.
    hidden
        Their hidden neurons H, with Q = H^2 + 4 H + 2.
    driver : (R, A)
        The network, 0 to K - 1, that drives each robot of each trial; -1 for a reactive robot.

    Raises
    ------
    ValueError
        If a shape or a value does not fit.
    """

    weights: np.ndarray
    hidden: int
    driver: np.ndarray

    def __post_init__(self) -> None:
        weights = np.ascontiguousarray(self.weights, dtype=np.float64)
        driver = np.ascontiguousarray(self.driver, dtype=np.int64)
        count = self.hidden * (self.hidden + 4) + 2
        if self.hidden < 1 or weights.ndim != 2 or weights.shape[1] != count:
            raise ValueError(
                f"`weights` must have shape (K, Q) = (any, {count}) for {self.hidden} hidden neurons, 1 or more; "
                f"got {weights.shape}."
            )
        if not np.isfinite(weights).all():
            raise ValueError(f"`weights` must be finite; got {weights[~np.isfinite(weights)].flat[0]}.")
        if driver.ndim != 2 or (driver.size and not -1 <= driver.min() <= driver.max() < len(weights)):
            raise ValueError(
                f"`driver` must have shape (R, A), with numbers of {len(weights)} networks from 0, or -1 for none; got "
                f"{f'{driver.min()} to {driver.max()}' if driver.size else 'none'} in shape {driver.shape}."
            )
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "driver", driver)

    def networks(self, trials: int, robots: int) -> Networks:
        """Return what the kernels execute; refuse drivers of other trials or robots."""
        if self.driver.shape != (trials, robots):
            raise ValueError(
                f"`drivers.driver` must have shape (R, A) = ({trials}, {robots}); got {self.driver.shape}."
            )
        return new_networks(self.weights, self.driver, self.hidden)
