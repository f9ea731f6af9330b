"""Recordings as the options of commands say that they are read."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from turing_learning.errors import RefusedError, refuse, refusing_as, require
from turing_learning.trajectories import Options, Trajectories, load_file


def read_recording(
    path: Path,
    name: str,
    options: Mapping[str, Any],
    usual: Mapping[str, Any] = MappingProxyType({}),
) -> Trajectories:
    """Open a tracker's file by those options of commands that are given; `name` is that of the argument for the file.

    Frame rate, scale and direction of y are the `usual` ones where neither the options nor the file state them. With
    the usual frame rate, `every` is the usual one, too. Gaps are filled as usual unless the options say otherwise.
    """
    otherwise = dict(usual)
    otherwise["pixels_per_cm"] = usual.get("scale")
    heading = None
    if options.get("heading") is not None:
        heading = tuple(listed(options["heading"], "heading", "two points"))
    every = options.get("every")
    fps = options.get("fps")
    try:
        with refusing_as(RefusedError):
            how = Options(
                fps=fps,
                pixels_per_cm=options.get("scale"),
                y_axis=options.get("y_axis"),
                keypoint=options.get("keypoint"),
                min_confidence=options.get("min_confidence"),
                columns=_columns(options.get("column", ())),
                heading=heading,  # type: ignore[arg-type]
                resample=options.get("resample"),
                project=bool(options.get("project")),
            )
            recording = load_file(path, how, options.get("format"), otherwise)
            # A file with a frame rate of its own has its own steps.
            if every is None and fps is None and recording.fps == usual.get("fps"):
                every = usual.get("every")
            if every is not None:
                rule = f"be a multiple of {recording.every}, as only one frame in so many is there"
                # What is below 1 is refused where frames are left out.
                fits = every < 1 or every % recording.every == 0
                require(fits, "every", rule, str(every), place=str(path))
                recording = recording.thinned(every)
            if options.get("split_gaps") is not None:
                recording = recording.split(options["split_gaps"])
            bridge = options.get("bridge", usual.get("bridge"))
            if bridge is not None:
                # Gaps are filled from positions that can be true; long rests are for those who cut windows.
                recording = recording.cleared(longest_rest_s=None).bridged(bridge)
            return recording
    except RefusedError as error:
        if error.refusal is None or error.refusal.name != "path":
            raise
        raise RefusedError(replace(error.refusal, name=name)) from error
    except OSError as error:
        refuse(name, "be a readable file", f"{path} ({error.strerror or error})")
    except ImportError as error:
        raise RefusedError(str(error)) from error


def _columns(texts: Sequence[str]) -> dict[str, str]:
    """Return which columns of a table are what, by texts as id=track."""
    columns: dict[str, str] = {}
    for text in texts:
        role, equals, name = text.partition("=")
        fits = equals and name and role not in columns
        require(fits, "columns", "be WHAT=NAME, once for each", repr(text))
        columns[role] = name
    return columns


def listed(text: str | None, option: str, items: str) -> list[str]:
    """Return the parts of a text between commas."""
    if text is None:
        return []
    entries = [entry.strip() for entry in text.split(",")]
    rule = f"be {items}, separated by commas"
    require("" not in entries, option, rule, f"{text!r}, where one is empty")
    return entries
