"""How often wrong poses and exchanged robots are found within ten trials, and how often in laboratories that are right.

python experiments/laboratory/wrong_tracks.py wrong 20   # laboratories of each kind; writes wrong-tracks.csv
python experiments/laboratory/wrong_tracks.py right 20   # writes right-tracks.csv
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "tests" / "unit" / "robots"))

from wrong_tracks import WRONG, found_at  # noqa: E402

FIRST_SEED = 1000  # thresholds were chosen on others
RIGHT = {
    "right": {},
    "right, wheels act 3 cycles late": {"lag": 3},
    "right, wheels wrong by up to 10 %": {"spread": 0.1},
    "right, tracker's noise 0.1 cm and 0.03 rad": {"noise_cm": 0.1, "noise_rad": 0.03},
    "right, wheels wrong by up to 25 %": {"spread": 0.25},
    "right, tracker's noise 0.3 cm and 0.1 rad": {"noise_cm": 0.3, "noise_rad": 0.1},
    "right, tracker without noise": {"noise_cm": 0.0, "noise_rad": 0.0},
    "right, agents as in the paper": {"controller": (-0.7, -1.0, 1.0, -1.0)},
    "right, agents drive straight": {"controller": (1.0, 1.0, 1.0, 1.0)},
    "right, agents stand": {"controller": (0.0, 0.0, 0.0, 0.0)},
    "right, agents turn in place": {"controller": (1.0, -1.0, 1.0, -1.0)},
    "right, one replica": {"agents": 2, "replicas": 1},
    "right, four replicas": {"agents": 20, "replicas": 4},
    "right, late in a run": {"near": 0.1},
    "right, straight, late in a run, without noise": {
        "controller": (1.0, 1.0, 1.0, 1.0),
        "near": 0.001,
        "noise_cm": 0.0,
        "noise_rad": 0.0,
    },
}


def rows_of(which: str, laboratories: int) -> Iterator[list[object]]:
    """Yield a row for each kind of laboratory: how many, how many with a fault, named rightly, at which trial at the latest."""
    seeds = range(FIRST_SEED, FIRST_SEED + laboratories)
    if which == "wrong":
        for wrong, name in WRONG.items():
            outcomes = [found_at(seed, wrong) for seed in seeds]
            numbers = [number for number, _ in outcomes if number]
            named = sum(name in fault for _, fault in outcomes)
            yield [
                wrong.__name__.strip("_"),
                laboratories,
                len(numbers),
                named,
                max(numbers, default=""),
            ]
    else:
        for name, options in RIGHT.items():
            outcomes = [found_at(seed, **options) for seed in seeds]
            numbers = [number for number, _ in outcomes if number]
            yield [name, laboratories, len(numbers), "", max(numbers, default="")]


def main(which: str, laboratories: int) -> None:
    """Look at laboratories of each kind, and write the table."""
    with (HERE / f"{which}-tracks.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(
            ["laboratory", "laboratories", "something found", "named rightly", "latest at trial"]
        )
        for row in rows_of(which, laboratories):
            writer.writerow(row)
            file.flush()
            print(*row, flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
