"""How often does `compare` tell a model that is right, and one that is not? Rows of right-models.csv.

One recording is simulated. Its held-out windows are examined against samples of the same model, with the true parameters
and with one that is 10 or 40 % too large. Run with ``python experiments/examination/right_models.py``. With ``groups`` behind it,
Couzin groups are recorded in a tank, eight of them, and have all settled for as long: rows of right-groups.csv.
"""

import csv
import sys
from pathlib import Path

import numpy as np

from turing_learning.examination import QUICK, test_held_out
from turing_learning.families import BurstAndCoast, Couzin, Particles
from turing_learning.trajectories import Trajectories, pooled_windows

TABLE = Path(__file__).parent / "right-models.csv"
REPEATS = 100
GROUP_REPEATS = 40
TANK_CM = (40.0, 40.0)
FRAMES = 2000
"""Of a recording, at 10 per second."""
SETTLING = 100
SIGNALS = ("speed", "turn")
OF_GROUPS = (*SIGNALS, "neighbor_distance")
SYSTEMS = {
    "5 burst-and-coast walkers": (BurstAndCoast, 5, SIGNALS, [12.0, 0.5, 0.8, 0.5]),
    "a Couzin group of 8": (Couzin, 8, OF_GROUPS, [5.0, 3.0, 1.0, 4.0, 8.0, 0.15]),
}
"""Name -> family, individuals, signals, true parameters."""
WALKERS, SHOAL = SYSTEMS
CASES = [(WALKERS, 1.0), (WALKERS, 1.1), (SHOAL, 1.0), (WALKERS, 1.4), (SHOAL, 1.4)]
"""Which system, and how many times its last parameter that of the model is."""


def p_value(
    family: type[Particles],
    individuals: int,
    signals: tuple[str, ...],
    truth: np.ndarray,
    model: np.ndarray,
    seed: int,
) -> float:
    """Record a group, hold out windows, and examine them against samples of a model."""
    rng = np.random.default_rng((45, 8, seed))
    options = {"individuals": individuals, "interval_s": 0.1, "settling_steps": SETTLING}
    group = family(steps=FRAMES - 2, **options)
    positions = group.simulate(truth[None], rng)[0]
    names = tuple(map(str, range(individuals)))
    present = np.ones(positions.shape[:2], dtype=bool)
    recording = Trajectories(positions, present, 10.0, names)
    windows = recording.windows(length_s=4.0, signals=signals)
    imitated = family(steps=windows.held_out.shape[1], signals=signals, **options)
    samples = imitated(np.tile(model, (len(windows.held_out), 1)), rng)[:, 0]
    return test_held_out(windows, samples, examiners=QUICK, seed=seed).p_value


def p_value_of_groups(settling_steps: int, tank_cm: tuple[float, float] | None, seed: int) -> float:
    """Record eight Couzin groups, and examine held-out windows against samples of the right model."""
    _, individuals, signals, values = SYSTEMS[SHOAL]
    rng = np.random.default_rng((45, 12, seed))
    options = {
        "individuals": individuals,
        "interval_s": 0.1,
        "tank_cm": tank_cm,
        "settling_steps": settling_steps,
    }
    group = Couzin(steps=FRAMES // 5 - 2, **options)
    names = tuple(map(str, range(individuals)))
    recordings = []
    for positions in group.simulate(np.tile(values, (8, 1)), rng):
        present = np.ones(positions.shape[:2], dtype=bool)
        recordings.append(Trajectories(positions, present, 10.0, names))
    windows = pooled_windows(recordings, length_s=4.0, signals=signals)
    imitated = Couzin(steps=windows.held_out.shape[1], signals=signals, **options)
    samples = imitated(np.tile(values, (len(windows.held_out), 1)), rng)[:, 0]
    return test_held_out(windows, samples, examiners=QUICK, seed=seed).p_value


def write_groups() -> None:
    """Write how often the right model of groups is told, by how long they settle."""
    with TABLE.with_name("right-groups.csv").open("w") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["tank", "settling_steps", "repeats", "told_at_0.05", "told_at_0.01"])
        for tank, settling_steps in ((None, 100), (TANK_CM, 100), (TANK_CM, 1000)):
            found = []
            for seed in range(GROUP_REPEATS):
                found.append(p_value_of_groups(settling_steps, tank, seed))
            shares = [f"{np.mean(np.array(found) <= level):.2f}" for level in (0.05, 0.01)]
            place = "none" if tank is None else "40 cm x 40 cm"
            writer.writerow([place, settling_steps, GROUP_REPEATS, *shares])


def main() -> None:
    """Write how often models are told; rows that are there already are not made again."""
    columns = ["system", "model", "repeats", "told_at_0.05", "told_at_0.01"]
    rows = list(csv.reader(TABLE.open())) if TABLE.exists() else [columns]
    done = {(row[0], row[1]) for row in rows}
    for name, factor in CASES:
        said = "right" if factor == 1 else f"{factor - 1:.0%} off"
        if (name, said) in done:
            continue
        family, individuals, signals, values = SYSTEMS[name]
        truth = np.array(values)
        model = truth.copy()
        # the last parameter: how much walkers turn, how noisy the direction of fish is
        model[-1] *= factor
        found = []
        for seed in range(REPEATS):
            found.append(p_value(family, individuals, signals, truth, model, seed))
        shares = [f"{np.mean(np.array(found) <= level):.2f}" for level in (0.05, 0.01)]
        rows.append([name, said, str(REPEATS), *shares])
        with TABLE.open("w") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    if sys.argv[1:] == ["groups"]:
        write_groups()
    else:
        main()
