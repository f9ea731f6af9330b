"""Intervals of `match` on swarms: ``python readout.py CASE TRIALS FIRST LAST``, cases as in curves.py; a row for each parameter.

A run that has its rows is not repeated.
"""

import csv
import sys
import time
from pathlib import Path

import curves
import numpy as np

from turing_learning.analysis import match
from turing_learning.classifiers import PooledClassifier

JURORS, LIMIT = 300, 1.5
FIELDS = (
    *("case", "trials", "seed", "parameter", "truth", "estimate", "low", "high", "identified", "settled", "p_value"),
    *("moved", "canary", "leverage", "loop_estimate", "loop_low", "loop_high", "seconds"),
)


def run(case: str, trials: int, seed: int) -> list[dict[str, object]]:
    """Return the rows of one run."""
    agents, begun = curves.system(case), time.process_time()
    truth = np.array(agents.controller)
    pooled, loop = PooledClassifier(scale=agents.input_scale, threads=1), curves.finished(agents, trials, seed)
    rng = np.random.default_rng([seed, trials])
    usable = loop.buffer.usable
    samples, genuine = loop.buffer.samples[usable], loop.buffer.genuine.astype(np.float64)
    parameters = np.repeat(loop.buffer.parameters[usable], samples.shape[1], axis=0)
    samples = samples.reshape(-1, *samples.shape[2:]).astype(np.float64)
    inside = (np.abs(parameters) <= LIMIT).all(axis=1)
    parameters, samples = parameters[inside], samples[inside]
    jury = pooled.draw(JURORS, np.concatenate((genuine[:500], samples[-500:])), rng)
    solution = match(
        parameters,
        pooled.judge(jury, samples),
        pooled.judge(jury, genuine),
        low=np.full(len(truth), -LIMIT),
        high=np.full(len(truth), LIMIT),
        start=np.clip(loop.estimate, -LIMIT, LIMIT),
        spread=2 * loop.draws.std(axis=0) + 0.02,
        rng=rng,
    )
    low, high = np.quantile(solution.draws, [0.05, 0.95], axis=0)
    loop_low, loop_high = np.quantile(loop.draws, [0.05, 0.95], axis=0)
    common = (solution.settled, solution.p_value, solution.moved, solution.canary, solution.leverage)
    seconds = time.process_time() - begun
    rows = []
    for k in range(len(truth)):
        values = (case, trials, seed, k, truth[k], solution.estimate[k], low[k], high[k], bool(solution.identified[k]))
        more = (*values, *common, loop.estimate[k], loop_low[k], loop_high[k], seconds)
        rows.append(dict(zip(FIELDS, (f"{v:.5g}" if isinstance(v, float) else v for v in more), strict=True)))
    return rows


def main() -> None:
    """Run what the table lacks."""
    case, trials, first, last = sys.argv[1], *map(int, sys.argv[2:5])
    path = Path(sys.argv[5] if len(sys.argv) > 5 else "readout.csv")
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    done = {(row["case"], int(row["trials"]), int(row["seed"])) for row in rows}
    for seed in range(first, last + 1):
        if (case, trials, seed) not in done:
            curves.append(path, FIELDS, run(case, trials, seed))


if __name__ == "__main__":
    main()
