"""Runs that commands open, with the motion and the simulator that they began with."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import turing_learning as tl
from turing_learning.errors import refuse

from ._command import remembered_program
from ._options import Recording


def opened(run: Path) -> "tl.Result":
    """Open a run; messages name its folder as it was given."""
    return replace(tl.runs.load_run(run), path=tl.runs.RunFolder(run).path)


def system_of(run: Path, recording: Recording, call: str) -> dict[str, Any]:
    """Return genuine motion, simulator and recordings of a run on recorded motion, nothing for others.

    A run whose simulator only Python has is rejected; `call` is what Python does with it.
    """
    folder = tl.runs.RunFolder(run)
    system = folder.configuration().system
    program = remembered_program(run)
    if program:
        rule = "be left out for a run on a program, which needs nothing but its folder"
        recording.refuse_beside(rule)
        return program
    if folder.needs_python(system):
        rule = "be on recorded motion, or have samples and a simulator that can be imported"
        got = f"{system.name!r}, to which Python gave them"
        remedy = f"In Python call turing_learning.{call.format(run=repr(str(run)))}."
        refuse("run", rule, got, remedy, place=str(run))
    recording = recording.remembered(run)
    if not recording.given:
        return {}
    if not system.resuming:
        rule = "be left out for a run on simulated robots, which needs nothing but its folder"
        recording.refuse_beside(rule)
    by_function = "simulate" in folder.known_parts()
    # a network is that of the run: to learn it again would take minutes
    windows, family, motion = recording.motion(own=by_function).opened(
        system.steps, system.signals, network=folder.network()
    )
    opened_system = {"genuine": windows, "simulate": family, "recording": motion}
    if family is None:
        # the run names it
        del opened_system["simulate"]
    return opened_system
