"""Coverage of the intervals of `match` on the walker: runs of a number of trials on fixed recordings, read out at the end.

    python experiments/few-trials/coverage.py --recordings 25 200 --seeds 3001 3010 --trials 3000 --out coverage.csv

Seeds that the file holds are not run again.
"""

import argparse
import csv
import time
from pathlib import Path

import curves
import numpy as np
import walker

from turing_learning.analysis import match
from turing_learning.classifiers import ElmanClassifier, PooledClassifier
from turing_learning.coevolution import FewTrials, Samples
from turing_learning.evolution import EvolutionStrategy

HALF = (walker.HIGH - walker.LOW) / 2
JURORS = 300
FIELDS = (
    *("recordings", "trials", "seed", "parameter", "truth", "estimate", "low", "high", "spread", "likelihood", "error"),
    *("identified", "settled", "p_value", "moved", "canary", "leverage", "loop_estimate", "loop_spread", "seconds"),
)


class Walkers:
    """A source of walks; the genuine ones are fixed."""

    def __init__(self, genuine: np.ndarray) -> None:
        self.genuine = genuine

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return walks of models (M, 7), reflected at the ends of the ranges."""
        z = np.clip(np.where(np.abs(models) > 1, np.sign(models) * 2 - models, models), -0.995, 1)
        return Samples(self.genuine, walker.simulate(walker.LOW + HALF * (z + 1), rng)[:, None])


def run(seed: int, recordings: int, trials: int) -> list[dict[str, object]]:
    """Return a row for each parameter, and for gain x noise."""
    started = time.process_time()
    rng = np.random.default_rng([seed, recordings])
    truth = np.tile(walker.TRUTH, (recordings, 1))
    genuine = walker.simulate(truth, rng)
    likelihood, errors = walker.maximum_likelihood(genuine)
    scale = genuine.std(axis=(0, 1)).tolist()
    elman = ElmanClassifier(inputs=2, scale=scale, threads=1)
    pooled = PooledClassifier(inputs=2, scale=scale, threads=1)
    loop = FewTrials(
        Walkers(genuine),
        elman,
        EvolutionStrategy(elman.parameters, seed=(seed, 1)),
        low=-np.ones(7),
        high=np.ones(7),
        trials=trials,
        seed=seed,
        observers=pooled,
        genuine=genuine,
        limits=True,
    )
    for _ in loop:
        pass
    samples = loop.buffer.samples[:, 0].astype(np.float64)
    z = np.clip(loop.buffer.parameters, -1, 1)
    some = np.concatenate((genuine[:500], samples[rng.permutation(len(samples))[: min(500, recordings)]]))
    jury = pooled.draw(JURORS, some, rng)
    solution = match(
        walker.LOW + HALF * (z + 1),
        pooled.judge(jury, samples),
        pooled.judge(jury, genuine),
        low=walker.LOW,
        high=walker.HIGH,
        start=walker.LOW + HALF * (loop.estimate + 1),
        spread=2 * HALF * loop.draws.std(axis=0),
        rng=np.random.default_rng([seed, recordings, 1]),
    )
    seconds = time.process_time() - started
    product = solution.draws[:, 4] * solution.draws[:, 5]
    looped = walker.LOW + HALF * (loop.draws + 1)
    loops = np.c_[looped, looped[:, 4] * looped[:, 5]]
    rows = []
    for k, name in enumerate((*walker.NAMES, "gain x noise")):
        draws = product if k == 7 else solution.draws[:, k]
        low, high = np.quantile(draws, [0.05, 0.95])
        known = k == 7 or bool(solution.identified[k])
        place = {0: 0, 1: 1, 2: 2, 3: 3, 7: 4}.get(k)
        values = (
            recordings, trials, seed, name, 1.2 if k == 7 else walker.TRUTH[k], np.median(draws),
            low if known else walker.LOW[k], high if known else walker.HIGH[k], draws.std(),
            np.nan if place is None else likelihood[place], np.nan if place is None else errors[place],
            known, solution.settled, solution.p_value, solution.moved, solution.canary,
            solution.leverage, np.median(loops[:, k]), loops[:, k].std(), seconds,
        )  # fmt: skip
        rows.append(dict(zip(FIELDS, (f"{v:.5g}" if isinstance(v, float) else v for v in values), strict=True)))
    return rows


def main() -> None:
    """Run what the file lacks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, nargs="+", default=[200])
    parser.add_argument("--seeds", type=int, nargs=2, default=[1, 2])
    parser.add_argument("--trials", type=int, default=3000)
    parser.add_argument("--out", type=Path, default=Path("coverage.csv"))
    given = parser.parse_args()
    done = set()
    if given.out.exists():
        with given.out.open() as file:
            done = {(int(row["recordings"]), int(row["trials"]), int(row["seed"])) for row in csv.DictReader(file)}
    for seed in range(given.seeds[0], given.seeds[1] + 1):
        for recordings in given.recordings:
            if (recordings, given.trials, seed) in done:
                continue
            curves.append(given.out, FIELDS, run(seed, recordings, given.trials))


if __name__ == "__main__":
    main()
