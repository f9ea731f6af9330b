"""What came out when models of one system were examined, each against the same held-out motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.examination import Examined, Telling, TuringTest
from turing_learning.report import Tabular

if TYPE_CHECKING:
    import pandas as pd
    from rich.text import Text

NAMED = 3
"""Statistics by which a model is told that are listed."""


@dataclass(frozen=True)
class Compared:
    """One model, and how well it is told from the genuine motion."""

    name: str  #: Of the model
    test: TuringTest  #: Of its samples against the held-out ones
    estimate: dict[str, float]  #: Name of a parameter -> what was inferred
    #: Name -> lower and upper end; NaN where open
    interval_of_estimate: dict[str, list[float]]
    said: str  #: The verdict of its run
    path: Path | None = None  #: Of its run

    @property
    def accuracy(self) -> float:
        """Share of right answers of the panel; 0.5 is guessing."""
        return self.test.accuracy

    @property
    def interval(self) -> tuple[float, float]:
        """Of the accuracy, 95 %."""
        return self.test.examined.interval

    @property
    def verdict(self) -> str:
        """What came out: "told apart", "cannot tell" or "cannot say"."""
        return self.test.verdict

    @property
    def telling(self) -> tuple[Telling, ...]:
        """The statistics that give it away, the most telling first; none unless it is told."""
        if not self.test.examined.told_apart:
            return ()
        statistics = [telling for telling in self.test.telling if telling.kind == "statistic"]
        return tuple(statistics[:NAMED])

    @property
    def told_by(self) -> str:
        """These statistics in words, simulated against genuine."""
        return "; ".join(f"{telling.what} ({telling.words})" for telling in self.telling)


@dataclass(frozen=True, repr=False)
class Comparison(Tabular):
    """Models of one system, the one that is hardest to tell first."""

    models: tuple[Compared, ...]  #: In order of the accuracy of the panel
    #: Names of models whose runs have been stopped
    unfinished: tuple[str, ...] = ()
    path: Path | None = None  #: The folder

    @property
    def control(self) -> Examined | None:
        """One half of the held-out genuine samples against the other; None if their groups are too few."""
        for model in self.models:
            if model.test.control is not None:
                return model.test.control
        return None

    def difference(self, model: Compared) -> tuple[float, float, float]:
        """Return by how much a model is told more accurately than the first one, and a 95 % interval of that.

        The interval follows from those of both accuracies, as if these were independent. The genuine samples are the
        same, so it is rather too wide.

        Source
        ------
        G. Y. Zou, A. Donner, Construction of confidence limits about effect measures: a general approach, Statistics in
        Medicine 27 (2008), equation 5.
        """
        leader = self.models[0]
        if model is leader:
            return 0.0, 0.0, 0.0
        difference = model.accuracy - leader.accuracy
        low, high = model.interval
        first_low, first_high = leader.interval
        below = np.hypot(model.accuracy - low, first_high - leader.accuracy)
        above = np.hypot(high - model.accuracy, leader.accuracy - first_low)
        return difference, difference - float(below), difference + float(above)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, sentence by sentence."""
        if not self.models:
            return ()
        sentences = []
        for model in self.models:
            low, high = model.interval
            numbers = f"accuracy {model.accuracy:.3f}, {low:.3f} to {high:.3f}"
            if model.verdict == "told apart":
                by = "several statistics together"
                if model.telling:
                    by = f"{model.telling[0].what} ({model.telling[0].words})"
                sentences.append(
                    f"{model.name} is told from the genuine motion ({numbers}), by {by}."
                )
            elif model.verdict == "cannot tell":
                sentences.append(f"The panel cannot tell {model.name} ({numbers}).")
            else:
                sentences.append(f"The test cannot say whether {model.name} passes ({numbers}).")
        # Models are in order, the hardest to tell first
        leader = self.models[0]
        for model in self.models[1:]:
            difference, low, high = self.difference(model)
            numbers = f"difference {difference:.3f}, {low:.3f} to {high:.3f}"
            if low > 0:
                sentences.append(f"{leader.name} is harder to tell than {model.name} ({numbers}).")
            else:
                open_between = f"{leader.name} or {model.name}"
                sentences.append(f"It is open which is harder to tell, {open_between} ({numbers}).")
        if self.control is not None:
            accuracy = self.control.accuracy
            p_value = self.control.p_value
            numbers = f"accuracy {accuracy:.3f}, p = {p_value:.3f}"
            halves = "one half of the genuine groups against the other"
            sentences.append(f"Control, {halves}: {numbers}.")
        return tuple(sentences)

    def to_json(self) -> dict[str, Any]:
        """Return what the command prints with --json."""
        models = []
        for model in self.models:
            examined = model.test.examined
            difference, low, high = self.difference(model)
            models.append(
                {
                    "name": model.name,
                    "accuracy": model.accuracy,
                    "interval": list(model.interval),
                    "verdict": model.verdict,
                    "p_value": examined.p_value,
                    "auc": examined.auc,
                    "power_accuracy": examined.power_accuracy,
                    "difference": difference,
                    "difference_interval": [low, high],
                    "telling": [
                        {"what": telling.what, "accuracy": telling.accuracy, "words": telling.words}
                        for telling in model.telling
                    ],
                    "groups": list(examined.groups),
                    "grouping": examined.grouping,
                    "samples": list(examined.samples),
                    "estimate": model.estimate,
                    "run": None if model.path is None else str(model.path),
                    "run_says": model.said,
                }
            )
        control = None if self.control is None else self.control.to_json()
        return {"models": models, "control": control, "sentences": list(self.sentences)}

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each model; as comparison.csv."""
        import pandas as pd

        rows = []
        for model in self.models:
            difference, low, high = self.difference(model)
            rows.append(
                {
                    "model": model.name,
                    "accuracy": model.accuracy,
                    "low": model.interval[0],
                    "high": model.interval[1],
                    "p_value": model.test.p_value,
                    "power_accuracy": model.test.examined.power_accuracy,
                    "verdict": model.verdict,
                    "difference": difference,
                    "difference_low": low,
                    "difference_high": high,
                    "told_by": model.told_by,
                    "run_says": model.said,
                }
            )
        return pd.DataFrame(rows).set_index("model")

    def _shown(self) -> "tuple[str, list[str], list[list[str]], list[str | Text]]":
        headings = ["model", "accuracy (95 %)", "more than the first", "verdict"]
        title = f"{len(self.models)} models, the one that is hardest to tell first"
        rows = []
        for name, accuracy, difference, _, verdict, _ in ranking(self.to_json()):
            # terminals have 80 columns; the p-value is on the page
            rows.append([name, accuracy, difference, verdict])
        return title, headings, rows, [" ".join(self.sentences)]


def ranking(content: Mapping[str, Any]) -> list[list[str]]:
    """Return the cells of the table of a comparison, by what its `to_json` has or result.json holds.

    A row for each model, and one for the control: name, accuracy, how much more than the first, p-value, verdict, and what
    the run says.
    """
    rows = []
    for number, model in enumerate(content["models"]):
        gap = "-"
        if number > 0:
            gap = _with_interval(model["difference"], model["difference_interval"])
        accuracy = _with_interval(model["accuracy"], model["interval"])
        p_value = f"{model['p_value']:.3f}"
        rows.append([model["name"], accuracy, gap, p_value, model["verdict"], model["run_says"]])
    control = content["control"]
    if control is not None:
        accuracy = _with_interval(control["accuracy"], control["interval"])
        rows.append(["control", accuracy, "-", f"{control['p_value']:.3f}", "-", "-"])
    return rows


def _with_interval(value: float, interval: Sequence[float]) -> str:
    low, high = interval
    return f"{value:.3f} ({low:.3f} to {high:.3f})"
