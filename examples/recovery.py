"""Are known parameters found again? Each family of models, inferred from recordings of itself.

Run with ``python examples/recovery.py``, at any time again: runs that are in the table are not repeated.
"""

import argparse
import csv
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from io import StringIO
from pathlib import Path

import numpy as np
from identifiability import least_errors
from recovery_figure import draw

import turing_learning as tl
from turing_learning.families import Boids, BurstAndCoast, Couzin, Family, Robots, Vicsek
from turing_learning.models import Parameter
from turing_learning.runs import write_atomically
from turing_learning.trajectories import SIGNALS

RUNS = 10
GROUPS = 100
"""Recorded groups, of each of which some individuals become samples."""

TOLD = 0.02
"""Standard error, as a share of the range, up to which a parameter counts as identifiable."""

DOCS = Path(__file__).parents[1] / "docs"


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
    "robots": Case(Robots(observed=3), {"vl0": -0.7, "vr0": -1, "vl1": 1, "vr1": -1}, generations=600),
}


@dataclass(frozen=True)
class Row:
    """What one run says of one parameter."""

    family: str
    run: int
    parameter: str
    unit: str
    truth: float
    estimate: float
    low: float
    high: float
    seconds: float

    @property
    def held(self) -> bool:
        """Whether the truth is within the interval."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class Summary:
    """What all runs say of one parameter; errors and half widths are shares of the range."""

    family: str
    parameter: str
    unit: str
    truth: float
    least_error: float
    identifiable: bool
    runs: int
    held: int
    median_estimate: float
    median_error: float
    median_half_width: float


def recover(name: str, run: int, case: Case) -> list[Row]:
    """Record a family, infer its parameters from the recording, and return a row for each."""
    recorded = case.family.observe(case.truth, groups=GROUPS, rng=np.random.default_rng([run, GROUPS]))
    result = tl.infer(
        genuine=recorded,
        simulate=case.family,
        parameters=case.family.parameters,
        signals=case.family.signals,
        generations=case.generations,
        seed=run,
        threads=1,
        settings={"models.population": case.population, "classifiers.population": case.population},
    )
    return [
        Row(name, run, key, unit, case.truth[key], *_rounded(result, key), seconds=round(result.seconds_total, 1))
        for key, unit in case.family.units.items()
    ]


def _rounded(result: tl.Result, name: str) -> Iterator[float]:
    for value in (result.estimate[name], *result.interval[name]):
        yield float(f"{value:.5g}")


def read(path: Path) -> list[Row]:
    """Return the rows of a table; none if there is no file."""
    if not path.exists():
        return []
    kinds = {field.name: field.type for field in fields(Row)}
    with path.open(encoding="utf-8", newline="") as file:
        return [Row(**{key: kinds[key](value) for key, value in row.items()}) for row in csv.DictReader(file)]


def write(path: Path, rows: Sequence[Row | Summary]) -> None:
    """Write rows as CSV."""
    text = StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(rows[0])], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in rows)
    write_atomically(path, text.getvalue().encode())


def complete(path: Path, names: Sequence[str], runs: int) -> Iterator[list[Row]]:
    """Do the runs that a table lacks, one after the other through all families, and yield the table after each."""
    rows = read(path)
    done = {(row.family, row.run) for row in rows}
    for run in range(1, runs + 1):
        for name in names:
            if (name, run) not in done:
                rows = sorted([*rows, *recover(name, run, CASES[name])], key=place)
                write(path, rows)
                yield rows


def place(row: Row) -> tuple[int, int]:
    """Return where a run stands in the table."""
    return list(CASES).index(row.family), row.run


def summarize(rows: Sequence[Row]) -> Iterator[Summary]:
    """Yield for each parameter how often the runs found it, and what its motion tells of it at all."""
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
                runs=len(own),
                held=sum(row.held for row in own),
                median_estimate=float(f"{np.median([row.estimate for row in own]):.4g}"),
                median_error=share([row.estimate - row.truth for row in own], parameter),
                median_half_width=share([(row.high - row.low) / 2 for row in own], parameter),
            )


def share(lengths: Sequence[float], parameter: Parameter) -> float:
    """Return the median length as a share of a parameter's range."""
    return round(float(np.median(np.abs(lengths))) / (parameter.high - parameter.low), 4)


def main() -> None:
    """Do what is missing, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=RUNS, help="runs of each family")
    parser.add_argument("--only", choices=CASES, action="append", help="a family; all by default")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder with results/ and images/")
    chosen = parser.parse_args()
    path = chosen.docs / "results" / "recovery-runs.csv"
    for rows in complete(path, chosen.only or list(CASES), chosen.runs):
        print(f"{len({(row.family, row.run) for row in rows})} runs in {path}", flush=True)
    rows = read(path)
    summaries = list(summarize(rows))
    write(path.with_name("recovery-summary.csv"), summaries)
    dim = {(one.family, one.parameter) for one in summaries if not one.identifiable}
    draw(rows, dim).savefig(chosen.docs / "images" / "recovery.png", dpi=110)


if __name__ == "__main__":
    main()
