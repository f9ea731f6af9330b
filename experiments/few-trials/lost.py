"""Follow a random three-state controller through a run of 10,000 trials: where do the walkers lose the truth?

    python experiments/few-trials/lost.py 73        # about a minute; also 87

Every batch prints how many walkers are near the truth, how many trials were, and the misfit of the near map. Batches 10,
20, 30 and 40 also fit a map to the nearest 300, 600, 1,500 and 3,000 trials, and print how far it rejects the truth: the
mean of squared standardized moments there, 1 if the stated variances hold.
"""

import sys

import curves
import numpy as np

from turing_learning.coevolution._moments import train_moments
from turing_learning.evolution._field import MomentField
from turing_learning.runs import _loops


def follow(seed: int) -> None:
    """Run one controller and print what its batches did."""
    name = f"three-state-{seed}"
    truth = np.asarray(curves.system(name).controller)
    step = _loops.TrialsLoop.step

    def observed(loop):
        result = step(loop)
        trials, right = loop.trials, (truth - loop._middle) / loop._reach
        walkers, tried = trials._design.walkers, trials.buffer.parameters
        there = (np.abs(walkers - right).mean(axis=1) < 0.15).sum()
        close = (np.abs(tried - right).max(axis=1) < 0.1).sum()
        print(
            f"batch {result.number}: {trials.spent} trials, error {np.abs(result.estimate - truth).mean():.3f}, "
            f"{there} of {len(walkers)} walkers at the truth, {close} trials within 0.1, "
            f"misfit {trials._density.near.misfit:.1f}, best classifier {result.classifier_fitness.max():.2f}",
            flush=True,
        )
        if result.number % 10 == 0 and result.number > 0:
            seen, genuine = trials._seen.astype(float), trials._seen_genuine.astype(float)
            order = np.argsort(((tried - right) ** 2).sum(axis=1))
            for count in (300, 600, 1500, 3000):
                rng, near = np.random.default_rng(0), order[:count]
                moments = train_moments(tried[near], seen[near], genuine, rng)
                field = MomentField(tried[near], moments.values, 1 / len(genuine), rng)
                mean, variance = field.predict(right[None])
                rejected = (mean**2 / (variance + 1 / len(genuine))).mean()
                print(f"  nearest {count}: squared standardized moments at the truth {rejected:.1f}", flush=True)
        return result

    _loops.TrialsLoop.step = observed
    print(curves.run(name, 10_000, seed))


if __name__ == "__main__":
    follow(int(sys.argv[1]))
