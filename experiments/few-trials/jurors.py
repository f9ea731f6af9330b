"""Judges on window statistics beside the random observers: ``python jurors.py SET FIRST LAST ARM...``.

The loop, its map and the matching stay as they are. What changes is who judges at random:

* ``default``: the 200 observers of every run;
* ``statistics``: 200 judges on the named statistics of `analysis` instead;
* ``both``: the 200 observers, and 200 of these judges;
* ``more``: 400 observers. They are random convolutions, each with its mean. So this arm says what
  a larger number is worth.

Sets of cases, with the seeds FIRST to LAST and 1000 trials in each run:

* ``untuned``, on which nothing was tuned: every third of the systems of blind_systems.py and
  further_systems.py by name, of those with one solution and 20 to 200 steps, 25 recordings; two
  families of examples/recovery.py; aggregation;
* ``signals``: all other such systems of three signals or more, those of awkward_systems.py, too.
  They ask again what was seen of the first set: judges on statistics help where signals are several.

Rows go to jurors.csv; a run that has its rows is not repeated. ``python jurors.py`` alone prints
arms beside each other, in pairs of runs.
"""

import sys
import time
from collections.abc import Iterable
from pathlib import Path

import awkward
import cases
import curves
import numpy as np
import pandas as pd
from scipy.special import expit

from turing_learning.analysis import statistics
from turing_learning.few_trials import FewTrials, PooledClassifier, _loop, _observers

PATH = Path(__file__).with_name("jurors.csv")
TRIALS = 1000
RECORDINGS = 25
STEPS = range(20, 201)
FAMILIES = ("burst-and-coast", "couzin")
COUNTS = {"default": (200, 0), "statistics": (0, 200), "both": (200, 200), "more": (400, 0)}
"""Arm -> numbers of observers and of judges on statistics."""
GROUPS = ("untuned", "signals")
PAIRS = (("default", "statistics"), ("default", "both"), ("default", "more"), ("more", "both"))
"""Arms that are held beside each other."""
WIDEST = 600
"""Statistics of a sample, at most."""
NAMED = 0.5
"""Share of the judges that look at one statistic, at most."""
STILL = 1e-9
"""Standard deviation of a statistic up to which it says nothing."""
FIELDS = (
    "case",
    "seed",
    "arm",
    "parameter",
    "truth",
    "estimate",
    "low",
    "high",
    "error",
    "half_width",
    "verdict",
    "cpu_s",
)


def statistics_of(samples: np.ndarray) -> np.ndarray:
    """Return all statistics (S, F) of samples (S, T, D)."""
    samples = np.asarray(samples, dtype=float)
    columns = [
        statistics.signal_statistics(samples),
        statistics.signal_trends(samples),
        statistics.rhythm_statistics(samples),
    ]
    return np.nan_to_num(np.concatenate(columns, axis=1))


class Judges:
    """Observers, and logistic judges on statistics.

    A genome is its kind, 0 for an observer, and what that kind needs: of a judge the threshold and
    a weight for each statistic.

    Judges are of two sorts. One looks at a single statistic, in standard deviations of the genuine
    samples around their mean. The other looks at a random sum of all statistics, in standard
    deviations of the genuine samples or of all samples in turn; its steepness and its threshold are
    drawn as those of observers of few windows.
    """

    parameters = 2 + WIDEST

    def __init__(self, observers: PooledClassifier, arm: str, genuine: np.ndarray | None) -> None:
        self._observers = observers
        self._counts = COUNTS[arm]
        self._genuine = genuine
        self._begun = False

    def draw(self, count: int, samples: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return genomes (count, Q); those that replace others are of both kinds, as at first."""
        observing = round(count * self._counts[0] / sum(self._counts))
        genomes = np.zeros((count, self.parameters))
        width = self._observers.parameters
        genomes[:observing, 1 : 1 + width] = self._observers.draw(observing, samples, rng)
        judges = genomes[observing:]
        judges[:, 0] = 1
        if len(judges):
            self._fill(judges, samples, rng)
        self._begun = True
        return genomes

    def _fill(self, judges: np.ndarray, samples: np.ndarray, rng: np.random.Generator) -> None:
        """Draw judges into rows (N, Q)."""
        # Genuine samples stand at the end, as many as others where they come with the trials.
        genuine = self._genuine
        if genuine is None:
            genuine = samples[len(samples) // 2 :]
        seen = statistics_of(samples)
        known = statistics_of(genuine)
        deviations = [known.std(axis=0), seen.std(axis=0)]
        told = np.flatnonzero(deviations[1] > STILL)
        named = np.flatnonzero((deviations[0] > STILL) & (deviations[1] > STILL))
        named = rng.permutation(named)[: int(NAMED * len(judges))]
        # Judges that are drawn anew look at sums: those of single statistics would be the same again.
        if self._begun:
            named = named[:0]
        for judge, column in zip(judges, named, strict=False):
            weight = 1 / deviations[0][column]
            judge[1] = -weight * known[:, column].mean()
            judge[2 + column] = weight
        for number, judge in enumerate(judges[len(named) :]):
            deviation = deviations[number % 2][told]
            deviation = np.where(deviation > STILL, deviation, deviations[1][told])
            gain = np.exp(rng.uniform(*np.log(_observers.FLAT_GAINS)))
            weights = gain * rng.standard_normal(len(told)) / np.sqrt(len(told)) / deviation
            judge[1] = -weights @ seen[rng.integers(len(seen)), told]
            judge[2 + told] = weights

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return outputs (N, S), 0 to 1."""
        outputs = np.empty((len(genomes), len(samples)), np.float32)
        observing = genomes[:, 0] == 0
        width = self._observers.parameters
        outputs[observing] = self._observers.judge(genomes[observing, 1 : 1 + width], samples)
        judges = genomes[~observing]
        if len(judges) and len(samples):
            features = statistics_of(samples)
            weights = judges[:, 2 : 2 + features.shape[1]]
            outputs[~observing] = expit(weights @ features.T + judges[:, 1:2])
        return outputs


def put_in(arm: str) -> None:
    """Let all runs from now on have the judges of an arm."""
    _loop.OBSERVERS = sum(COUNTS[arm])

    def begin(self: FewTrials, *parts: object, **options: object) -> None:
        options["observers"] = Judges(options["observers"], arm, options["genuine"])
        BEGIN(self, *parts, **options)

    FewTrials.__init__ = begin


BEGIN = FewTrials.__init__


def eligible(names: Iterable[str], signals: int) -> list[str]:
    """Return the systems of one solution and so many signals or more, by name."""
    chosen = []
    for name in sorted(names):
        system = awkward.SYSTEMS[name]
        middle = {}
        for key, ends in zip(system.ranges, system.truths, strict=True):
            middle[key] = sum(ends) / 2
        sample = system.simulate(np.array([list(middle.values())]), np.random.default_rng(0))[0]
        single = len(system.solutions(middle)) == 1
        if single and len(sample) in STEPS and sample.shape[1] >= signals:
            chosen.append(name)
    return chosen


def cases_of(group: str) -> list[str]:
    """Return the cases of a set."""
    systems = eligible(awkward.SETS["blind"] | awkward.SETS["further"], 1)[::3]
    if group == "signals":
        return [name for name in eligible(awkward.SYSTEMS, 3) if name not in systems]
    return [*systems, *FAMILIES, "aggregation"]


def run(case: str, seed: int, arm: str) -> list[dict[str, object]]:
    """Return a row for each parameter; errors and half-widths are shares of the range."""
    put_in(arm)
    if case in awkward.SYSTEMS:
        found = awkward.run(case, TRIALS, RECORDINGS, seed)
        widths = {key: high - low for key, (low, high) in awkward.SYSTEMS[case].ranges.items()}
    else:
        found = cases.run(case, TRIALS, seed)
        widths = dict.fromkeys((row["parameter"] for row in found), 2.0)
        if case in FAMILIES:
            parameters = cases.recovery.CASES[case].family.parameters
            widths = {key: one.high - one.low for key, one in parameters.items()}
    rows = []
    for row in found:
        truth, estimate, low, high = (
            float(row[key]) for key in ("truth", "estimate", "low", "high")
        )
        width = widths[row["parameter"]]
        kept = {key: row[key] for key in FIELDS if key in row}
        shares = {
            "error": f"{abs(estimate - truth) / width:.6g}",
            "half_width": f"{(high - low) / 2 / width:.6g}",
        }
        rows.append(kept | {"case": case, "arm": arm} | shares)
    return rows


def compared(rows: pd.DataFrame, arm: str, other: str) -> str:
    """Return what two arms say of the same cases and seeds, in words and ratios."""
    keys = ["case", "seed"]
    pairs = rows[rows.arm == arm].merge(
        rows[rows.arm == other], on=[*keys, "parameter"], suffixes=("", "_2")
    )
    both = pairs.stated & pairs.stated_2
    errors = pairs.groupby(keys)[["error", "error_2"]].mean()
    widths = pairs[both].groupby(keys)[["half_width", "half_width_2"]].mean()
    seconds = pairs.groupby(keys)[["cpu_s", "cpu_s_2"]].first()
    text = [
        f"{other} / {arm}, {len(errors)} pairs of runs: intervals that hold "
        f"{pairs.held_2.sum()} of {pairs.stated_2.sum()} / {pairs.held.sum()} of "
        f"{pairs.stated.sum()}; of {both.sum()} that both state {pairs.held_2[both].sum()} / "
        f"{pairs.held[both].sum()}"
    ]
    for name, table in (("error", errors), ("half-width", widths), ("processor time", seconds)):
        logs = np.log(table.iloc[:, 1] / table.iloc[:, 0])
        cells = [f"{case} {np.exp(log):.2f}" for case, log in logs.groupby("case").mean().items()]
        text.append(
            f"  {name}: median {table.iloc[:, 1].median():.4f} / {table.iloc[:, 0].median():.4f}, "
            f"ratio {np.exp(logs.mean()):.3f}, standard error of its logarithm {logs.sem():.3f}, "
            f"of that of cases {logs.groupby('case').mean().sem():.3f}; {', '.join(cells)}"
        )
    return "\n".join(text)


def summary() -> str:
    """Return what the table says of pairs of arms; errors and widths are means over parameters."""
    rows = pd.read_csv(PATH)
    rows["stated"] = rows.low.notna()
    rows["held"] = (rows.low <= rows.truth) & (rows.truth <= rows.high)
    text = []
    for group in GROUPS:
        chosen = rows[rows.case.isin(cases_of(group))]
        for arm, other in PAIRS:
            if {arm, other} <= set(chosen.arm):
                text.append(f"{group}: {compared(chosen, arm, other)}")
    return "\n".join(text) + "\n"


def main() -> None:
    """Run what the table lacks, or print what it holds."""
    if len(sys.argv) < 5:
        sys.stdout.write(summary())
        return
    first, last = map(int, sys.argv[2:4])
    done = []
    if PATH.exists():
        done = pd.read_csv(PATH)[["case", "seed", "arm"]].drop_duplicates().values.tolist()
    for seed in range(first, last + 1):
        for case in cases_of(sys.argv[1]):
            for arm in sys.argv[4:]:
                if [case, seed, arm] not in done:
                    begun = time.process_time()
                    curves.append(PATH, FIELDS, run(case, seed, arm))
                    seconds = time.process_time() - begun
                    sys.stdout.write(f"{case} {seed} {arm} {seconds:.1f} s\n")
                    sys.stdout.flush()


if __name__ == "__main__":
    main()
