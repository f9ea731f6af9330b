"""What happens in a run when things go wrong, in the emulated laboratory: `python experiments/laboratory/faults.py`.

Each row is a run of two generations of four trials of the paper's laboratory, in virtual time, and one fault in the first trial,
3.5 s after its images begin (lost images all along). `worst` is the largest error of any pose of any trial that was used.
Writes faults.csv beside this file; takes some minutes of one core. Kills in each state: tests/unit/robots/test_program_runs.py.
"""

import csv
import math
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from turing_learning.robots import CameraPoses, load_laboratory, overhead_camera, rehearse
from turing_learning.runs import read_events, start_laboratory

HERE = Path(__file__).parent
ROBOT = "replica-1"


def write_laboratory(folder: Path) -> Path:
    """Write the paper's laboratory; return its file."""
    overhead_camera().save(folder / "camera.json")
    robots = [("agent", f"agent-{k}", "blue", "") for k in range(1, 9)]
    robots += [
        ("replica", name, marker, f'address = "{name}"\n')
        for name, marker in ((ROBOT, "orange"), ("replica-2", "purple"))
    ]
    text = '[camera]\ncalibration = "camera.json"\n[evaluation]\nrepeats = 0\n[models]\npopulation = 8\n[run]\ngenerations = 2\n'
    for role, name, marker, address in robots:
        text += f'[[robots]]\nname = "{name}"\nrole = "{role}"\nmarker = "{marker}"\n{address}'
    (folder / "lab.toml").write_text(text)
    return folder / "lab.toml"


def carried(laboratory, away_cm: float, turned: float = 0.0) -> None:
    """Carry the robot toward the arena's middle, and turn it."""
    x, y, heading = laboratory.poses()[laboratory.number(ROBOT)]
    to_middle = math.atan2(laboratory.arena_cm[1] / 2 - y, laboratory.arena_cm[0] / 2 - x)
    place = x + away_cm * math.cos(to_middle), y + away_cm * math.sin(to_middle)
    laboratory.faults.carry(ROBOT, *place, heading + turned)


def link_lost(laboratory) -> None:
    """Lose the link for ten seconds."""
    laboratory.faults.lose_link(ROBOT)
    laboratory.clock.call_at(laboratory.clock.now() + 10, lambda: laboratory.operator.reset_link(ROBOT))


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
}


class Watched:
    """The laboratory's camera, which loses a share of its images; keeps where everybody was in each."""

    def __init__(self, laboratory, share: float) -> None:
        self._laboratory, self._share, self._rng, self.truth = laboratory, share, np.random.default_rng(1), []

    @property
    def taken_s(self) -> float:
        """See `Camera`."""
        return self._laboratory.camera.taken_s

    def take(self) -> np.ndarray:
        """Return the next image that is not lost."""
        while self._rng.random() < self._share:
            self._laboratory.camera.take()
        image = self._laboratory.camera.take()
        self.truth.append((self.taken_s, self._laboratory.poses()))
        return image

    def close(self) -> None:
        """Do nothing."""


def worst(poses: np.ndarray, started_s: float, truth: list[tuple[float, np.ndarray]]) -> tuple[float, float]:
    """Return the largest error (cm, degrees) of a track: that of the images from the middle of the trial."""
    times, there = np.array([time for time, _ in truth]), np.array([at for _, at in truth])
    best = (np.inf, np.inf)
    for first in np.nonzero((times > started_s + 1.5) & (times < started_s + 3))[0]:
        at = there[first : first + len(poses)]
        if len(at) < len(poses):
            continue
        agents = np.hypot(*(poses[0, :8, None, :2] - at[0, None, :8, :2]).transpose(2, 0, 1)).argmin(axis=1)
        apart = poses - at[:, np.r_[agents, 8, 9]]
        turned = np.degrees(np.abs((apart[..., 2] + np.pi) % (2 * np.pi) - np.pi))
        best = min(best, (float(np.hypot(apart[..., 0], apart[..., 1]).max()), float(turned.max())))
    return best


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

    start_laboratory(loaded, file.parent / name.replace(" ", "-"), equipment=doors, on_event=follow)
    errors = np.array([worst(trial.track.poses, trial.started_s, watched.truth) for trial in used])
    events = read_events(file.parent / name.replace(" ", "-"))
    faults = [event["fault"] for event in events if event["kind"] == "disturbed"]
    return {
        "fault": name,
        "trials used": len(used),
        "rejected": len(rejected),
        "operator asked": len(laboratory.operator.asked) - 1,  # the first time, the robots have not begun
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
    main()
