"""What the classifiers say about the samples."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

THRESHOLD = 0.5
"""From this output on, a sample is judged genuine (paper, section 3.2.3)."""


@dataclass(frozen=True, eq=False)
class Judgments:
    """The outputs of N classifiers for all samples of a generation.

    Attributes
    ----------
    genuine_outputs : (N, K)
        Outputs for the K genuine samples, from 0 (counterfeit) to 1 (genuine).
    counterfeit_outputs : (N, M, C)
        Outputs for C samples of each of the M models.
    referee_outputs : (B, M, C)
        Outputs of B archived classifiers for samples of the models. None means no referees.
    referee_specificity : (B,)
        Share of genuine samples that each archived classifier judged genuine in its own generation; None without referees.
    met, referees_met : (N, M) and (B, M) bool
        Which models each has met; its other outputs are 0 and do not count. None means all.

    Raises
    ------
    ValueError
        If a shape is wrong or empty, the two disagree in N, or an output is NaN or not within 0 and 1.
    """

    genuine_outputs: np.ndarray
    counterfeit_outputs: np.ndarray
    referee_outputs: np.ndarray | None = None
    referee_specificity: np.ndarray | None = None
    met: np.ndarray | None = None
    referees_met: np.ndarray | None = None

    def __post_init__(self) -> None:
        _check("genuine_outputs", self.genuine_outputs, "(N, K)", 2)
        _check("counterfeit_outputs", self.counterfeit_outputs, "(N, M, C)", 3)
        if self.referee_outputs is not None:
            _check_referees(self.referee_outputs, self.counterfeit_outputs.shape[1:])
        for name, met, outputs in (
            ("met", self.met, self.counterfeit_outputs),
            ("referees_met", self.referees_met, self.referee_outputs),
        ):
            if met is not None and (outputs is None or met.shape != outputs.shape[:2] or met.dtype != bool):
                raise ValueError(f"`{name}` must be truth values (N, M), one for each output; got shape {met.shape}.")
        if self.met is not None and not self.met.any(axis=0).all():
            raise ValueError("`met` must hold a classifier for each model; got a model that none has met.")
        if len(self.genuine_outputs) != len(self.counterfeit_outputs):
            raise ValueError(
                "`genuine_outputs` and `counterfeit_outputs` must agree in the number of classifiers N; "
                f"got {self.genuine_outputs.shape} and {self.counterfeit_outputs.shape}."
            )

    @cached_property
    def genuine(self) -> np.ndarray:
        """Whether each classifier judges each genuine sample genuine, as it should; (N, K) bool."""
        return self.genuine_outputs >= THRESHOLD

    @cached_property
    def counterfeit(self) -> np.ndarray:
        """Whether each classifier is misled: judges a model's sample genuine; (N, M, C) bool, m_ij in the paper."""
        return self.counterfeit_outputs >= THRESHOLD

    @cached_property
    def refereed(self) -> np.ndarray | None:
        """Whether each archived classifier judges a model's sample genuine; (B, M, C) bool, None without referees."""
        return None if self.referee_outputs is None else self.referee_outputs >= THRESHOLD

    @property
    def selection(self) -> str:
        """Whether the models are under selection.

        "all accepted" if every classifier accepts every model, "all rejected" if every classifier rejects every
        model, "active" otherwise. In the first two, all models are equally fit.
        """
        if (self.counterfeit if self.met is None else self.counterfeit[self.met]).all():
            return "all accepted"
        return "active" if self.counterfeit.any() else "all rejected"


def _check(name: str, outputs: np.ndarray, symbols: str, dimensions: int) -> None:
    if outputs.ndim != dimensions or outputs.size == 0:
        raise ValueError(f"`{name}` must be of shape {symbols} and not empty; got {outputs.shape}.")
    if not (outputs.min() >= 0 and outputs.max() <= 1):  # so that NaN, too, is refused
        place = tuple(int(k) for k in np.argwhere(~((outputs >= 0) & (outputs <= 1)))[0])
        raise ValueError(f"`{name}` must be from 0 to 1; got {outputs[place]} at {place} of {symbols}.")


def _check_referees(outputs: np.ndarray, samples: tuple[int, ...]) -> None:
    _check("referee_outputs", outputs, "(B, M, C)", 3)
    if outputs.shape[1:] != samples:
        raise ValueError(
            f"`referee_outputs` must be of shape (B, M, C) = (any, {samples[0]}, {samples[1]}); got {outputs.shape}."
        )
