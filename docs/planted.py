"""Measure and draw the example of docs/detection.md: abnormal fish planted into recordings.

Run with ``python docs/planted.py``; it takes the example from the page.
"""

import os
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.detection import recorded_motion, run_classifiers
from turing_learning.figures import save_figure, timeline_figure

DOCS = Path(__file__).parent
TRIALS = range(100, 140)


def main() -> None:
    """Print rates over trials of ten fish, two of them planted, and draw the trial of the example."""
    page = (DOCS / "detection.md").read_text(encoding="utf-8")
    block = next(block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "def record" in block)
    names: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        exec(block, names)  # noqa: S102 - our own page
        learned = run_classifiers(names["result"])
    draw(names)
    for share in (0.01, 0.05):
        detector = names["detector"].with_false_alarms(share)
        rates = [found(detector, recorded_motion(names["record"](seed, planted=2), learned)) for seed in TRIALS]
        detected, alarms, late, early = (np.concatenate(column) for column in zip(*rates, strict=True))
        print(  # noqa: T201
            f"false alarms set to {share}: detected {detected.mean():.3f} of {len(detected)} planted fish, "
            f"{late.mean():.3f} of their windows after the change flagged, {early.mean():.3f} before it; "
            f"false alarms {alarms.mean():.4f} of {len(alarms)}"
        )


def found(detector: Any, trial: Any) -> tuple[list[bool], list[bool], list[float], list[float]]:
    """Return what is said of planted and of normal fish, and the share of windows of planted ones flagged after and before."""
    verdicts = detector.timeline(trial)
    planted, half = verdicts[-2:], trial.duration_s / 2
    return (
        [verdict.abnormal for verdict in planted],
        [verdict.abnormal for verdict in verdicts[:-2]],
        [float(verdict.flagged[verdict.times[:, 0] >= half].mean()) for verdict in planted],
        [float(verdict.flagged[verdict.times[:, 1] <= half].mean()) for verdict in planted],
    )


def draw(names: dict[str, Any]) -> None:
    """Draw the timeline of the example's trial."""
    verdicts = names["detector"].timeline(names["trial"])
    figure = timeline_figure(
        [verdict.individual for verdict in verdicts],
        [verdict.times for verdict in verdicts],
        [verdict.scores for verdict in verdicts],
        [verdict.flagged for verdict in verdicts],
        limit=names["trial"].duration_s,
    )
    png, svg = save_figure(figure, DOCS / "images", "planted")
    svg.unlink()
    print(png)  # noqa: T201


if __name__ == "__main__":
    main()
