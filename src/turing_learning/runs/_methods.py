"""What a paper says of a run in its section on methods, from the run's own settings."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from turing_learning.analysis import is_known
from turing_learning.report import short_number
from turing_learning.systems import CustomSystem

from ._result import Result

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
            if recording.get(name) is not None:
                read.append(words.format(_listed(recording[name])))
        how = ", ".join(read) or "as their files say"
        sentences.append(f"Recordings ({', '.join(files)}) were read {how}.")
    if not isinstance(system, CustomSystem):
        title = result.configuration.scenario.title
        return [f"Genuine samples are those of the simulated system {title}."]
    units = system.signal_units
    signals = [f"{name} ({units[name]})" if name in units else name for name in system.signals]
    length = f"{system.steps} steps"
    if system.interval_s:
        length = f"{system.steps * system.interval_s:g} s ({length})"
    genuine = "Genuine samples were observed anew in each batch"
    if system.samples:
        genuine = f"{system.samples - len(system.held_out)} genuine samples were learned from"
        if system.held_out:
            genuine += f", {len(system.held_out)} held out"
    return [*sentences, f"{genuine}; each is of {length}, with the signals {', '.join(signals)}."]


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
    if program:
        origin = f"executed by `{program}`"
    ranges = []
    for name, parameter in result.configuration.system.parameters.items():
        if parameter.low is None or parameter.high is None:
            continue
        scale = ", logarithmic" if parameter.scale == "log" else ""
        unit = f" {parameter.unit}" if parameter.unit else ""
        ranges.append(f"{name} {parameter.low:g} to {parameter.high:g}{unit}{scale}")
    sought = f", sought within {'; '.join(ranges)}" if ranges else ""
    done = "complete" if result.complete else "not complete"
    return f"Models were {origin}{sought}. The run of {result.length} is {done}."


def _estimates(result: Result) -> str:
    """Return a sentence with all estimates and their intervals."""
    texts = []
    for name, value in result.estimate.items():
        text = f"{result.labels[name]} {short_number(value)}"
        low, high = result.interval[name]
        if is_known(low, high):
            text += f" [{short_number(low)}, {short_number(high)}]"
        texts.append(text)
    intervals = " and 90 % intervals" if any("[" in text for text in texts) else ""
    unknown = getattr(result, "not_identified", ())
    sentence = f"Estimates{intervals}: {'; '.join(texts)}."
    if unknown:
        sentence += f" Not identified: {', '.join(unknown)}."
    return sentence
