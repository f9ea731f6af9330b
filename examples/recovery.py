"""Are known parameters found again? Each family of models, inferred from recordings of itself.

Run with ``python examples/recovery.py``, at any time again: recordings that are in the table are not repeated, nor are runs whose
folders are there.
"""

import argparse
import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from io import StringIO
from pathlib import Path

import numpy as np
from identifiability import least_errors
from recovery_figure import draw

import turing_learning as tl
from turing_learning._files import write_atomically
from turing_learning.analysis import UNKNOWN, is_known
from turing_learning.families import Boids, BurstAndCoast, Couzin, Family, Robots, Vicsek
from turing_learning.models import Parameter
from turing_learning.trajectories import SIGNALS

RECORDINGS = 10
SEEDS = 4
"""Runs on each recording, which are pooled."""

GROUPS = 100
"""Recorded groups, of each of which some individuals become samples."""

TOLD = 0.02
"""Standard error, as a share of the range, up to which a parameter counts as identifiable."""

SHOWN = {
    "family": "family",
    "parameter": "parameter",
    "truth": "truth",
    "estimate": "median_estimate",
    "error": "median_error",
    "half width": "median_half_width",
    "held": "held",
    "alone": "held_alone",
    "least": "least_error",
    "R-hat": "median_r_hat",
}
"""Short heading -> column, for those columns of the summary that fit on a page."""

ROOT = Path(__file__).parents[1]
DOCS, WORK = ROOT / "docs", ROOT / "runs" / "recovery"


@dataclass(frozen=True)
class Case:
    """A family in a known setting, and the size of its runs."""

    family: Family
    truth: dict[str, float]
    generations: int = 1200
    population: int = 50


CASES = {
    "vicsek": Case(
        Vicsek(observed=3, steps=50, period_cm=None, start_side_cm=10, signals=tuple(SIGNALS)),
        {"speed": 6, "noise": 1, "radius": 3},
    ),
    "couzin": Case(
        Couzin(observed=3, steps=50, settling_steps=50, start_side_cm=10, signals=tuple(SIGNALS)),
        {
            "speed": 6,
            "turning_rate": 2,
            "repulsion_radius": 1,
            "orientation_width": 2,
            "attraction_width": 10,
            "noise": 0.1,
        },
        generations=1500,
        population=60,
    ),
    "boids": Case(
        Boids(observed=3, steps=50, start_side_cm=15, signals=tuple(SIGNALS)),
        {"speed": 8, "separation": 20, "alignment": 1, "cohesion": 2},
    ),
    "burst-and-coast": Case(
        BurstAndCoast(individuals=3, observed=3),
        {"speed": 12, "kick_interval": 1, "glide_time": 0.4, "turn": 0.5},
        generations=600,
    ),
    "robots": Case(
        Robots(observed=3), {"vl0": -0.7, "vr0": -1, "vl1": 1, "vr1": -1}, generations=600
    ),
}


@dataclass(frozen=True)
class Row:
    """What the runs on one recording, pooled, say of one parameter.

    `estimates` are those of the single runs, separated by spaces, and `held_alone` counts those whose own interval holds the truth;
    `unknown_alone` those whose own interval is not known, which holds nothing (0 in tables from before they were counted).
    """

    family: str
    recording: int
    parameter: str
    unit: str
    truth: float
    estimate: float
    low: float
    high: float
    r_hat: float
    estimates: str
    held_alone: int
    seconds: float
    unknown_alone: int = 0

    @property
    def unknown(self) -> bool:
        """Whether the interval is not known."""
        return not is_known(self.low, self.high)

    @property
    def held(self) -> bool:
        """Whether the truth is within the interval; an unknown one holds nothing."""
        return self.low <= self.truth <= self.high

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.estimates.split())


@dataclass(frozen=True)
class Summary:
    """What all recordings say of one parameter; errors and half widths are shares of the range, medians of what is known."""

    family: str
    parameter: str
    unit: str
    truth: float
    least_error: float
    identifiable: bool
    recordings: int
    held: int
    unknown: int
    runs: int
    held_alone: int
    unknown_alone: int
    median_estimate: float
    median_error: float
    median_half_width: float
    median_r_hat: float


def recover(name: str, recording: int, case: Case, work: Path) -> list[Row]:
    """Record a family, infer its parameters from the recording by several runs, and return a row for each parameter."""
    recorded = case.family.observe(
        case.truth, groups=GROUPS, rng=np.random.default_rng([recording, GROUPS])
    )
    seeds = [100 * recording + number for number in range(1, SEEDS + 1)]
    runs = [infer(case, recorded, seed, work / f"{name}-{recording}-seed{seed}") for seed in seeds]
    pooled = tl.pool(runs)
    return [
        Row(
            name,
            recording,
            key,
            unit,
            case.truth[key],
            *map(_rounded, (pooled.estimate[key], *pooled.interval[key], pooled.agreement[key])),
            estimates=" ".join(f"{_rounded(value):g}" for value in pooled.estimates[key]),
            held_alone=sum(
                low <= case.truth[key] <= high for low, high in (run.wandering[key] for run in runs)
            ),
            seconds=round(sum(run.seconds_total for run in runs), 1),
            unknown_alone=sum(not is_known(*run.wandering[key]) for run in runs),
        )
        for key, unit in case.family.units.items()
    ]


def infer(case: Case, recorded: np.ndarray, seed: int, folder: Path) -> tl.Result:
    """Do a run in a folder, or go on with it; one that is finished is opened."""
    if folder.exists():
        return tl.resume(folder, genuine=recorded, simulate=case.family, threads=1)
    return tl.infer(
        genuine=recorded,
        simulate=case.family,
        parameters=case.family.parameters,
        signals=case.family.signals,
        generations=case.generations,
        seed=seed,
        threads=1,
        out=folder,
        settings={
            "models.population": case.population,
            "classifiers.population": case.population,
            "run.history": "thin",
        },
    )


def _rounded(value: float) -> float:
    return float(f"{value:.5g}") if is_known(value) else UNKNOWN


def read(path: Path) -> list[Row]:
    """Return the rows of a table; none if there is no file."""
    if not path.exists():
        return []
    kinds = {field.name: field.type for field in fields(Row)}
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Row(**{key: _value(kinds[key], cell) for key, cell in row.items()})
            for row in csv.DictReader(file)
        ]


def _value(kind: type, cell: str) -> object:
    return UNKNOWN if kind is float and not cell else kind(cell)


def write(
    path: Path, rows: Sequence[Row | Summary], columns: Mapping[str, str] | None = None
) -> None:
    """Write rows as CSV: all columns, or some, heading -> name; cells of numbers that are not known are empty."""
    text = StringIO()
    columns = columns or {field.name: field.name for field in fields(rows[0])}
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(getattr(row, name)) for name in columns.values()] for row in rows)
    write_atomically(path, text.getvalue().encode())


def _cell(value: object) -> object:
    return None if isinstance(value, float) and not is_known(value) else value


def complete(path: Path, names: Sequence[str], recordings: int, work: Path) -> Iterator[list[Row]]:
    """Do what a table lacks, one recording after the other through all families, and yield the table after each."""
    rows = read(path)
    done = {(row.family, row.recording) for row in rows}
    for recording in range(1, recordings + 1):
        for name in names:
            if (name, recording) not in done:
                rows = sorted([*rows, *recover(name, recording, CASES[name], work)], key=place)
                write(path, rows)
                yield rows


def place(row: Row) -> tuple[int, int]:
    """Return where a recording stands in the table."""
    return list(CASES).index(row.family), row.recording


def summarize(rows: Sequence[Row]) -> Iterator[Summary]:
    """Yield for each parameter how often it was found, and what its motion tells of it at all."""
    for name in dict.fromkeys(row.family for row in rows):
        case = CASES[name]
        least = least_errors(case.family, case.truth, GROUPS)
        for key, parameter in case.family.parameters.items():
            own = [row for row in rows if (row.family, row.parameter) == (name, key)]
            yield Summary(
                family=name,
                parameter=key,
                unit=parameter.unit,
                truth=case.truth[key],
                least_error=round(least[key], 4),
                identifiable=least[key] <= TOLD,
                recordings=len(own),
                held=sum(row.held for row in own),
                unknown=sum(row.unknown for row in own),
                runs=sum(row.runs for row in own),
                held_alone=sum(row.held_alone for row in own),
                unknown_alone=sum(row.unknown_alone for row in own),
                median_estimate=float(f"{np.median([row.estimate for row in own]):.4g}"),
                median_error=share([row.estimate - row.truth for row in own], parameter),
                median_half_width=share(
                    [(row.high - row.low) / 2 for row in own if not row.unknown], parameter
                ),
                median_r_hat=round(_median([row.r_hat for row in own if is_known(row.r_hat)]), 2),
            )


def share(lengths: Sequence[float], parameter: Parameter) -> float:
    """Return the median length as a share of a parameter's range."""
    return round(_median(np.abs(lengths)) / (parameter.high - parameter.low), 4)


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else UNKNOWN


def main() -> None:
    """Do what is missing, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--recordings", type=int, default=RECORDINGS, help="recordings of each family"
    )
    parser.add_argument("--only", choices=CASES, action="append", help="a family; all by default")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder with results/ and images/")
    parser.add_argument(
        "--work",
        type=Path,
        default=WORK,
        help="folder of the runs; remove it when the code or a case has changed",
    )
    chosen = parser.parse_args()
    path = chosen.docs / "results" / "recovery-pools.csv"
    for rows in complete(path, chosen.only or list(CASES), chosen.recordings, chosen.work):
        print(
            f"{len({(row.family, row.recording) for row in rows})} recordings in {path}", flush=True
        )
    rows = read(path)
    summaries = list(summarize(rows))
    write(path.with_name("recovery-pools-summary.csv"), summaries)
    write(path.with_name("recovery-pools-page.csv"), summaries, SHOWN)
    dim = {(one.family, one.parameter) for one in summaries if not one.identifiable}
    draw(rows, dim).savefig(chosen.docs / "images" / "recovery-pools.png", dpi=200)


if __name__ == "__main__":
    main()
