"""What can be done to a system while it is watched."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from ..arrays import array
from ..errors import choice, integer, require

PASSIVE = ("random", "constant", "recorded")


@dataclass(frozen=True)
class Stimulus:
    """S stimuli at each time step, and who chooses them.

    Parameters
    ----------
    ranges
        Name -> (low, high) of each.
    levels
        0 for any value of the range; n for one of n evenly spaced values, both ends included.
    passive
        Empty if the classifiers choose. "random": anew in every step, uniformly; "constant": once for a trial, uniformly;
        "recorded": a row of `recorded`.
    recorded : (R, T, S)
        Series of stimuli, each as long as a trial.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    ranges: dict[str, tuple[float, float]]
    levels: int = 0
    passive: Literal["", "random", "constant", "recorded"] = ""
    recorded: tuple[tuple[tuple[float, ...], ...], ...] = ()

    def __post_init__(self) -> None:
        require(isinstance(self.ranges, dict) and self.ranges, "stimulus", "be a dict name -> (low, high)", self.ranges)
        for name, ends in self.ranges.items():
            bounds = array("stimulus", ends, "2", place=repr(name))
            require(bounds[0] < bounds[1], "stimulus", "have a low end below the high one", ends, place=repr(name))
        integer("levels", self.levels, 0)
        require(self.levels != 1, "levels", "be 0, or 2 or more", self.levels)
        if self.passive:
            choice("passive", self.passive, PASSIVE)
        given, remedy = bool(self.recorded), "One goes with the other."
        require(given == (self.passive == "recorded"), "recorded", 'be given with passive = "recorded"', given, remedy)
        if given:
            series = array("recorded", self.recorded, "R T S", S=len(self.ranges))
            outside = np.argwhere((series < self.low) | (series > self.high))
            if len(outside):
                r, t, s = (int(k) for k in outside[0])
                rule = f"be from {self.low[s]:g} to {self.high[s]:g}"
                require(False, "recorded", rule, series[r, t, s], place=f"series {r}, step {t}, {self.names[s]}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the S stimuli."""
        return tuple(self.ranges)

    @cached_property
    def low(self) -> np.ndarray:
        """Low ends (S,)."""
        return np.array([ends[0] for ends in self.ranges.values()])

    @cached_property
    def high(self) -> np.ndarray:
        """High ends (S,)."""
        return np.array([ends[1] for ends in self.ranges.values()])

    @cached_property
    def center(self) -> np.ndarray:
        """Middles (S,)."""
        return (self.low + self.high) / 2

    @property
    def outputs(self) -> int:
        """Number of outputs of a network that chooses; none where it only watches."""
        return 0 if self.passive else len(self.ranges) * (self.levels or 1)

    def of(self, outputs: np.ndarray) -> np.ndarray:
        """Return the stimuli (..., S) that outputs (..., O) from 0 to 1 choose."""
        if self.levels:
            chosen = outputs.reshape(*outputs.shape[:-1], len(self.ranges), self.levels).argmax(axis=-1)
            outputs = chosen / (self.levels - 1)
        return self.low + (self.high - self.low) * outputs

    def drawn(self, trials: int, steps: int, rng: np.random.Generator) -> np.ndarray:
        """Return the stimuli (R, T, S) of trials that are only watched; random ones where classifiers would choose."""
        if self.passive == "recorded":
            series = np.asarray(self.recorded)
            return series[rng.integers(len(series), size=trials)]
        shape = (trials, 1 if self.passive == "constant" else steps, len(self.ranges))
        shares = rng.integers(self.levels, size=shape) / (self.levels - 1) if self.levels else rng.random(shape)
        return np.broadcast_to(self.low + (self.high - self.low) * shares, (trials, steps, len(self.ranges)))
