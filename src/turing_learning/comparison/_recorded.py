"""What models imitate that are to be compared, by the options of commands, or as their runs remember it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from turing_learning.errors import refuse, require
from turing_learning.families import Family, Network, RecordedSystem, Replicates, said_ranges
from turing_learning.runs import Result, RunFolder
from turing_learning.trajectories import SIGNALS, Trajectories, Windows

from ._compare import RUNS, Subject, suggested_ranges

SIGNALS_WITHOUT_OTHERS = ("speed", "turn")
"""Signals of an individual without others."""


def recorded_subjects(
    recordings: Sequence[Trajectories], options: Mapping[str, Any], models: Sequence[str],
    out: Path | None = None, progress: Callable[[int, int], None] | None = None, *, seed: int = 1,
) -> dict[str, Subject]:  # fmt: skip
    """Return models of recordings, all with the same windows.

    Parameters
    ----------
    recordings
        The motion, as `options` read it.
    options
        Those of commands that are given, by their names in Python, `trajectories` among them. Without `signals`, all that
        there are: those of neighbors where nobody is alone.
    models
        Names of families, or "module:name" of families or simulators. A simulator has an attribute `parameters`.
    out
        The folder of the comparison, whose run may have learned a network before.
    progress
        Called while a network learns.
    seed
        Of a network's training.

    Raises
    ------
    ValueError
        If an option or a model is refused.
    """
    if "signals" not in options:
        lonely = any(len(recording.individuals) == 1 for recording in recordings)
        options = {**options, "signals": ",".join(SIGNALS_WITHOUT_OTHERS if lonely else SIGNALS)}
    # A range is for those models that have such a parameter.
    texts = list(filter(None, options.get("range") or ()))
    stated: set[str] = set()
    subjects = {}
    for name in models:
        require(name not in subjects, "--model", "be given once for each model", repr(name))
        system = RecordedSystem({**options, "model": name})
        network = _learned_before(system, out, seed)
        windows, simulate, motion = system.opened(
            recordings=recordings, network=network, progress=progress, seed=seed
        )
        suggested = suggested_ranges(simulate, "--model", name)
        ranges = [text for text in texts if text.partition("=")[0] in suggested]
        stated.update(ranges)
        # families know which ranges fit a recording
        if isinstance(simulate, Family | Replicates):
            chosen = RecordedSystem({**system.options, "range": ranges})
            parameters, _ = chosen.parameters(simulate, motion)
        else:
            parameters = said_ranges(ranges, suggested)
        subjects[name] = Subject(windows, simulate, parameters, {"recording": system.entry})
    for text in texts:
        require(text in stated, "--range", "name a parameter of one of the models", repr(text))
    return subjects


def _learned_before(system: RecordedSystem, out: Path | None, seed: int) -> Network | None:
    """Return the network of a run that was begun before: to learn it again would take minutes."""
    if out is None:
        return None
    folder = RunFolder(out / RUNS / system.options["model"])
    # A comparison that is to be replaced may be one of other recordings.
    if not folder.is_run() or not system.same_motion(folder.recording()):
        return None
    if folder.configuration().run.seed != seed:
        return None
    return folder.network()


def run_subjects(results: Mapping[str, Result]) -> dict[str, Subject]:
    """Return what finished runs on recordings imitate, all in the signals of any of them.

    Parameters
    ----------
    results
        Name -> result of a run in a folder.

    Raises
    ------
    ValueError
        If the runs are not on the same recordings, or do not hold out the same frames.
    """
    systems: dict[str, RecordedSystem] = {}
    digests = {}
    for name, result in results.items():
        require(result.path is not None, "run", "be in a folder", name)
        remedy = "Resume it first."
        require(result.complete, "run", "be finished", "a stopped one", remedy, place=name)
        assert result.path is not None
        stored = RunFolder(result.path).recording()
        rule = "be on recordings in files, with a family of models"
        if stored is None or "model" not in stored["options"]:
            refuse("run", rule, "another one", place=name)
        systems[name] = RecordedSystem.remembered(stored)
        digests[name] = stored["sha256"]
    leader = next(iter(digests))
    for name, digest in digests.items():
        same = digest == digests[leader]
        require(same, "run", f"be on the recordings of {leader}", "others", place=name)
    measured: set[str] = set()
    for result in results.values():
        measured.update(result.configuration.system.signals)
    signals = tuple(name for name in SIGNALS if name in measured)
    subjects = {}
    for name, system in systems.items():
        result = results[name]
        assert result.path is not None
        network = RunFolder(result.path).network()
        custom = result.configuration.system
        steps = custom.steps
        windows, simulate, motion = system.opened(steps, custom.signals, network=network)
        # A panel that saw more of one model than of another would not be fair.
        if signals != windows.names:
            # Signals of neighbors need more frames, which may move a border.
            blocks = windows.blocks
            if isinstance(simulate, Network):
                simulate = replace(simulate, signals=signals)
            wider = replace(system, options={**system.options, "signals": ",".join(signals)})
            windows, opened, _ = wider.opened(steps, recordings=motion, network=network)
            if not isinstance(simulate, Network):
                simulate = opened
            remedy = "Run all with the same --signals."
            rule = "hold out the same frames in all signals of the runs"
            require(windows.blocks == blocks, "run", rule, "others", remedy, place=name)
        subjects[name] = Subject(windows, simulate)
    _require_alike({name: subject.windows for name, subject in subjects.items()})
    return subjects


def _require_alike(windows: Mapping[str, Windows]) -> None:
    """Reject windows of different lengths, or held out from different frames."""
    leader = next(iter(windows))
    for name, own_windows in windows.items():
        steps = windows[leader].held_out.shape[1]
        got = own_windows.held_out.shape[1]
        require(got == steps, "run", f"have windows of {steps} steps, as {leader}", got, place=name)
        same = own_windows.blocks == windows[leader].blocks
        rule = f"hold out what {leader} does"
        require(same, "run", rule, "other frames or recordings", place=name)
