"""Ten runs in the emulated laboratory with random faults, and ten without: `python .../runs_with_faults.py FOLDER`.

Each run is of the paper's laboratory in virtual time, with ten trials a generation. With faults, 1 % of the images are lost, and in
one trial of ten something happens to a robot: its link is lost for 10 s, somebody carries it by 2 to 70 cm or turns it by 90 to 180
degrees, or a replica's battery dies. The operator does what is asked, in a minute. The camera gives the poses themselves: what is
read in images is measured in faults.csv. Runs that are complete in FOLDER are kept. Writes runs-with-faults.csv after each run.
"""

import argparse
import csv
import math
import shutil
from pathlib import Path

import numpy as np
from faults import carried, link_lost, write_laboratory

from turing_learning.robots import (
    EmulatedLaboratory,
    EPuck,
    Equipment,
    Event,
    Fault,
    Track,
    load_laboratory,
)
from turing_learning.robots.program._equipment import PunctualImages
from turing_learning.runs import load_run, read_events, start_laboratory

HERE = Path(__file__).parent
LOST, DISTURBED = 0.01, 0.1  # shares of the images, and of the trials


class Poses:
    """A camera whose images are the poses, and lose a share; what follows all robots in them."""

    def __init__(
        self, laboratory: EmulatedLaboratory, share: float, rng: np.random.Generator
    ) -> None:
        self._laboratory, self._share, self._rng = laboratory, share, rng
        laboratory.camera._render = laboratory.poses

    @property
    def taken_s(self) -> float:
        """See `Camera`."""
        return self._laboratory.camera.taken_s

    def take(self) -> np.ndarray:
        """Return the poses (A, 3) in the next image that is not lost."""
        poses = self._laboratory.camera.take()
        while self._rng.random() < self._share:
            poses = self._laboratory.camera.take()
        return poses

    def track(self, begin_s: float, images: int) -> Track:
        """See `PoseSource`."""
        laboratory = self._laboratory
        punctual = PunctualImages(self, laboratory.clock, begin_s, images, laboratory.interval_s)
        poses, present = (
            np.zeros((images, len(laboratory.names), 3)),
            np.ones((images, len(laboratory.names)), bool),
        )
        for frame, image in enumerate(punctual):
            present[frame] = image is not None
            poses[frame] = poses[frame - 1] if image is None else image
        faults = (Fault(0, "irregular images", punctual.fault),) if punctual.fault else ()
        return Track(poses, present, laboratory.labels, laboratory.interval_s, faults)

    def close(self) -> None:
        """Do nothing."""


def disturb(laboratory: EmulatedLaboratory, rng: np.random.Generator) -> None:
    """Let something happen to a robot."""
    away_cm, turned = (
        float(np.exp(rng.uniform(math.log(2), math.log(70)))),
        rng.uniform(math.pi / 2, math.pi),
    )
    replica, anybody = rng.choice(laboratory.names[-2:]), rng.choice(laboratory.names)
    what = rng.integers(4)
    if what == 0:
        link_lost(laboratory, replica)
    elif what == 1:
        laboratory.faults.empty(replica)
    else:
        carried(laboratory, *((away_cm, 0.0) if what == 2 else (0.0, turned)), anybody)


def conduct(number: int, faulty: bool, generations: int, folder: Path) -> dict[str, object]:
    """Return the row of a run; conduct it if the folder has none."""
    out = folder / f"{'faults' if faulty else 'none'}-{number}"
    done = out.with_suffix(".hours")
    file = write_laboratory(folder, population=20, generations=generations)
    loaded, rng = (
        load_laboratory(file, {"run.seed": number, "run.threads": 1}),
        np.random.default_rng([number, 23]),
    )
    if not done.exists():
        shutil.rmtree(out, ignore_errors=True)
        laboratory = EmulatedLaboratory(loaded.configuration.swarm, seed=number)
        poses = Poses(laboratory, LOST if faulty else 0.0, rng)
        equipment = Equipment(
            laboratory.clock,
            lambda name: EPuck(laboratory.link(name)),
            lambda: poses,
            laboratory.operator,
        )

        def follow(event: Event) -> None:
            if (
                faulty
                and event.state == "P4"
                and event.kind == "state"
                and rng.random() < DISTURBED
            ):
                laboratory.clock.call_at(
                    laboratory.clock.now() + rng.uniform(0, 7), lambda: disturb(laboratory, rng)
                )

        start_laboratory(loaded, out, equipment=equipment, on_event=follow)
        done.write_text(f"{laboratory.clock.now() / 3600:.2f}")
    result, events = load_run(out), read_events(out)
    error = np.mean([abs(result.estimate[name] - value) for name, value in result.truth.items()])
    trials = list((out / "trials").rglob("*.npz"))
    lost = sum(
        int((~np.load(path)["present"]).all(axis=1).sum())
        for path in trials
        if path.name.startswith("trial")
    )
    return {
        "run": number,
        "faults": "yes" if faulty else "no",
        "error": round(float(error), 3),
        "trials": len(trials),
        "rejected": sum(path.name.startswith("rejected") for path in trials),
        "images bridged": lost,
        "disturbed": sum(event["kind"] == "disturbed" for event in events)
        - 1,  # the first time, the robots have not begun
        "operator asked": sum(
            bool(event["asked"]) and event["kind"] == "disturbed" for event in events
        )
        - 1,
        "hours": float(done.read_text()),
    }


def main() -> None:
    """Conduct the runs, pair by pair, and write the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--generations", type=int, default=30)
    parser.add_argument("--runs", type=int, default=10)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for number in range(1, given.runs + 1):
        rows += [
            conduct(number, faulty, given.generations, given.folder) for faulty in (False, True)
        ]
        with (HERE / "runs-with-faults.csv").open("w", newline="") as table:
            writer = csv.DictWriter(table, rows[0])
            writer.writeheader()
            writer.writerows(rows)
        mean = {
            kind: np.mean([row["error"] for row in rows if row["faults"] == kind])
            for kind in ("no", "yes")
        }
        print(
            f"{number} pairs: mean error without faults {mean['no']:.3f}, with faults {mean['yes']:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
