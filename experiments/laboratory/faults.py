"""What happens in a run when things go wrong, in the emulated laboratory: `python experiments/laboratory/faults.py`.

Each row is a run of two generations of four trials of the paper's laboratory, in virtual time, and one fault in the first trial,
3.5 s after its images begin (lost images all along; a PC that is killed is so in its second trial, and the run is resumed).
`worst` is the largest error of any pose of any trial that was used. Writes faults.csv beside this file; takes some minutes.
"""

import csv
import math
import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from turing_learning.robots import CameraPoses, load_laboratory, overhead_camera, rehearse
from turing_learning.runs import read_events, resume_laboratory, start_laboratory

HERE = Path(__file__).parent
ROBOT = "replica-1"


def write_laboratory(folder: Path, *, population: int = 8, generations: int = 2) -> Path:
    """Write the paper's laboratory; return its file."""
    overhead_camera().save(folder / "camera.json", force=True)
    robots = [("agent", f"agent-{k}", "blue", "") for k in range(1, 9)]
    robots += [
        ("replica", name, marker, f'address = "{name}"\n')
        for name, marker in ((ROBOT, "orange"), ("replica-2", "purple"))
    ]
    text = '[camera]\ncalibration = "camera.json"\n[evaluation]\nrepeats = 0\n'
    text += f"[models]\npopulation = {population}\n[run]\ngenerations = {generations}\n"
    for role, name, marker, address in robots:
        text += f'[[robots]]\nname = "{name}"\nrole = "{role}"\nmarker = "{marker}"\n{address}'
    (folder / "lab.toml").write_text(text)
    return folder / "lab.toml"


def carried(laboratory, away_cm: float, turned: float = 0.0, robot: str = ROBOT) -> None:
    """Carry the robot toward the arena's middle, and turn it."""
    x, y, heading = laboratory.poses()[laboratory.number(robot)]
    to_middle = math.atan2(laboratory.arena_cm[1] / 2 - y, laboratory.arena_cm[0] / 2 - x)
    place = x + away_cm * math.cos(to_middle), y + away_cm * math.sin(to_middle)
    laboratory.faults.carry(robot, *place, heading + turned)


def link_lost(laboratory, robot: str = ROBOT) -> None:
    """Lose the link for ten seconds."""
    laboratory.faults.lose_link(robot)
    laboratory.clock.call_at(
        laboratory.clock.now() + 10, lambda: laboratory.operator.reset_link(robot)
    )


FAULTS = {
    "none": None,
    "0.1 % of images lost": 0.001,
    "1 % of images lost": 0.01,
    "5 % of images lost": 0.05,
    "link lost for 10 s": link_lost,
    "carried by 2 cm": lambda lab: carried(lab, 2),
    "carried by 7 cm": lambda lab: carried(lab, 7),
    "carried by 70 cm": lambda lab: carried(lab, 70),
    "turned by 90 degrees": lambda lab: carried(lab, 0, math.pi / 2),
    "turned by 180 degrees": lambda lab: carried(lab, 0, math.pi),
    "battery dead": lambda lab: lab.faults.empty(ROBOT),
    "camera frozen": lambda lab: lab.faults.freeze_camera(),
} | {f"PC killed -9 in P{k}": f"P{k}" for k in range(1, 6)}


class Watched:
    """The laboratory's camera, which loses a share of its images; keeps where everybody was in each."""

    def __init__(self, laboratory, share: float) -> None:
        self._laboratory, self._share, self._rng, self.truth = (
            laboratory,
            share,
            np.random.default_rng(1),
            [],
        )

    @property
    def taken_s(self) -> float:
        """See `Camera`."""
        return self._laboratory.camera.taken_s

    def take(self) -> np.ndarray:
        """Return the next image that is not lost."""
        lost = True
        while lost:
            lost, image = self._rng.random() < self._share, self._laboratory.camera.take()
            self.truth.append((self.taken_s, self._laboratory.poses()))
        return image

    def close(self) -> None:
        """Do nothing."""


def worst(
    poses: np.ndarray, started_s: float, truth: list[tuple[float, np.ndarray]]
) -> tuple[float, float]:
    """Return the largest error (cm, degrees) of a track: that of the images from the middle of the trial."""
    times, there = np.array([time for time, _ in truth]), np.array([at for _, at in truth])
    best = (np.inf, np.inf)
    for first in np.nonzero((times > started_s + 1.5) & (times < started_s + 3))[0]:
        at = there[first : first + len(poses)]
        if len(at) < len(poses):
            continue
        agents = np.hypot(
            *(poses[0, :8, None, :2] - at[0, None, :8, :2]).transpose(2, 0, 1)
        ).argmin(axis=1)
        apart = poses - at[:, np.r_[agents, 8, 9]]
        turned = np.degrees(np.abs((apart[..., 2] + np.pi) % (2 * np.pi) - np.pi))
        best = min(best, (float(np.hypot(apart[..., 0], apart[..., 1]).max()), float(turned.max())))
    return best


def die(name: str, file: Path) -> None:
    """Begin the run, and kill this process when its second trial enters the state of a fault."""
    seen: list[str] = []

    def follow(event) -> None:
        seen.append(event.state if event.kind == "state" else "")
        if seen[-1] == FAULTS[name] and seen.count(FAULTS[name]) == 2:
            os.kill(os.getpid(), signal.SIGKILL)

    loaded = load_laboratory(file, {"run.seed": 3, "run.threads": 1})
    start_laboratory(
        loaded, file.parent / name.replace(" ", "-"), equipment=rehearse(loaded), on_event=follow
    )


def row(name: str, file: Path) -> dict[str, object]:
    """Conduct the run with one fault."""
    fault, loaded, used, rejected, fresh = (
        FAULTS[name],
        load_laboratory(file, {"run.seed": 3, "run.threads": 1}),
        [],
        [],
        [True],
    )
    doors = rehearse(loaded)
    laboratory = doors.operator._arena
    watched = Watched(laboratory, fault if isinstance(fault, float) else 0.0)
    tracker = doors.open_tracker().tracker
    doors = replace(doors, open_tracker=lambda: CameraPoses(watched, tracker, doors.clock))

    def follow(event) -> None:
        if event.kind == "trial":
            (rejected if event.trial.faults else used).append(event.trial)
        elif event.state == "P4" and fresh and callable(fault):
            fresh.clear()
            laboratory.clock.call_at(laboratory.clock.now() + 3.5, lambda: fault(laboratory))

    path = file.parent / name.replace(" ", "-")
    if isinstance(fault, str):
        killed = subprocess.run([sys.executable, __file__, name, file], check=False)
        assert killed.returncode == -signal.SIGKILL
        resume_laboratory(path, equipment=doors, on_event=follow)
    else:
        start_laboratory(loaded, path, equipment=doors, on_event=follow)
    errors = np.array([worst(trial.track.poses, trial.started_s, watched.truth) for trial in used])
    events = read_events(path)
    faults = [event["fault"] for event in events if event["kind"] == "disturbed"]
    return {
        "fault": name,
        "trials used": len(used),
        "rejected": len(rejected),
        "operator asked": len(laboratory.operator.asked)
        - 1,  # the first time, the robots have not begun
        "worst cm": round(float(errors[:, 0].max()), 2),
        "worst degrees": round(float(errors[:, 1].max()), 1),
        "minutes": round(laboratory.clock.now() / 60, 1),
        "noticed": faults[1][:90] if len(faults) > 1 else "",
    }


def main() -> None:
    """Conduct all runs, and write the table."""
    with tempfile.TemporaryDirectory() as folder:
        file = write_laboratory(Path(folder))
        rows = [row(name, file) for name in FAULTS]
    with (HERE / "faults.csv").open("w", newline="") as table:
        writer = csv.DictWriter(table, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        die(sys.argv[1], Path(sys.argv[2]))
    else:
        main()
