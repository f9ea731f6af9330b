"""The documented flow in real time, as two programs beside a load: the arena and `turing-learning robots run`.

    python experiments/laboratory/real_time.py build/real-time --load 4

takes 35 minutes: ten generations of ten trials, images of 1280 x 960 over HTTP. Nobody answers the operator's questions, so that
one would end the run. Then every pose of every trial that was used is compared with where the robot was.
"""

import argparse
import csv
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ARENA = """
import os, sys, time
from pathlib import Path
os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(10))  # robots and a camera do not wait for the PC; needs root
import numpy as np
from turing_learning.robots import ArenaService
folder = Path(sys.argv[1])
with ArenaService(seed=1, lines="tcp") as service:
    service.laboratory.operator.press_remote()
    service.write(folder, force=True)
    truth, lab = [], service.laboratory
    while not (folder / "stop").exists():
        with lab.lock:
            truth.append(np.r_[time.monotonic(), lab.clock.now(), lab.poses().ravel()])
        time.sleep(0.04)
    truth = np.array(truth)
    truth[:, 0] = truth[:, 1] + (truth[:, 0] - truth[:, 1]).min()  # when the arena's time was due
    np.save(folder / "truth.npy", np.delete(truth, 1, axis=1))
"""
LATE_S = np.arange(
    -0.2, 0.4, 0.005
)  # of the images after the middle of the trial began: the camera is not synchronous


def errors(trial: Path, truth: np.ndarray, wait_s: float, execute_s: float) -> tuple[float, float]:
    """Return the largest error (cm, degrees) of a trial's poses, the camera's delay being that with the least mean distance."""
    with np.load(trial) as stored:
        poses, started_s, interval_s = (
            stored["poses"],
            float(stored["started_s"]),
            float(stored["interval_s"]),
        )
    begin_s = started_s + wait_s + (execute_s - interval_s * (len(poses) - 1)) / 2
    around = truth[np.abs(truth[:, 0] - started_s) < 30]
    there = around[:, 1:].reshape(len(around), -1, 3)
    there[..., 2] = np.unwrap(there[..., 2], axis=0)
    best = (np.inf, np.inf, np.inf)
    start = np.array(
        [np.interp(begin_s, around[:, 0], there[:, k, 0]) for k in range(there.shape[1])]
    )
    order = slice(0, poses.shape[1])
    for late_s in LATE_S:
        times = begin_s + late_s + interval_s * np.arange(len(poses))
        at = np.array(
            [
                [np.interp(times, around[:, 0], there[:, k, d]) for d in range(3)]
                for k in range(len(start))
            ]
        )
        at = at.transpose(2, 0, 1)
        agents = at.shape[1] - 2
        distances = np.hypot(
            *(poses[0, :agents, None, :2] - at[0, None, :agents, :2]).transpose(2, 0, 1)
        )
        who = np.r_[
            distances.argmin(axis=1), agents, agents + 1
        ]  # agents wear the same marker: numbered anew in each trial
        apart = poses - at[:, who][:, order]
        turned = np.degrees(np.abs((apart[..., 2] + np.pi) % (2 * np.pi) - np.pi))
        distance = np.hypot(apart[..., 0], apart[..., 1])
        best = min(best, (float(distance.mean()), float(distance.max()), float(turned.max())))
    return best[1:]


def main() -> None:
    """Run both programs, and write a row."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--load", type=int, default=4, help="busy processes beside both programs")
    parser.add_argument("--beside", type=int, default=0, help="busy processes that run anyway")
    parser.add_argument("--nice", type=int, default=0, help="of the busy processes")
    parser.add_argument("--priority", type=int, default=0, help="nice value of the PC program")
    parser.add_argument("--generations", type=int, default=10)
    given = parser.parse_args()
    folder = given.folder
    folder.mkdir(parents=True)
    arena = subprocess.Popen([sys.executable, "-c", ARENA, str(folder)])
    while not (folder / "lab.toml").exists():
        time.sleep(0.2)
    with (folder / "lab.toml").open("a") as file:
        file.write("\n[evaluation]\nrepeats = 0\n")
    busy = f"import os; os.nice({given.nice})\nwhile True: pass"
    load = [subprocess.Popen([sys.executable, "-c", busy]) for _ in range(given.load)]
    begun_s = time.monotonic()
    command = [
        "nice",
        "-n",
        str(given.priority),
        sys.executable,
        "-m",
        "turing_learning",
        "robots",
        "run",
        "--config",
        str(folder / "lab.toml"),
    ]
    command += ["--generations", str(given.generations), "--out", str(folder / "run")]
    with (folder / "run.log").open("w") as log:
        program = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
        )
        averages = []
        while (ended := program.poll()) is None:
            time.sleep(10)
            averages.append(os.getloadavg()[0])
    minutes = (time.monotonic() - begun_s) / 60
    for process in load:
        process.kill()
    (folder / "stop").touch()
    arena.wait()
    truth = np.load(folder / "truth.npy")
    used = sorted((folder / "run/trials").glob("generation-*/attempt-*/trial-*.npz"))
    rejected = len(list((folder / "run/trials").glob("generation-*/attempt-*/rejected-*.npz")))
    worst = np.array([errors(trial, truth, 1.0, 7.0) for trial in used])
    row = {
        "busy_processes": given.load + given.beside, "priority": given.priority,
        "load_average": round(sum(averages) / len(averages), 1),
        "generations": given.generations, "exit": ended, "minutes": round(minutes, 1), "trials_used": len(used),
        "trials_rejected": rejected, "largest_cm": round(float(worst[:, 0].max()), 2),
        "largest_degrees": round(float(worst[:, 1].max()), 1),
    }  # fmt: skip
    with (folder / "row.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, row)
        writer.writeheader()
        writer.writerow(row)


if __name__ == "__main__":
    main()
