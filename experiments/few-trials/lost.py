"""Follow a random three-state controller through a run of 10,000 trials: where do the walkers lose the truth?

    python experiments/few-trials/lost.py 73        # two minutes; 87 is lost as well, until searches find it; 1 and 5 are not

Each batch prints its error, how many walkers and trials are near the truth, and how far the loop's near map rejects the
truth: the mean of the squared standardized moments there, which is 1 on average if the map's variances are right. Every
tenth batch also fits maps to the 300, 600, 1,500 and 3,000 trials nearest to the truth. The last line is the median over
the batches.

Searches of lost runs were chosen on controllers 3 6 7 16 18 24 26 49 55 71 73 74 75 77 86 87 88 90.
"""

import sys

import curves
import numpy as np

from turing_learning.config import load_configuration
from turing_learning.runs import Run

COUNTS = (300, 600, 1500, 3000)


def rejection(field, place: np.ndarray) -> float:
    """Return the mean of the squared standardized moments of a map at one model (P,)."""
    mean, variance = field.predict(place[None])
    return float((mean**2 / (variance + field._noise)).mean())


def follow(seed: int) -> None:
    """Run one controller and print what its batches did."""
    scenario = curves.system(f"three-state-{seed}")
    settings = {"run.trials": 10_000, "run.seed": seed, "run.threads": 1}
    run = Run.begin(load_configuration(overrides=settings, scenario=scenario))
    loop, trials = run._loop, run._loop.trials
    truth = (np.asarray(scenario.controller) - loop._middle) / loop._reach
    rejections = []
    for progress in run:
        walkers, usable = trials._design.walkers, np.flatnonzero(trials.buffer.usable)
        tried = trials.buffer.parameters[usable]
        error = np.abs(progress.estimate - scenario.controller).mean()
        rejections.append(rejection(trials._density.near, truth))
        print(
            f"batch {progress.completed}, {trials.spent} trials: error {error:.3f}, "
            f"walkers near the truth {(np.abs(walkers - truth).mean(axis=1) < 0.15).sum()} of {len(walkers)}, "
            f"trials within 0.1 of it {(np.abs(tried - truth).max(axis=1) < 0.1).sum()}, "
            f"misfit {trials.batch.misfit:.1f}, rejection of the truth {rejections[-1]:.1f}, "
            f"best classifier {progress.scored.classifier_fitness.max():.2f}",
            flush=True,
        )
        if progress.completed % 10 == 0:
            nearest = usable[np.argsort(((tried - truth) ** 2).sum(axis=1))]
            for count in (one for one in COUNTS if one <= len(nearest)):
                field, _ = trials._moment_map(nearest[:count], np.random.default_rng(0))
                print(
                    f"  nearest {count}: rejection of the truth {rejection(field, truth):.1f}",
                    flush=True,
                )
    print(run.result)
    print(
        f"rejection of the truth, median of {len(rejections)} batches: {np.median(rejections):.1f}"
    )


if __name__ == "__main__":
    follow(int(sys.argv[1]))
