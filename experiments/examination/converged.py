"""Does a run on a recording say by itself that its model is wrong? Rows of converged.csv.

    python experiments/examination/converged.py 1 8     # first and last seed; what is there is not done again
    python experiments/examination/converged.py         # prints how many runs doubt their model

A group that bursts and coasts in a tank is recorded, and the same family is inferred. Either the recording is as it is, and
the model is right; or something was done to it that the family does not have: noise of a tracker, a moving average over five
images, lasting differences between individuals, or rests of two seconds.
"""

import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

import turing_learning as tl
from turing_learning.families import BurstAndCoast, as_recorded
from turing_learning.trajectories import Trajectories

TABLE = Path(__file__).with_name("converged.csv")
TRUTH = (12.0, 0.5, 0.8, 0.5)
"""Speed (cm/s), interval of kicks (s), time of gliding (s), turn (rad)."""
KINDS = ("right", "noise", "average", "lasting", "rests")
INDIVIDUALS = 6
TANK_CM = (40.0, 40.0)
FRAMES = 3000
"""Of a recording, at 10 per second."""
SIGNALS = ("speed", "turn")
SETTLING = 100
"""Steps that groups move before they are recorded, and models before they are observed."""
NOISE_CM = 0.1
AVERAGED = 5
"""Images of the moving average."""
LASTING = 0.3
"""Standard deviation of the logarithm of how much farther an individual moves than others."""
REST = 20
"""Images of a rest; one begins every 100 images on average."""


def changed(positions: np.ndarray, kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return positions (F, A, 2) to which something was done."""
    if kind == "noise":
        return positions + NOISE_CM * rng.standard_normal(positions.shape)
    if kind == "average":
        sums = np.cumsum(np.concatenate((np.zeros_like(positions[:1]), positions)), axis=0)
        return (sums[AVERAGED:] - sums[:-AVERAGED]) / AVERAGED
    if kind == "lasting":
        farther = np.exp(LASTING * rng.standard_normal(positions.shape[1]))[:, None]
        return positions[:1] + farther * (positions - positions[:1])
    if kind == "rests":
        begins = rng.random(positions.shape[:2]) < 1 / 100
        resting = np.zeros(positions.shape[:2], dtype=bool)
        for delay in range(REST):
            resting[delay:] |= begins[: len(begins) - delay]
        steps = np.diff(positions, axis=0, prepend=positions[:1])
        steps[resting] = 0
        return positions[:1] + np.cumsum(steps, axis=0)
    return positions


def rows(kind: str, seed: int) -> list[dict[str, object]]:
    """Return the row of one run."""
    rng = np.random.default_rng((45, 9, seed, *kind.encode()))
    group = BurstAndCoast(
        steps=FRAMES - 2,
        individuals=INDIVIDUALS,
        interval_s=0.1,
        settling_steps=SETTLING,
        tank_cm=TANK_CM,
    )
    positions = changed(group.simulate(np.array([TRUTH]), rng)[0], kind, rng)
    names = tuple(map(str, range(INDIVIDUALS)))
    present = np.ones(positions.shape[:2], dtype=bool)
    recording = Trajectories(positions, present, 10.0, names)
    windows = recording.windows(length_s=4.0, signals=SIGNALS)
    model = as_recorded(BurstAndCoast, recording, windows, tanks=[TANK_CM], settling_steps=SETTLING)
    begun = time.process_time()
    result = tl.infer(
        genuine=windows,
        simulate=model,
        parameters=model.parameters,
        trials=1000,
        seed=seed,
        settings={"run.threads": 1},
    )
    row = {"recording": kind, "seed": seed, "verdict": result.verdict}
    row["all"] = "; ".join(result.found)
    row["cpu_s"] = round(time.process_time() - begun, 1)
    return [row]


def summary() -> None:
    """Print how many runs doubt their model, and how many do so by the panel alone."""
    table = pd.read_csv(TABLE)
    said = table["all"].fillna("")
    differ = said.str.contains("samples differ")
    table["doubted"] = differ | said.str.contains("tell")
    table["by the panel alone"] = differ & ~said.str.contains("tell")
    grouped = table.groupby("recording")[["doubted", "by the panel alone"]].sum()
    grouped.insert(0, "runs", table.groupby("recording").size())
    sys.stdout.write(grouped.to_string() + "\n")


def main(first: int, last: int) -> None:
    """Conduct the runs that the table lacks."""
    done = set()
    if TABLE.exists():
        columns = pd.read_csv(TABLE)[["recording", "seed"]]
        done = set(columns.itertuples(index=False, name=None))
    for seed in range(first, last + 1):
        for kind in KINDS:
            if (kind, seed) not in done:
                frame = pd.DataFrame(rows(kind, seed))
                frame.to_csv(TABLE, mode="a", index=False, header=not TABLE.exists())


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(int(sys.argv[1]), int(sys.argv[2]))
    else:
        summary()
