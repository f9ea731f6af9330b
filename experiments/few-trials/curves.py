"""Error over trials of `coevolution.FewTrials`: ``python curves.py CASE TRIALS FIRST LAST``; one row per run in a table.

A run that has its row is not repeated. Cases: aggregation, object-clustering; two-state-N and three-state-N: the agents of
either scenario with random controller number N, wheel speeds uniform in [-1, 1].
"""

import csv
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from turing_learning.classifiers import ElmanClassifier, PooledClassifier
from turing_learning.coevolution import FewTrials
from turing_learning.evolution import EvolutionStrategy
from turing_learning.purposes import CLASSIFIERS
from turing_learning.swarm import SCENARIOS, MixedSwarm, Scenario

HEADER = ("trials", "seed", "mae", "largest_ae", "misfit", "held_90", "cpu_s", "estimate", "spread", "truth")


def system(case: str):
    """Return the scenario of a case."""
    kind, _, number = case.rpartition("-")
    if kind not in ("two-state", "three-state"):
        return SCENARIOS[case]
    base = SCENARIOS["aggregation" if kind == "two-state" else "object-clustering"]
    rng = np.random.default_rng(int(number))
    return replace(base, controller=tuple(rng.uniform(-1, 1, len(base.controller)).tolist()))


def finished(agents: Scenario, trials: int, seed: int) -> FewTrials:
    """Return the loop of a run at its end."""
    classifier = ElmanClassifier(scale=agents.input_scale, threads=1)
    loop = FewTrials(
        MixedSwarm(agents, threads=1),
        classifier,
        EvolutionStrategy(classifier.parameters, seed=(CLASSIFIERS, seed)),
        low=-np.ones(len(agents.controller)),
        high=np.ones(len(agents.controller)),
        trials=trials,
        seed=seed,
        observers=PooledClassifier(scale=agents.input_scale, threads=1),
        groups=agents.model.jumps.groups,
    )
    for _ in loop:
        pass
    return loop


def append(path: Path, header: tuple[str, ...], rows: list[dict]) -> None:
    """Append rows to a table; a new one begins with its header."""
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, header)
        if file.tell() == 0:
            writer.writeheader()
        writer.writerows(rows)


def run(case: str, trials: int, seed: int) -> dict:
    """Return the row of one run."""
    agents, begun = system(case), time.process_time()
    truth, loop = np.array(agents.controller), finished(agents, trials, seed)
    low, high = np.percentile(loop.draws, (5, 95), axis=0)
    error = np.abs(loop.estimate - truth)
    return {
        "trials": trials,
        "seed": seed,
        "mae": f"{error.mean():.5f}",
        "largest_ae": f"{error.max():.4f}",
        "misfit": f"{loop.batch.misfit:.2f}",
        "held_90": f"{((low <= truth) & (truth <= high)).mean():.3f}",
        "cpu_s": f"{time.process_time() - begun:.1f}",
        **{
            name: " ".join(f"{value:.4f}" for value in values)
            for name, values in (("estimate", loop.estimate), ("spread", loop.batch.spread), ("truth", truth))
        },
    }


def main(case: str, trials: int, first: int, last: int) -> None:
    """Compute the rows that are missing."""
    path = Path(__file__).with_name(f"{case.rstrip('-0123456789')}.csv")
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    done = {(row["trials"], row["seed"], row["truth"]) for row in rows}
    truth = " ".join(f"{value:.4f}" for value in system(case).controller)
    for seed in range(first, last + 1):
        if (str(trials), str(seed), truth) in done:
            continue
        row = run(case, trials, seed)
        append(path, HEADER, [row])
        sys.stdout.write(f"{case} {trials} {seed} {row['mae']} {row['cpu_s']}\n")


if __name__ == "__main__":
    main(sys.argv[1], *(int(word) for word in sys.argv[2:5]))
