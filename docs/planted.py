"""Measure and draw the example of docs/detection.md: abnormal fish planted into recordings.

Run with ``python docs/planted.py``; it takes the example from the page.
"""

import contextlib
import io
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.detection import recorded_motion, run_classifiers
from turing_learning.figures import save_figure, timeline_figure

DOCS = Path(__file__).parent
TRIALS, SEEDS = range(100, 140), range(11, 19)
SHORT = {"record(seed=1)": "record(seed=1, frames=1500)", "generations=300": "generations=60"}


def main() -> None:
    """Print rates over trials of ten fish, two of them planted, for the example and further runs; draw the trial of the example."""
    names = execute()
    draw(names)
    trials = [names["record"](seed, planted=2) for seed in TRIALS]
    report("the example", [names], trials)
    report("further seeds", [execute(seed) for seed in SEEDS], trials[:20])
    report("further seeds, half the recording, 60 generations", [execute(seed, SHORT) for seed in SEEDS], trials[:20])


def execute(seed: int = 1, changes: dict[str, str] | None = None) -> dict[str, Any]:
    """Return the names of the page's example, with another seed of the recording and the run, and with changes of its text."""
    page = (DOCS / "detection.md").read_text(encoding="utf-8")
    block = next(block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "def record" in block)
    for old, new in (changes or {}).items():
        if old not in block:
            raise ValueError(f"The example must hold {old!r}.")
        block = block.replace(old, new)
    names: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()):
        exec(block.replace("seed=1", f"seed={seed}"), names)  # noqa: S102 - our own page
        names["learned"] = run_classifiers(names["result"])
    return names


def report(title: str, runs: list[dict[str, Any]], trials: list[Any]) -> None:
    """Print means over runs, and the least and the most that one run has."""
    print(f"{title}; {len(runs[0]['detector'].genuine_scores)} held-out windows")  # noqa: T201
    for share in (0.01, 0.05):
        rates = np.array([measured(names, share, trials) for names in runs])
        columns = zip(rates.mean(axis=0), rates.min(axis=0), rates.max(axis=0), strict=True)
        texts = [f"{mean:.4f} ({least:.4f} to {most:.4f})" for mean, least, most in columns]
        print(  # noqa: T201
            f"  false alarms set to {share}: planted fish detected {texts[0]}, normal fish called abnormal {texts[1]}, "
            f"windows of planted fish flagged after the change {texts[2]}, before it {texts[3]}"
        )


def measured(names: dict[str, Any], share: float, trials: list[Any]) -> list[float]:
    """Return the rates of a run over all trials: detections, false alarms, windows flagged after the change, and before it."""
    detector = names["detector"].with_false_alarms(share)
    rates = [found(detector, recorded_motion(trial, names["learned"])) for trial in trials]
    return [float(np.mean(np.concatenate(column))) for column in zip(*rates, strict=True)]


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
