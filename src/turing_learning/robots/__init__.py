"""Robots in the loop: what a laboratory with e-pucks and an overhead camera needs, and its emulation.

Camera
    A `Calibration` is a `Lens` at its place above the arena: `calibrate_lens` from views of a printed `Board`, `place_camera`
    from markers on the floor. Robots wear `Markers`: `TriangleMarkers`, `RoundMarkers` or `ArucoMarkers`, found in images as
    `Detections`. A `Tracker` turns images (`Sighting`) into a `Track`, whose `speeds` are motion samples and whose `Fault`s
    say what went wrong. `Capture` opens a video, `LiveCapture` a `Camera`, whose images it stamps.
Robots
    A `Replica` takes a `Model`, says its `Status` and each `Signal`. An `EPuck` is one, over a `Link`, a serial line or a TCP
    port that `open_link` opens (docs/robots/protocol.md); others are yours (docs/robots/any-robot.md). `live` is the program of
    a robot with a `RobotBody`.
Laboratory
    `load_laboratory` reads a file: a `Laboratory` is a `LaboratorySetup` and the configuration of its run. `PcProgram` goes
    through the states P1 to P5 in step with the replicas and returns each `ObservedTrial`; `LaboratorySource` makes samples of
    them, repeats a trial after a `Disturbance`, and reports every `Event`. Both use an `Equipment`, whose `PoseSource` says where
    everybody is (`CameraPoses`, by default): the `real_equipment` with an `Operator`, or that of `rehearse`. `inspect` looks at
    everything before anything moves.
Emulation
    `EmulatedLaboratory` has robots (`EmulatedRobot`), an arena, a camera (`EmulatedCamera`), an operator and faults on demand,
    in virtual time (`VirtualClock`), under `Conditions`; `ArenaService` serves it in real time. `SimulatedLaboratory` gives
    samples of the same trials in plain simulation.
Details
    Camera: `Optics`, `overhead_camera`, `compare_labels`, `signed_speeds`, `write_table`, `refuse_taken`, `CameraError`.
    Laboratory: `LABORATORY`, `read_setup`, `laboratory_tracker`, `laboratory_calibration`, `trial_samples`, `TerminalOperator`,
    `Finding` (of `inspect`), `refuse_without_history`, `LaboratoryError`, `LinkError`. Time: `Clock`, `RealClock`.
    Emulation: `as_emulated`, `Body`, `RobotServer`, `serve_tcp`, `serve_terminal`, `obey` and `usage` of what may be typed,
    `move_alone` without a PC.

OpenCV (`pip install 'turing-learning[vision]'`) and pyserial (`[robot]`) are imported on use. Names are listed in
``__init__.pyi`` and imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
