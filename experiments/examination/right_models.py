"""How often does `compare` tell a model that is right, and one that is not? Rows of right-models.csv.

One recording is simulated. Its held-out windows are examined against samples of the same model, with the true parameters
and with one that is 10 or 40 % too large. Run with ``python experiments/examination/right_models.py``. With ``groups`` behind it,
Couzin groups are recorded, eight of them: rows of right-groups.csv. Models begin as was recorded, as in ``infer``, or scattered.
``infer`` behind it infers them: rows of inferred-groups.csv.
"""

import csv
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

import turing_learning as tl
from turing_learning.examination import QUICK, test_held_out
from turing_learning.families import (
    BurstAndCoast,
    Couzin,
    Family,
    Particles,
    Replicates,
    as_recorded,
)
from turing_learning.trajectories import Trajectories, Windows, pooled_windows

TABLE = Path(__file__).parent / "right-models.csv"
REPEATS = 100
GROUP_REPEATS = 100
INFERRED = 4
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
    imitated = as_recorded(family, recording, windows)
    samples = imitated(np.tile(model, (len(windows.held_out), 1)), rng)[:, 0]
    return test_held_out(windows, samples, examiners=QUICK, seed=seed).p_value


def recorded_groups(
    settling_steps: int, tank_cm: tuple[float, float] | None, begin: str, seed: int
) -> tuple[Windows, Family | Replicates]:
    """Record eight Couzin groups; return their windows, and the family that imitates them."""
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
    imitated = as_recorded(Couzin, recordings, windows, tanks=[tank_cm])
    if begin == "scattered":
        imitated = replace(imitated, starts=None, settling_steps=0)
    return windows, imitated


def p_value_of_groups(
    settling_steps: int, tank_cm: tuple[float, float] | None, begin: str, seed: int
) -> float:
    """Examine held-out windows of groups against samples of the right model."""
    windows, imitated = recorded_groups(settling_steps, tank_cm, begin, seed)
    models = np.tile(SYSTEMS[SHOAL][-1], (len(windows.held_out), 1))
    samples = imitated(models, np.random.default_rng((45, 13, seed)))[:, 0]
    return test_held_out(windows, samples, examiners=QUICK, seed=seed).p_value


def write_inferred() -> None:
    """Write what is inferred of groups in a tank: errors in shares of the ranges, and intervals that hold."""
    truth = np.array(SYSTEMS[SHOAL][-1])
    with TABLE.with_name("inferred-groups.csv").open("w", buffering=1) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["seed", "models_begin", "verdict", "parameter", "error", "holds"])
        for seed, begin in product(range(INFERRED), ("as recorded", "scattered")):
            windows, imitated = recorded_groups(1000, TANK_CM, begin, seed)
            result = tl.infer(
                genuine=windows,
                simulate=imitated,
                parameters=imitated.parameters,
                trials=3000,
                seed=seed + 1,
                progress=False,
            )
            for value, (name, parameter) in zip(truth, imitated.parameters.items(), strict=True):
                error = abs(result.estimate[name] - value) / (parameter.high - parameter.low)
                low, high = result.interval[name]
                # no interval is given where the run is told
                holds = "" if np.isnan(low) else int(low <= value <= high)
                verdict = str(result.found[0])
                writer.writerow([seed, begin, verdict, name, f"{error:.4f}", holds])


def write_groups() -> None:
    """Write how often the right model of groups is told, by how long they settle."""
    with TABLE.with_name("right-groups.csv").open("w") as file:
        writer = csv.writer(file, lineterminator="\n")
        columns = ["tank", "settled_s", "models_begin", "repeats", "told_at_0.05", "told_at_0.01"]
        writer.writerow(columns)
        places = (None, 100), (TANK_CM, 100), (TANK_CM, 1000)
        for (tank, settling_steps), begin in product(places, ("as recorded", "scattered")):
            found = []
            for seed in range(GROUP_REPEATS):
                found.append(p_value_of_groups(settling_steps, tank, begin, seed))
            shares = [f"{np.mean(np.array(found) <= level):.2f}" for level in (0.05, 0.01)]
            place = "none" if tank is None else "40 cm x 40 cm"
            settled_s = settling_steps / 10
            writer.writerow([place, f"{settled_s:g}", begin, GROUP_REPEATS, *shares])


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
    elif sys.argv[1:] == ["infer"]:
        write_inferred()
    else:
        main()
