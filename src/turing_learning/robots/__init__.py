"""Robots in the loop: what a laboratory with e-pucks and an overhead camera needs, and its emulation.

Camera
    A `Calibration` is a `Lens` at its place above the arena: `calibrate_lens` from views of a printed `Board`,
    `place_camera` from markers on the floor. Robots wear `Markers`: `TriangleMarkers`, `RoundMarkers` or
    `ArucoMarkers`. A `Tracker` turns images into a `Track`, whose `speeds` are motion samples and whose
    `Fault`s say what went wrong; `compare_labels` says which markers are in sight. `Capture` opens a video,
    `LiveCapture` a camera, whose images it stamps; others are a `Camera`, which may raise `CameraError`.
Robots
    A `Replica` takes a `Model`, says its `Status` and each `Signal`. An `EPuck` is one, over a `Link`, a serial
    line or a TCP port that `open_link` opens (docs/robots/protocol.md), or a `LinkError` says why not; others
    are yours (docs/robots/any-robot.md). `live` is the program of a robot with a `RobotBody`.
Laboratory
    `load_laboratory` reads a file: a `Laboratory` is a `LaboratorySetup` and the configuration of its run, or a
    `LaboratoryError`. `LaboratorySource` goes through the states P1 to P5 in step with the replicas, makes
    samples of trials, repeats those that were disturbed, and reports every `Event`. It uses an `Equipment`,
    whose `PoseSource` says where everybody is (`CameraPoses`, by default): `real_equipment`, or that of
    `rehearse` for a laboratory `as_emulated`. `inspect` looks at everything before anything moves;
    `require_libraries` names the extras that are missing.
Emulation
    `EmulatedLaboratory` has robots, an arena, a camera (`EmulatedCamera` with `Optics`, at the place of an
    `overhead_camera`), an operator and faults on demand, by a `Clock` in virtual time, under `Conditions`;
    `ArenaService` serves it in real time. `LABORATORY` is the paper's. `supervise` puts robots into a `Simulator`.

The rooms inside, `tracking`, `program` and `emulation`, export what runs and commands need besides.

OpenCV (`pip install 'turing-learning[vision]'`) and pyserial (`[robot]`) are imported on use. Names are listed
in ``__init__.pyi`` and imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
