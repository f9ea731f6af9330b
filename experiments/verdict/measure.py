"""How far a verdict can be trusted: runs of all kinds of systems whose truth is known, each judged as a user would see it.

``measure.py collect --first 1 --last 7`` makes the runs of these seeds and keeps what the verdict looks at in `--work`;
what is there is not repeated. ``measure.py table`` judges them, and each of them as if it had been stopped earlier, and writes
tables beside this file: each case, how often the truth is within by verdict, and how many good runs are called converged.
"""

import argparse
import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import turing_learning as tl
from turing_learning.analysis import estimate, interval, settled, told
from turing_learning.config._sections import JUMPS_UNTIL
from turing_learning.families import BurstAndCoast, Couzin, Vicsek
from turing_learning.swarm import SCENARIOS
from turing_learning.trajectories import SIGNALS

HERE = Path(__file__).parent
LENGTHS = (30, 60, 100, 200, 300, 600, 1000)  # generations
TRIALS = (100, 300, 1000)
LONG = 4  # the last seed with runs of all lengths
GROUPS = 200
WINDOW = 300  # `run.estimate_window` of the default preset
QUARTILES = (0, 0.25, 0.5, 0.75, 1)
FAMILY = {
    "vicsek": (
        Vicsek(individuals=6, observed=3, steps=50, period_cm=None, start_side_cm=10, signals=tuple(SIGNALS)),
        {"speed": 6.0, "noise": 1.0, "radius": 3.0},
    ),
    "couzin": (
        Couzin(individuals=6, observed=3, steps=50, settling_steps=25, start_side_cm=10, signals=tuple(SIGNALS)),
        {
            "speed": 6.0, "turning_rate": 2.0, "repulsion_radius": 1.0, "orientation_width": 2.0, "attraction_width": 10.0,
            "noise": 0.1,
        },
    ),
    "burst-and-coast": (
        BurstAndCoast(individuals=3, observed=3),
        {"speed": 12.0, "kick_interval": 1.0, "glide_time": 0.4, "turn": 0.5},
    ),
}  # fmt: skip
NAMES = ("aggregation", "object-clustering", "random", "walker-25", "walker-200", *FAMILY)
FEW = ("aggregation", "object-clustering", "random", "walker-25", "walker-200")


def system(case: str, seed: int) -> tuple[dict[str, Any], np.ndarray]:
    """Return what `infer` takes, and the truth (P,); recordings and random controllers differ from seed to seed."""
    if case in SCENARIOS:
        return {"scenario": case}, np.array(SCENARIOS[case].controller)
    rng = np.random.default_rng([33, seed])
    if case == "random":
        controller = rng.uniform(-1, 1, 4)
        return {
            "scenario": replace(SCENARIOS["aggregation"], controller=tuple(controller.tolist()))
        }, controller
    if case in FAMILY:
        family, truth = FAMILY[case]
        genuine = family.observe(truth, groups=GROUPS, rng=rng)
        return {"genuine": genuine, "simulate": family, "parameters": family.parameters}, np.array(
            list(truth.values())
        )
    import sys

    sys.path.insert(0, str(HERE.parent / "few-trials"))
    import walker

    genuine = walker.simulate(np.tile(walker.TRUTH, (int(case.partition("-")[2]), 1)), rng)
    ranges = dict(
        zip(walker.NAMES, zip(walker.LOW.tolist(), walker.HIGH.tolist(), strict=True), strict=True)
    )
    return {
        "genuine": genuine,
        "simulate": walker.simulate,
        "parameters": ranges,
        "vectorized": True,
    }, walker.TRUTH


def planned(first: int, last: int) -> Iterator[tuple[str, str, int, int]]:
    """Return case, unit, length and seed of each run: no two share a seed of the search. Long ones are fewer: they cost most."""
    for seed in range(first, last + 1):
        for case in NAMES:
            lengths = LENGTHS if seed <= LONG else LENGTHS[:5]
            yield from (
                (case, "generations", length, 100 * seed + k) for k, length in enumerate(lengths)
            )
        for case in FEW if seed <= LONG else ():
            yield from (
                (case, "trials", length, 100 * seed + 50 + k) for k, length in enumerate(TRIALS)
            )


def collect(work: Path, first: int, last: int, least: int, most: int, cases: str) -> None:
    """Make the runs that are missing."""
    work.mkdir(parents=True, exist_ok=True)
    for case, unit, length, seed in planned(first, last):
        path = work / f"{case}.{unit}.{length}.{seed}.npz"
        if path.exists() or not least <= length <= most or case not in cases.split(","):
            continue
        given, truth = system(case, seed)
        result = tl.infer(**given, seed=seed, threads=1, **{unit: length})
        history, of = result.history, result.configuration
        kept = {
            "truth": truth,
            "estimate": np.array(list(result.estimate.values())),
            "interval": np.array(list(result.interval.values())),
            "typical": of.described(history["typical_model"].to_numpy()),
            "selection": history["selection"].to_numpy(),
            "low": of.models.initial_low,
            "high": of.models.initial_high,
            "seconds": np.array(result.seconds_total),
        }
        if unit == "generations":
            kept |= {
                "step": np.median(history["model_step_size"].to_numpy(), axis=1),
                "spread": history["model"].to_numpy().std(axis=1),
                "model_fitness": np.quantile(
                    history["model_fitness"].to_numpy(), QUARTILES, axis=1
                ).T,
                "classifier_fitness": np.quantile(
                    history["classifier_fitness"].to_numpy(), QUARTILES, axis=1
                ).T,
            }
        partial = path.with_suffix(".part")
        with partial.open("wb") as file:
            np.savez(file, **{name: np.asarray(value) for name, value in kept.items()})
        partial.replace(path)
        print(path.name, f"{result.seconds_total:.1f} s", flush=True)


def judged(
    kept: dict[str, np.ndarray], unit: str, length: int
) -> tuple[str, np.ndarray, np.ndarray]:
    """Return verdict, estimate (P,) and what the models wandered over (P, 2), or matching left open, of the first generations."""
    if unit == "trials":
        known = not np.isnan(kept["interval"]).any()
        return "converged" if known else "not settled", kept["estimate"], kept["interval"]
    typical, spread = kept["typical"][:length], kept["spread"][:length]
    window = min(WINDOW, max(1, round((1 - JUMPS_UNTIL) * length)))
    found = (
        "still moving"
        if not settled(typical, window, spread).all()
        else "classifiers can still tell"
        if told(kept["classifier_fitness"][:length, 2], window)
        else "converged"
    )
    return found, estimate(typical, window), interval(typical, window)


def table(work: Path) -> None:
    """Write a row for each run and each prefix of it that is one of the lengths, and how often the truth is within."""
    rows = []
    for path in sorted(work.glob("*.npz")):
        case, unit, length, seed = path.stem.split(".")
        kept = dict(np.load(path))
        for end in (
            (int(length),)
            if unit == "trials"
            else [each for each in LENGTHS if each <= int(length)]
        ):
            verdict, inferred, ends = judged(kept, unit, end)
            truth = kept["truth"]
            held = int(((ends[:, 0] <= truth) & (truth <= ends[:, 1])).sum())
            kind = "whole" if end == int(length) else "stopped"
            mae = float(np.abs(inferred - truth).mean())
            rows.append([case, unit, end, seed, kind, f"{mae:.4g}", verdict, held, len(truth)])
    write(
        HERE / "runs.csv",
        ("case", "unit", "length", "seed", "kind", "mae", "verdict", "held", "parameters"),
        rows,
    )
    print(
        len(rows), "cases of", len({(row[0], row[1], row[3]) for row in rows}), "independent runs"
    )
    found = []
    for part, seeds in (
        ("tuning", range(300)),
        ("fresh", range(300, 10**6)),
        ("all", range(10**6)),
    ):
        for unit in ("generations", "trials"):
            for verdict in dict.fromkeys(row[6] for row in rows if row[1] == unit):
                own = [
                    row
                    for row in rows
                    if row[1] == unit and row[6] == verdict and int(row[3]) in seeds
                ]
                if own:
                    held, of = (sum(row[k] for row in own) for k in (7, 8))
                    runs = len({(row[0], row[3]) for row in own})
                    found.append(
                        [part, unit, verdict, len(own), runs, held, of, f"{held / of:.2f}"]
                    )
    header = ("seeds", "unit", "verdict", "cases", "runs", "held", "parameters", "share")
    write(HERE / "summary.csv", header, found)
    called = []
    for case in dict.fromkeys(row[0] for row in rows):
        for length in LENGTHS:
            own = [
                row
                for row in rows
                if row[:3] == [case, "generations", length] and row[4] == "whole"
            ]
            if own:
                errors = np.array([float(row[5]) for row in own])
                good = [
                    row
                    for row, error in zip(own, errors, strict=True)
                    if error < 2 * np.median(errors)
                ]
                converged = sum(row[6] == "converged" for row in good)
                called.append(
                    [case, length, len(own), f"{np.median(errors):.4g}", len(good), converged]
                )
    header = (
        "case",
        "generations",
        "runs",
        "median_mae",
        "below_twice_the_median",
        "of_these_converged",
    )
    write(HERE / "called.csv", header, called)


def write(path: Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write a table."""
    with path.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])
    print(path.name, *(",".join(map(str, row)) for row in rows if path.stem != "runs"), sep="\n")


def main() -> None:
    """Collect runs, or write the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=("collect", "table"))
    parser.add_argument("--work", type=Path, default=Path("runs/verdict"))
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--last", type=int, default=6)
    parser.add_argument("--least", type=int, default=1)
    parser.add_argument("--most", type=int, default=1000, help="leave longer runs for later")
    parser.add_argument("--cases", default=",".join(NAMES), help="with commas between them")
    asked = parser.parse_args()
    if asked.what == "table":
        table(asked.work)
    else:
        collect(asked.work, asked.first, asked.last, asked.least, asked.most, asked.cases)


if __name__ == "__main__":
    main()
