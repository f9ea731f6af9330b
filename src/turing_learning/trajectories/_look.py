"""A recording as it was read: facts, doubts and pictures, before anything is learned from it."""

from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.figures import Picture
from turing_learning.figures.recordings import distribution_figure, presence_figure, tracks_figure
from turing_learning.report import Report, report_page, write_page

from ._recording import Problems, thinning
from ._signals import SIGNALS

if TYPE_CHECKING:
    from ._trajectories import Trajectories

USUAL_WINDOW_S = 4.0
"""Length of the windows of a run on recordings where nothing else is said."""
SHORT_GAP_S = 0.25
"""Longest gap that straight motion may fill."""
WORTH_FILLING = 0.1
"""Share of the positions that filled gaps bring into stretches as long as windows, from which on that is proposed."""
NOTHING_ODD = "Nothing odd was found. Compare the facts with what you know of the experiment."


@dataclass(frozen=True, eq=False)
class Look:
    """How a recording was read, what is odd about it, and pictures of it.

    It prints as text and shows as a page in notebooks.
    """

    recording: "Trajectories"

    @cached_property
    def problems(self) -> Problems:
        """What `Trajectories.check` finds."""
        return self.recording.check()

    @property
    def doubts(self) -> tuple[str, ...]:
        """What may be meant otherwise than it was read, or can hardly be true; a sentence each."""
        doubts = (*self.problems.doubts, *self.problems.headings)
        every = self.problems.every
        if every > 1:
            thin = f"only one frame in {every} is there: keep those, by {thinning(every)}"
            return (thin, *doubts)
        return (*doubts, *self._gaps_to_fill)

    @property
    def _gaps_to_fill(self) -> tuple[str, ...]:
        """What to fill where short gaps leave few stretches in which windows have place; empty otherwise."""
        recording = self._likely
        fps = recording.fps
        length = round(USUAL_WINDOW_S * fps) + 2
        share = _in_stretches(recording.present, length)
        shares = {}
        for gap in range(1, round(SHORT_GAP_S * fps) + 1):
            shares[gap] = _in_stretches(recording.bridged(gap).present, length)
        largest_share = max(shares.values(), default=0.0)
        if largest_share - share < WORTH_FILLING:
            return ()
        gap = next(gap for gap in shares if shares[gap] >= 0.95 * largest_share)
        cut = f"gaps leave {share:.0%} of the positions in stretches of {USUAL_WINDOW_S:g} s, as long as a run's windows"
        fill = f"with those of up to {gap} frames filled, by `bridged({gap})` or --bridge {gap}, it is {shares[gap]:.0%}"
        return (f"{cut}: {fill}",)

    @cached_property
    def facts(self) -> dict[str, str]:
        """Name -> value in words, in the order in which a reader asks for them."""
        recording = self.recording
        reading = recording.reading
        facts = {"file": recording.source, "format": recording.format}
        facts["read from"] = ", ".join(f"{role} = {name}" for role, name in reading.columns.items())
        facts["not read"] = ", ".join(reading.unread)
        facts["frame rate"] = ", ".join(
            filter(None, (f"{recording.fps:g} per second", reading.fps))
        )
        facts["scale"] = reading.scale
        facts["y points"] = reading.y_axis
        frames, count = recording.present.shape
        facts["individuals"] = (
            f"{count}, at most {recording.at_once} at once: {_listed(recording.individuals)}"
        )
        facts["frames"] = (
            f"{frames}, {recording.first_frame} to {recording.first_frame + frames - 1}"
        )
        facts["duration"] = f"{recording.duration_s:.4g} s"
        facts["missing"] = self.problems.described_gaps
        facts["jumps"] = self.problems.described_jumps
        for name, values in self._signals.items():
            # Rounded, so that a rest is 0 and not 1e-17.
            low, median, high = np.round(np.percentile(values, [5, 50, 95]), 6)
            facts[name] = (
                f"median {median:.3g} {self._units[name]}, 90 % from {low:.3g} to {high:.3g}"
            )
        (left, bottom), (right, top) = self._likely.reach
        unit = recording.unit
        facts["tank of the models"] = (
            f"{right - left:.4g} x {top - bottom:.4g} {unit}, where signals of neighbors count"
        )
        return {name: value for name, value in facts.items() if value}

    @cached_property
    def _likely(self) -> "Trajectories":
        return self.recording.cleared()

    @property
    def _units(self) -> dict[str, str]:
        units = dict(SIGNALS)
        if self.recording.unit != "cm":
            units = {name: unit.replace("cm", "px") for name, unit in units.items()}
        return units

    @cached_property
    def _signals(self) -> dict[str, np.ndarray]:
        """Return the values (N,) of speed and turn that exist, by name."""
        signals = self._likely.signals(("speed", "turn"))
        values_by_signal = {}
        for column, name in enumerate(("speed", "turn")):
            values = signals.values[..., column][signals.valid]
            if len(values):
                values_by_signal[name] = values
        return values_by_signal

    def __str__(self) -> str:
        widest = max(map(len, self.facts))
        lines = [f"{name:{widest}}  {value}" for name, value in self.facts.items()]
        odd = [f"! {doubt}" for doubt in self.doubts] or [NOTHING_ODD]
        return "\n".join([*lines, "", *odd, *self.recording.remarks])

    def _repr_html_(self) -> str:
        left = "style='text-align:left'"
        html = "<table>"
        for name, value in self.facts.items():
            html += f"<tr><th {left}>{escape(name)}</th><td {left}>{escape(value)}</td></tr>"
        html += "</table><ul>"
        for doubt in self.doubts or (NOTHING_ODD,):
            html += f"<li>{escape(doubt)}</li>"
        html += "</ul>"
        for picture in self.pictures():
            html += picture.svg
        return html

    def pictures(self) -> list[Picture]:
        """Return figures of tracks, presence over time, and distributions of speed and turn."""
        recording = self.recording
        names = recording.individuals
        # What windows leave out is drawn apart from the tracks
        unlikely = recording.present & ~self._likely.present
        absent = ~self._likely.present[..., None]
        likely = np.where(absent, np.nan, recording.positions)
        caption = (
            "Each individual in a color; dashed, the tank of the models, as far as positions reach."
        )
        tracks = tracks_figure(
            names,
            likely,
            self._likely.reach,
            unlikely=recording.positions[unlikely],
            unit=recording.unit,
        )
        jumps = []
        for jump in self.problems.jumps:
            time_s = (jump.frame - recording.first_frame) / recording.fps
            jumps.append((names.index(jump.individual), time_s))
        when = "A bar where an individual has positions that can be true; a mark where it jumps."
        presence = presence_figure(names, self._likely.present, jumps, recording.fps)
        pictures = [
            Picture("tracks", "Tracks", caption, tracks),
            Picture("presence", "Who is there when", when, presence, wide=True),
        ]
        for name, values in self._signals.items():
            figure = distribution_figure(values, f"{name} ({self._units[name]})")
            caption = "Of all steps between neighboring frames, without smoothing."
            pictures.append(Picture(name, name.capitalize(), caption, figure))
        return pictures

    def page(self) -> str:
        """Return a page (HTML) that works offline."""
        name = Path(self.recording.source).name or "recording"
        report = Report(
            title=f"{name}: as it was read",
            summary=str(self.recording) if self.doubts else f"{self.recording}. {NOTHING_ODD}",
            listings=[],
            figures=self.pictures(),
            facts=list(self.facts.items()),
            doubts=self.doubts,
        )
        return report_page(report)

    def save(self, path: str | Path) -> Path:
        """Write the page to a file in an existing folder; one that exists is replaced."""
        return write_page(self.page(), path)


MOST_LISTED = 8
"""Names of individuals that are listed."""


def _listed(names: tuple[str, ...]) -> str:
    """Return names with commas, of many the first ones."""
    ellipsis = ", ..." if len(names) > MOST_LISTED else ""
    return ", ".join(names[:MOST_LISTED]) + ellipsis


def _in_stretches(present: np.ndarray, length: int) -> float:
    """Return the share of positions (F, A) that are there in stretches of at least so many frames."""
    inside = 0
    for column in present.T:
        edges = np.flatnonzero(np.diff(column.astype(np.int8), prepend=0, append=0))
        lengths = edges[1::2] - edges[::2]
        inside += int(lengths[lengths >= length].sum())
    return inside / max(1, int(present.sum()))
