"""Which carried and turned robots are noticed, and how robots move that are not: `python experiments/laboratory/carried.py FOLDER`.

Trials of the paper's laboratory in virtual time, with random models. The camera gives the poses themselves, to which errors
are added that the tracker makes in rendered images of 20 such trials. First undisturbed trials: carried-clean.csv has how
far robots were seen to move beyond what wheels can do, between two images, and how many trials would be refused. Then one
robot is carried or turned in each trial, at a random moment, in a random direction, to a place that is free: carried.csv has
the share that was noticed, and what the others put into one of the 50 values of their sample, and into its mean speed. Takes
half an hour; trials in FOLDER are kept.
"""

import argparse
import csv
import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from faults import write_laboratory
from runs_with_faults import Poses

from turing_learning.robots import (
    ArucoMarkers,
    EmulatedCamera,
    EmulatedLaboratory,
    EPuck,
    Equipment,
    Tracker,
    TriangleMarkers,
    load_laboratory,
    overhead_camera,
)
from turing_learning.robots.program import ObservedTrial
from turing_learning.robots.program._equipment import fastest_turn
from turing_learning.robots.program._source import Disturbance, PcProgram
from turing_learning.robots.tracking import signed_speeds
from turing_learning.robots.tracking._tracker import Track, impossible, wrap

HERE = Path(__file__).parent
KINDS = {
    "2 cm": (
        2,
        0,
        1,
        4,
    ),  # how far (cm), turned (degrees), within how many images, how often the number of trials
    "2 cm within 5 images": (2, 0, 5, 1),
    "2 cm within 10 images": (2, 0, 10, 1),
    "7 cm": (7, 0, 1, 1),
    "70 cm": (70, 0, 1, 1),
    "90 degrees": (0, 90, 1, 1),
    "180 degrees": (0, 180, 1, 1),
}
with tempfile.TemporaryDirectory() as folder:
    LOADED = load_laboratory(write_laboratory(Path(folder)))
SCENARIO = LOADED.configuration.swarm
MARKERS = {
    "triangles": (TriangleMarkers(), ["blue"] * 8 + ["orange", "purple"]),
    "ArUco": (ArucoMarkers(), [str(number) for number in range(10)]),
}


def observe(
    seed: int, number: int, disturb: Callable[[EmulatedLaboratory], None] = lambda laboratory: None
) -> list[np.ndarray]:
    """Return the poses (51, 10, 3) of trials; `disturb` is called when the PC begins to wait for the images of one."""
    laboratory, rng = EmulatedLaboratory(SCENARIO, seed=seed), np.random.default_rng(seed)
    camera, found = Poses(laboratory, 0.0, rng), []

    def watch(what: str | ObservedTrial) -> None:
        if isinstance(what, ObservedTrial):
            found.append(what.track.poses)
        elif what == "P4":
            disturb(laboratory)

    open_epuck = lambda name: EPuck(laboratory.link(name))  # noqa: E731
    program = PcProgram(
        LOADED.setup,
        SCENARIO,
        Equipment(laboratory.clock, open_epuck, lambda: camera, laboratory.operator),
        watch,
    )
    while len(found) < number:
        try:
            if not program.connected:
                program.connect()
            program.run(rng.uniform(-1, 1, (2, 4)))
        except Disturbance as disturbance:
            if (
                disturbance.state != "P5"
            ):  # batteries, and the remote control; a refused trial is observed, too
                program.disconnect()
                laboratory.operator.ask(disturbance.remedy)
    return found


def tracker_errors(kind: str, trials: list[np.ndarray]) -> np.ndarray:
    """Return the errors (n, 3) of poses in rendered images of trials."""
    (markers, labels), calibration = MARKERS[kind], overhead_camera()
    camera, errors = EmulatedCamera(calibration, markers, labels), []
    tracker = Tracker(
        markers, calibration, labels, maximum_speed_cm_s=60.0, maximum_turn_rad_s=60.0
    )
    for poses in trials:
        order = (
            np.r_[np.lexsort((poses[0, :8, 1], poses[0, :8, 0])), 8, 9]
            if kind == "triangles"
            else np.arange(10)
        )
        track = tracker.track(camera.render(now) for now in poses[:, order])
        errors.append((track.poses - poses[:, order])[track.present])
    errors = np.concatenate(errors)
    errors[:, 2] = wrap(errors[:, 2])
    return errors


def seen(poses: np.ndarray, errors: np.ndarray, rng: np.random.Generator) -> Track:
    """Return a track of poses, with errors."""
    poses = poses + errors[rng.integers(len(errors), size=poses.shape[:2])]
    return Track(
        poses, np.ones(poses.shape[:2], bool), ("blue",) * 10, SCENARIO.trial.control_interval_s
    )


def beyond(trials: list[np.ndarray]) -> dict[str, np.ndarray]:
    """Return how much farther than robots can drive they moved (n,) sideways, and their wheels, and whether anything was near."""
    poses, robot, arena = (
        np.array(trials),
        SCENARIO.robot,
        np.array([SCENARIO.arena.width_cm, SCENARIO.arena.height_cm]),
    )
    way, turn = robot.maximum_speed_cm_s * 0.1, fastest_turn(robot) * 0.1
    steps, places = np.diff(poses, axis=1), poses[..., :2]
    apart = np.linalg.norm(places[:, :, :, None] - places[:, :, None], axis=-1) + np.diag(
        [np.inf] * 10
    )
    room = np.minimum(
        apart.min(-1) - 2 * robot.radius_cm,
        np.minimum(places, arena - places).min(-1) - robot.radius_cm,
    )
    turned = wrap(steps[..., 2])
    middle = poses[:, :-1, :, 2] + turned / 2
    aside = np.abs(steps[..., 1] * np.cos(middle) - steps[..., 0] * np.sin(middle))
    along = np.abs(steps[..., 0] * np.cos(middle) + steps[..., 1] * np.sin(middle)) / np.sinc(
        turned / (2 * np.pi)
    )
    wheels = along + np.abs(turned) * robot.wheel_distance_cm / 2
    step, near = (
        np.hypot(steps[..., 0], steps[..., 1]),
        np.minimum(room[:, 1:], room[:, :-1]) <= way,
    )
    return {
        "step": step,
        "turn": np.degrees(np.abs(turned)),
        "sideways": aside - way * turn / 8,
        "wheel": wheels - way,
        "near": near,
    }


def clean(trials: list[np.ndarray], rng: np.random.Generator) -> list[dict[str, object]]:
    """Return the rows on undisturbed trials."""
    rows = []
    for kind in ("none", *MARKERS):
        errors = np.zeros((1, 3)) if kind == "none" else tracker_errors(kind, trials[:20])
        tracks = [seen(poses, errors, rng) for poses in trials]
        refused = sum(bool(impossible(track, SCENARIO.robot, SCENARIO.arena)) for track in tracks)
        found = beyond([track.poses for track in tracks])
        for where, those in (("free", ~found["near"]), ("near another or a wall", found["near"])):
            row = {"tracker's errors": kind, "robots": where, "steps": int(those.sum())}
            for name, unit in (
                ("step", "cm"),
                ("turn", "degrees"),
                ("sideways", "cm beyond"),
                ("wheel", "cm beyond"),
            ):
                middle, high, top = np.quantile(found[name][those], [0.5, 0.9999, 1])
                row |= {
                    f"{name}, {unit}: median": round(middle, 3),
                    "99.99 %": round(high, 3),
                    "largest": round(top, 3),
                }
                row = {
                    (f"{name} {key}" if key in ("99.99 %", "largest") else key): value
                    for key, value in row.items()
                }
            rows.append(row | {"trials": len(trials), "refused": refused})
    return rows


class Carry:
    """Carry a robot, or turn it, at a random moment of each trial's images; remember whom, where to, and in which images."""

    def __init__(
        self, away_cm: float, degrees: float, images: int, rng: np.random.Generator
    ) -> None:
        self.away_cm, self.turned, self.images, self.rng = (
            away_cm,
            math.radians(degrees),
            images,
            rng,
        )
        self.moved: list[tuple[int, np.ndarray, float]] = []

    def __call__(self, laboratory: EmulatedLaboratory) -> None:
        """Choose a robot and a moment."""
        self.first = laboratory.clock.now() + 2.0  # of the images, to 0.2 s
        moment = self.first + self.rng.uniform(0.3, 4.8 - 0.1 * self.images)
        laboratory.clock.call_at(
            moment, lambda: self.carry(laboratory, int(self.rng.integers(10)), moment)
        )

    def carry(self, laboratory: EmulatedLaboratory, who: int, moment: float) -> None:
        """Carry the robot to a free place, step by step."""
        poses, room = laboratory.poses(), SCENARIO.robot.radius_cm
        for _ in range(200):
            angle = self.rng.uniform(-math.pi, math.pi)
            way = self.away_cm * np.array([math.cos(angle), math.sin(angle)])
            to, others = poses[who, :2] + way, np.delete(poses, who, axis=0)[:, :2]
            inside = (to >= room + 2).all() and (
                to <= np.array(laboratory.arena_cm) - room - 2
            ).all()
            if not self.away_cm or (inside and np.hypot(*(others - to).T).min() > 2 * room):
                break
        else:
            self.carry(laboratory, int(self.rng.integers(10)), moment)
            return
        self.moved.append((who, way, moment - self.first))

        def move() -> None:
            x, y, heading = laboratory.poses()[who]
            low, high = room, np.array(laboratory.arena_cm) - room
            x, y = np.clip(np.array([x, y]) + way / self.images, low, high)
            laboratory.put(
                laboratory.names[who], (float(x), float(y), heading + self.turned / self.images)
            )

        for step in range(self.images):
            laboratory.clock.call_at(moment + 0.1 * step, move)


def carried(kind: str, number: int, errors: np.ndarray, seed: int) -> dict[str, object]:
    """Return the row of one kind of carrying."""
    away_cm, degrees, images, more = KINDS[kind]
    rng = np.random.default_rng(seed)
    carry = Carry(away_cm, degrees, images, rng)
    trials, noticed, off = observe(seed, number * more, carry), 0, []
    for poses, (who, way, after_s) in zip(trials, carry.moved, strict=False):
        track = seen(poses, errors, rng)
        if any(
            fault.text.startswith(f"individual {who} ")
            for fault in impossible(track, SCENARIO.robot, SCENARIO.arena)
        ):
            noticed += 1
            continue
        own = track.poses.copy()  # as if it had not been carried
        for step in range(images):
            own[int(after_s / 0.1 + step) + 1 :, who, :2] -= way / images
        apart = np.abs(signed_speeds(track.poses, 0.1) - signed_speeds(own, 0.1))[who, :, 0]
        off.append((apart.max(), apart.mean()))
    largest, mean = (
        np.array(off).max(axis=0) if off else (0.0, 0.0),
        np.array(off).mean(axis=0) if off else (0.0, 0.0),
    )
    return {
        "carried": kind,
        "trials": len(trials),
        "noticed": noticed,
        "share": round(noticed / len(trials), 4),
        "unnoticed: one value off by (cm/s), mean": round(float(mean[0]), 2),
        "largest": round(float(largest[0]), 2),
        "mean speed off by (cm/s), mean": round(float(mean[1]), 3),
        "mean speed, largest": round(float(largest[1]), 3),
    }


def write(name: str, rows: list[dict[str, object]]) -> None:
    """Write a table beside this file."""
    with (HERE / name).open("w", newline="") as table:
        writer = csv.DictWriter(table, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    """Observe the trials that FOLDER does not have, and write the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--clean", type=int, default=3600)
    parser.add_argument("--carried", type=int, default=100)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    trials: list[np.ndarray] = []
    for seed in range(1, 5):
        kept = given.folder / f"clean-{seed}-{given.clean}.npy"
        if not kept.exists():
            np.save(kept, np.array(observe(seed, given.clean // 4)))
        trials += list(np.load(kept))
    write("carried-clean.csv", clean(trials, np.random.default_rng(1)))
    errors = tracker_errors("triangles", trials[:20])
    write(
        "carried.csv",
        [carried(kind, given.carried, errors, seed) for seed, kind in enumerate(KINDS, 11)],
    )


if __name__ == "__main__":
    main()
