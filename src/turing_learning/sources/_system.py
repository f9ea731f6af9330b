"""A system of one's own as frozen data: all that a run stores of it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from ..models import Parameter

TIME_STEP_TOLERANCE = 0.01  # share by which time steps may differ that are held to be the same

_NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")


def same_time_step(one_s: float, other_s: float) -> bool:
    """Return whether two time steps (s), the second above 0, are held to be the same."""
    return abs(one_s / other_s - 1) <= TIME_STEP_TOLERANCE


@dataclass(frozen=True)
class OwnSystem:
    """A system that was observed, and how models of it are simulated.

    Parameters
    ----------
    name, title
        A word for folders, and what stands above the report.
    parameters
        Name -> parameter, in the order of the simulator's columns; P >= 1. Names are of letters, digits, _ and -.
    signals
        Names of the D signals per step.
    steps
        Time steps of a sample, T.
    center, input_scale : (D,)
        The classifiers see (signal - center) / input_scale: median, and 99th percentile of the distance from it, of
        the genuine data; see `read_genuine`.
    samples
        Number of genuine samples; 0 if they come from a live source.
    samples_per_generation
        How many of them the classifiers judge in a generation, drawn anew each time; 0 for as many as there are models.
    held_out
        Which samples (from 0) are never learned from.
    batches
        Number of calls of a vectorized simulator in a generation; the models are split evenly. 0 if it takes one model.
    digest
        SHA-256 of the genuine data; empty for a live source.
    interval_s
        Duration of a time step (s); 0 if it is not known.
    headings
        Whether the signals are measured "with" headings or "without"; empty if that is not known, or makes no difference to them.

    Raises
    ------
    ValueError
        If a field breaks its rule.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    name: str
    title: str
    parameters: dict[str, Parameter]
    signals: tuple[str, ...]
    steps: int
    center: tuple[float, ...]
    input_scale: tuple[float, ...]
    samples: int
    samples_per_generation: int
    held_out: tuple[int, ...] = ()
    batches: int = 1
    digest: str = ""
    interval_s: float = 0.0
    headings: Literal["", "with", "without"] = ""

    def __post_init__(self) -> None:
        _check_name("name", self.name)
        if not isinstance(self.parameters, Mapping) or not self.parameters:
            raise ValueError(f"`parameters` must name one parameter or more; got {self.parameters!r}.")
        for name in self.parameters:
            _check_name("parameters", name)
        if not len(self.signals) == len(self.center) == len(self.input_scale) > 0:
            raise ValueError(
                "`signals` must be as many names as the data has signals, one or more; "
                f"got {len(self.signals)} names of {len(self.center)} signals."
            )
        if len(set(self.signals)) < len(self.signals):
            raise ValueError(f"`signals` must have different names; got {', '.join(self.signals)}.")
        for name, least in (("steps", 1), ("samples", 0), ("samples_per_generation", 0), ("batches", 0)):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < least:
                raise ValueError(f"`{name}` must be an integer of at least {least}; got {value!r}.")
        if not self.interval_s >= 0:
            raise ValueError(f"`interval_s` must be at least 0; got {self.interval_s!r}.")
        if self.headings not in ("", "with", "without"):
            raise ValueError(f'`headings` must be "with", "without" or empty; got {self.headings!r}.')

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the model parameters."""
        return tuple(self.parameters)

    @property
    def parameter_labels(self) -> tuple[str, ...]:
        """Names of the model parameters, with units where they have any, for figures."""
        pairs = self.parameters.items()
        return tuple(f"{name} ({parameter.unit})" if parameter.unit else name for name, parameter in pairs)

    @property
    def truth(self) -> None:
        """The true parameters, as those of a scenario's agents: unknown."""
        return

    @property
    def live(self) -> bool:
        """Whether the genuine samples are observed anew in every generation."""
        return self.samples == 0

    @property
    def vectorized(self) -> bool:
        """Whether the simulator takes several models at once."""
        return self.batches > 0

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the parameters (M, P) in their users' units of models (M, P) as the optimizer has them."""
        return np.column_stack(
            [parameter.to_units(column) for parameter, column in zip(self.parameters.values(), models.T, strict=True)]
        )

    def centered(self, samples: np.ndarray) -> np.ndarray:
        """Return samples (..., T, D) as the classifiers see them before their inputs are divided by the scale."""
        return samples - np.asarray(self.center)

    def shown(self, values: np.ndarray) -> str:
        """Return one model's parameters (P,) as text, by name, with units."""
        return ", ".join(
            f"{name} = {value:.6g}{' ' + parameter.unit if parameter.unit else ''}"
            for (name, parameter), value in zip(self.parameters.items(), values, strict=True)
        )


def _check_name(field: str, name: object) -> None:
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ValueError(
            f"`{field}` must have names of 1 to 60 letters, digits, _ and -; got {name!r}. Give the unit to `Parameter`."
            if field == "parameters"
            else f"`{field}` must be of 1 to 60 letters, digits, _ and -; got {name!r}."
        )
