"""Which preset and which model of a run a verdict is about."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from turing_learning.studies import StudyResult

PRESETS = ("default", "paper")
"""The first one decides; the other stands beside it."""
KINDS = {"best_model": "absolute_error", "estimate": "estimate_absolute_error"}
"""What a run infers, and its errors in the result of the run; the first one is the paper's rule, and decides."""


def variant_of(preset: str, kind: str = "best_model") -> str:
    """Return what a verdict is about; nothing for the one that counts."""
    parts = [] if preset == PRESETS[0] else [f"preset {preset}"]
    return ", ".join([*parts, *([] if kind == "best_model" else [kind])])


def values_of(result: "StudyResult", name: str) -> np.ndarray:
    """Return what each run of a study has under a name, parameter by parameter (R, P)."""
    return np.array([list(run.result[name].values()) for run in result.runs if run.result is not None])
