"""What a paper says of a run in its section on methods, from the run's own settings."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from turing_learning.analysis import is_known
from turing_learning.report import short_number
from turing_learning.systems import CustomSystem

from ._folder import NETWORK, RunFolder
from ._result import Result, described_ridge

CITATION = "W. Li, M. Gauci, R. Groß: Turing learning. Swarm Intelligence 10 (2016) 211-243, doi:10.1007/s11721-016-0126-1"
_READING = {
    "fps": "at {} frames per second",
    "scale": "with {} pixels per cm",
    "resample": "resampled at {} frames per second",
    "min_confidence": "without positions of a confidence below {}",
    "every": "with one frame in {} kept",
    "split_gaps": "with identities split at gaps longer than {} s",
    "bridge": "with gaps of up to {} frames filled by straight motion",
    "smooth": "with positions averaged over {} frames",
    "tank": "with a tank of {}",
}
"""Options of a recording, and what they say of how it was read."""


def methods_text(result: Result, manifest: Mapping[str, Any]) -> str:
    """Return a paragraph: version, recording, samples and signals, models, length, estimates, verdict, citation."""
    versions = manifest.get("versions", {})
    commit = manifest.get("commit") or ""
    version = f"version {versions.get('turing-learning', 'unknown')}"
    if commit:
        version += f", commit {commit[:8]}"
    sentences = [
        f"Parameters were inferred by Turing Learning [1] with the Python package turing-learning "
        f"({version}; seed {result.seed}).",
        *_observed(result, manifest),
        _models(result, manifest),
        _estimates(result),
    ]
    if result.verdict:
        sentences.append(f"The run's verdict is: {result.verdict}.")
    if result.checked is not None:
        sentences.append(result.checked.text)
    return f"{' '.join(filter(None, sentences))} [1] {CITATION}"


def _observed(result: Result, manifest: Mapping[str, Any]) -> list[str]:
    """Return sentences on what was observed: recordings, samples and signals."""
    system = result.configuration.system
    recording = manifest.get("recording", {}).get("options", {})
    sentences = []
    files = [Path(path).name for path in recording.get("trajectories", ())]
    if files:
        read = []
        for name, words in _READING.items():
            value = recording.get(name)
            if name == "scale" and value == "unknown":
                words = "with positions in pixels, whose scale is unknown"
            elif name == "scale" and value == 1:
                words = "with positions in cm"
            if value is not None:
                read.append(words.format(_listed(value)))
        how = ", ".join(read) or "as their files say"
        sentences.append(f"Recordings ({', '.join(files)}) were read {how}.")
    units = system.signal_units
    signals = [f"{name} ({units[name]})" if name in units else name for name in system.signals]
    length = f"{system.steps} steps"
    if system.interval_s:
        length = f"{system.steps * system.interval_s:g} s ({length})"
    span = "batch" if result.configuration.run.trials else "generation"
    genuine = f"Genuine samples were observed anew in each {span}"
    if result.in_laboratory:
        genuine = f"Genuine samples are those of {_robots(result)}"
    elif not isinstance(system, CustomSystem):
        genuine = f"Genuine samples are those of the simulated system {system.title}"
    elif system.samples:
        genuine = f"{system.samples - len(system.held_out)} genuine samples were learned from"
        if system.held_out:
            genuine += f", {len(system.held_out)} held out"
    return [*sentences, f"{genuine}; each is of {length}, with the signals {', '.join(signals)}."]


def _robots(result: Result) -> str:
    """Return which robots a run in a laboratory has observed."""
    assert result.path is not None
    with suppress(OSError, ValueError):
        # The setup is only looked at: nothing that it names is executed
        setup = json.loads(RunFolder(result.path).laboratory_path.read_text(encoding="utf-8"))
        if setup.get("emulated"):
            return "emulated robots, in the rehearsal of a laboratory"
    return "robots in a laboratory"


def _listed(value: Any) -> str:
    """Return the value of an option in words."""
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _models(result: Result, manifest: Mapping[str, Any]) -> str:
    """Return a sentence on the models, their ranges, and the length of the run."""
    family = manifest.get("recording", {}).get("options", {}).get("model")
    program = manifest.get("command", {}).get("simulate_command")
    origin = "simulated"
    if family:
        origin = f"of the family {family}"
    if family == "network":
        origin = "those of a learned network"
    if result.path is not None and (result.path / NETWORK).exists():
        origin = f"those of a learned network ({NETWORK} in the folder of the run)"
    if program:
        origin = f"executed by `{program}`"
    if result.in_laboratory:
        origin = "executed by replicas, robots as well"
    ranges = []
    first = []
    for name, parameter in result.configuration.system.parameters.items():
        scale = ", logarithmic" if parameter.scale == "log" else ""
        unit = f" {parameter.unit}" if parameter.unit else ""
        if parameter.low is None or parameter.high is None:
            if parameter.initial is not None:
                low, high = parameter.initial
                first.append(f"{name} {low:g} to {high:g}{unit}{scale}")
            continue
        ranges.append(f"{name} {parameter.low:g} to {parameter.high:g}{unit}{scale}")
    sought = f", sought within {'; '.join(ranges)}" if ranges else ""
    if first:
        where = "in the middle of" if result.configuration.models.start == "middle" else "within"
        sought += f", begun {where} {'; '.join(first)}"
    done = "complete" if result.complete else "not complete"
    return f"Models were {origin}{sought}. The run of {result.length} is {done}."


def _estimates(result: Result) -> str:
    """Return sentences with all estimates and their intervals; of several solutions, those of each."""
    modes = getattr(result, "modes", ())
    if len(modes) > 1:
        solutions = []
        for number, mode in enumerate(modes, start=1):
            text = _stated(result, mode.estimate, mode.interval)
            solutions.append(f"({number}) with {mode.weight:.0%} of the draws: {text}")
        sentence = (
            f"Estimates and 90 % intervals of {len(modes)} solutions: {'. '.join(solutions)}."
        )
    else:
        text = _stated(result, result.estimate, result.interval)
        intervals = " and 90 % intervals" if " [" in text else ""
        sentence = f"Estimates{intervals}: {text}."
    unknown = getattr(result, "not_identified", ())
    if unknown:
        sentence += f" Not identified: {', '.join(unknown)}."
    ridge = getattr(result, "ridge", ())
    if ridge:
        sentence += f" {described_ridge(ridge)}"
    return sentence


def _stated(
    result: Result, estimate: Mapping[str, float], interval: Mapping[str, Sequence[float]]
) -> str:
    """Return each parameter with its value and, if it is known, its interval."""
    texts = []
    for name, value in estimate.items():
        text = f"{result.labels[name]} {short_number(value)}"
        low, high = interval[name]
        if is_known(low, high):
            text += f" [{short_number(low)}, {short_number(high)}]"
        texts.append(text)
    return "; ".join(texts)
