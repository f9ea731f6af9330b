"""Robots in the loop: what a laboratory with e-pucks and an overhead camera needs, and its emulation.

The camera
    `Calibration` is a `Lens` at its place above the arena: `calibrate_lens` from views of a printed `Board`, `place_camera`
    from markers on the floor. `TriangleMarkers`, `RoundMarkers` and `ArucoMarkers` are what robots wear, each a kind of `Markers`
    that makes `Detections`. `Tracker` follows them: a `Sighting` of each image, and a `Track`, whose `speeds` are motion samples
    and whose `Fault`s say what went wrong. `compare_labels` tells which markers are missing or too many; `signed_speeds` turns
    any poses into samples. `Capture`, a `Camera`, takes images from a camera or a recorded video, and raises `CameraError` when
    there are none.
The camera that is not there
    `EmulatedCamera` renders images of robots as the camera at `overhead_camera` would take them, through `Optics`.
Time
    Whatever waits is given a `Clock`: `RealClock`, or the `VirtualClock` of an emulated laboratory, which passes while one waits.
The robots
    `open_link` opens a `Link`, a serial line or a TCP port; `EPuck` speaks with the robot at its end: it sends a `Model` and hears
    a `Signal` or `Status`; `LinkError` is raised when it no longer answers. docs/robots/protocol.md describes what is said.
The laboratory
    `load_laboratory` reads its file: a `Laboratory` is a `LaboratorySetup` and the run that it is to do. `read_setup` reads a setup
    that was kept, `refuse_without_history` a run that keeps too little. `PcProgram` goes through the states P1 to P5 in step with
    the replicas and gives an `ObservedTrial`; `LaboratorySource` makes samples of its trials (`trial_samples`), starts a generation
    again when a trial is disturbed (`Disturbance`), and tells of every `Event`; `LaboratoryError` is raised when it cannot go on.
    `Equipment` holds the doors that both use, with an `Operator` (`TerminalOperator`); `real_equipment` are real ones, and
    `laboratory_tracker` a tracker of all robots. `inspect` looks at everything before anything moves; each `Finding` is fine or
    says what to do. `rehearse` opens the doors to an emulated one; `as_emulated` leaves out what that lacks. `write_table`
    exports tracks, `refuse_taken_table` asks before.
The robots that are not there
    `EmulatedRobot` speaks the same protocol for a `Body`, and `serve_tcp` and `serve_terminal` connect it by a `RobotServer`.
The laboratory that is not there
    `EmulatedLaboratory`, by default that of the paper (`LABORATORY`), under `Conditions`: robots with their program in one arena, a
    camera, an operator, faults on demand, in virtual time. `ArenaService` serves it in real time at addresses; `obey` and `usage`
    are for whoever sits before it. `SimulatedLaboratory` gives samples of the same trials in plain simulation;
    `move_alone` lets robots go that no PC leads.

OpenCV (`pip install 'turing-learning[vision]'`) and pyserial (`[robot]`) are imported on use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._clock import Clock, RealClock, VirtualClock
    from ._errors import LaboratoryError
    from .emulation._arena import EmulatedLaboratory
    from .emulation._camera import EmulatedCamera, Optics, overhead_camera
    from .emulation._conditions import LABORATORY, Conditions
    from .emulation._console import obey, usage
    from .emulation._emulated_robot import Body, EmulatedRobot
    from .emulation._motion import move_alone
    from .emulation._rehearsal import as_emulated, rehearse
    from .emulation._robot_server import RobotServer, serve_tcp, serve_terminal
    from .emulation._service import ArenaService
    from .emulation._simulated import SimulatedLaboratory
    from .links._epuck import EPuck
    from .links._link import Link, LinkError, open_link
    from .links._messages import Model, Signal, Status
    from .program._equipment import Camera, Equipment, Operator, TerminalOperator, laboratory_tracker, real_equipment
    from .program._inspection import Finding, inspect
    from .program._laboratory_config import (
        Laboratory,
        LaboratorySetup,
        load_laboratory,
        read_setup,
        refuse_without_history,
    )
    from .program._program import Event, LaboratorySource, trial_samples
    from .program._states import Disturbance, ObservedTrial, PcProgram
    from .tracking._calibration import Board, Calibration, Lens, calibrate_lens, place_camera
    from .tracking._capture import CameraError, Capture
    from .tracking._export import refuse_taken_table, write_table
    from .tracking._markers import ArucoMarkers, Detections, Markers, RoundMarkers, TriangleMarkers
    from .tracking._motion import signed_speeds
    from .tracking._tracker import Fault, Sighting, Track, Tracker, compare_labels

__all__ = [
    "LABORATORY",
    "ArenaService",
    "ArucoMarkers",
    "Board",
    "Body",
    "Calibration",
    "Camera",
    "CameraError",
    "Capture",
    "Clock",
    "Conditions",
    "Detections",
    "Disturbance",
    "EPuck",
    "EmulatedCamera",
    "EmulatedLaboratory",
    "EmulatedRobot",
    "Equipment",
    "Event",
    "Fault",
    "Finding",
    "Laboratory",
    "LaboratoryError",
    "LaboratorySetup",
    "LaboratorySource",
    "Lens",
    "Link",
    "LinkError",
    "Markers",
    "Model",
    "ObservedTrial",
    "Operator",
    "Optics",
    "PcProgram",
    "RealClock",
    "RobotServer",
    "RoundMarkers",
    "Sighting",
    "Signal",
    "SimulatedLaboratory",
    "Status",
    "TerminalOperator",
    "Track",
    "Tracker",
    "TriangleMarkers",
    "VirtualClock",
    "as_emulated",
    "calibrate_lens",
    "compare_labels",
    "inspect",
    "laboratory_tracker",
    "load_laboratory",
    "move_alone",
    "obey",
    "open_link",
    "overhead_camera",
    "place_camera",
    "read_setup",
    "real_equipment",
    "refuse_taken_table",
    "refuse_without_history",
    "rehearse",
    "serve_tcp",
    "serve_terminal",
    "signed_speeds",
    "trial_samples",
    "usage",
    "write_table",
]

_HOMES = {
    "_clock": ("Clock", "RealClock", "VirtualClock"),
    "_errors": ("LaboratoryError",),
    "emulation._arena": ("EmulatedLaboratory",),
    "emulation._camera": ("EmulatedCamera", "Optics", "overhead_camera"),
    "emulation._conditions": ("LABORATORY", "Conditions"),
    "emulation._console": ("obey", "usage"),
    "emulation._emulated_robot": ("Body", "EmulatedRobot"),
    "emulation._motion": ("move_alone",),
    "emulation._rehearsal": ("as_emulated", "rehearse"),
    "emulation._robot_server": ("RobotServer", "serve_tcp", "serve_terminal"),
    "emulation._service": ("ArenaService",),
    "emulation._simulated": ("SimulatedLaboratory",),
    "links._epuck": ("EPuck",),
    "links._link": ("Link", "LinkError", "open_link"),
    "links._messages": ("Model", "Signal", "Status"),
    "program._equipment": (
        "Camera",
        "Equipment",
        "Operator",
        "TerminalOperator",
        "laboratory_tracker",
        "real_equipment",
    ),
    "program._inspection": ("Finding", "inspect"),
    "program._laboratory_config": (
        "Laboratory",
        "LaboratorySetup",
        "load_laboratory",
        "read_setup",
        "refuse_without_history",
    ),
    "program._program": ("Event", "LaboratorySource", "trial_samples"),
    "program._states": ("Disturbance", "ObservedTrial", "PcProgram"),
    "tracking._calibration": ("Board", "Calibration", "Lens", "calibrate_lens", "place_camera"),
    "tracking._capture": ("CameraError", "Capture"),
    "tracking._export": ("refuse_taken_table", "write_table"),
    "tracking._markers": ("ArucoMarkers", "Detections", "Markers", "RoundMarkers", "TriangleMarkers"),
    "tracking._motion": ("signed_speeds",),
    "tracking._tracker": ("Fault", "Sighting", "Track", "Tracker", "compare_labels"),
}
_LAZY = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import what needs scipy and the kernels on first use."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_LAZY[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
