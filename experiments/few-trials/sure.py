"""How sure the read-out is beside how right: ``python sure.py CASE TRIALS FIRST LAST``, one line for each run.

Cases: those of curves.py, and systems of awkward.py with 25 recordings. The solution is found anew from the trials of the run;
then the model is simulated at the truth and at draws, and the observers judge that. The line says how many parameters lie
within the central 90 % of the draws, and their mean width; and for the broad and the fine fit, at the truth and at draws, the
squared miss of the predicted mean judgment by the variance that is stated of it (1 is right), and whether the truth is trusted.
For runs that settle, with two fits, as those of up to 3,600 trials: of others the fits that are named are not these.
"""

import sys

import awkward
import curves
import numpy as np

import turing_learning as tl
from turing_learning.few_trials import _likelihood, _loop, _matching

RECORDINGS = 25
REPEATS = 100
"""Simulations of each place, whose mean counts as the right one."""
PLACES = 20
"""Draws at which the model is simulated again."""


def kept(owner: object, name: str) -> list[tuple]:
    """Let a function keep its arguments and results; return the list of them."""
    original = getattr(owner, name)
    calls: list[tuple] = []

    def keeping(*args, **options):
        result = original(*args, **options)
        calls.append((args, options, result))
        return result

    setattr(owner, name, keeping)
    return calls


LOOPS = kept(_loop.FewTrials, "__init__")
SOLUTIONS = kept(_loop, "solution")
PREPARED = kept(_matching, "_prepared")
RIDGES = kept(_likelihood, "_ridge")
COMPOSITES = kept(_likelihood.JudgedSamples, "_composite")
CHOSEN = kept(_likelihood.JudgedSamples, "_chosen")
FITS = kept(_likelihood.JudgedSamples, "fit")


def infer(case: str, trials: int, seed: int) -> np.ndarray:
    """Run a case; return its truth (P,) in units of the space of its search."""
    settings = {"run.threads": 1}
    if case not in awkward.SYSTEMS:
        agents = curves.system(case)
        tl.infer(agents, trials=trials, seed=seed, settings=settings)
        return np.array(agents.controller)
    system = awkward.SYSTEMS[case]
    rng = np.random.default_rng([seed, 100, *case.encode()])
    truth = np.array([rng.uniform(low, high) for low, high in system.truths])
    genuine = system.simulate(np.tile(truth, (RECORDINGS, 1)), rng)
    tl.infer(
        genuine=genuine, simulate=system.simulate, parameters=system.ranges, vectorized=True,
        trials=trials, seed=seed, settings=settings,
    )  # fmt: skip
    low, high = np.array(list(system.ranges.values())).T
    return 2 * (truth - low) / (high - low) - 1


def judged(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return what the observers of the run say of new trials (N REPEATS, F) of models (N, P)."""
    loop = LOOPS[-1][0][0]
    models = np.repeat(places, REPEATS, axis=0)
    samples = loop._source.collect(loop._space.to_numbers(models), rng).counterfeit
    return loop._observer_judgments._judged(loop._observer_genomes, samples)


def ratios(number: int, models: np.ndarray, outputs: np.ndarray) -> tuple[float, float, bool]:
    """Return squared misses of a fit by stated variance, and whether the truth is trusted.

    Misses are those at the truth, the first of the models (N, P), and at the others.
    """
    x = PREPARED[-1][0][1]
    varies = x.std(axis=0) > _matching.LEAST_DEVIATION
    scaled = (outputs[:, varies] - x[:, varies].mean(axis=0)) / x[:, varies].std(axis=0)
    stop = len(RIDGES) + (number + 1) * _likelihood.SAMPLE_FOLDS
    composite = 0
    for _, _, (middle, coefficients, offset) in RIDGES[stop - _likelihood.SAMPLE_FOLDS : stop]:
        composite = (
            composite + ((scaled - middle) @ coefficients + offset) / _likelihood.SAMPLE_FOLDS
        )
    # the fit turns and scales composite judgments
    fit = FITS[number][2]
    known = COMPOSITES[number][2][0][CHOSEN[number][2]]
    turned = np.linalg.lstsq(np.c_[np.ones(len(known)), known], fit.outputs, rcond=None)[0]
    new = np.c_[np.ones(len(composite)), composite[:, :-1]] @ turned
    new = new.reshape(len(models), REPEATS, -1)
    mean, variance = fit.emulator.predict(np.c_[models, np.zeros(len(models))])
    squares = (mean - new.mean(axis=1)) ** 2 - new.var(axis=1) / REPEATS
    shares = squares[0].sum() / variance[0].sum(), squares[1:].sum() / variance[1:].sum()
    return *shares, bool(variance[0].mean() <= fit.trust)


def line(case: str, trials: int, seed: int) -> str:
    """Return what is said of a run."""
    SOLUTIONS.clear()
    truth = infer(case, trials, seed)
    (evidence, cloud, _), options, _ = SOLUTIONS[0]
    rng = np.random.default_rng(seed)
    solution = _loop.solution(evidence, cloud, rng, **options)
    low, high = np.quantile(solution.draws, [0.05, 0.95], axis=0)
    held = ((low <= truth) & (truth <= high)).sum()
    text = f"{case} {trials} {seed}: {held} of {len(truth)} hold, width {(high - low).mean():.3f}"
    places = np.r_[truth[None], solution.draws[:: len(solution.draws) // PLACES]]
    outputs = judged(places, rng)
    for number, name in ((-2, "broad"), (-1, "fine")):
        own, drawn, trusted = ratios(number, places / evidence.space.widest, outputs)
        text += f"; {name}: truth {own:.1f}, draws {drawn:.1f}, trusted {trusted}"
    return text


def main(case: str, trials: int, first: int, last: int) -> None:
    """Print the lines of some seeds."""
    for seed in range(first, last + 1):
        sys.stdout.write(f"{line(case, trials, seed)}\n")


if __name__ == "__main__":
    main(sys.argv[1], *(int(word) for word in sys.argv[2:5]))
