"""Planted differences, each drawn several times: how well do the panel and others tell them, and is the right thing named?

Run with ``python experiments/examination/power.py [DRAWS]``; it adds what is missing in power-draws.csv, and writes power.csv,
the medians. MiniRocket is that of aeon, if it is installed (``pip install aeon``). The jury is that of `check` in version
0.2.0: evolved Elman networks with its effort, 300 generations of 60 classifiers. Seeds differ from those with which the panel
was built.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression, RidgeClassifierCV
from sklearn.model_selection import cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from turing_learning.analysis import Jury
from turing_learning.classifiers import ElmanClassifier
from turing_learning.coevolution import Judgments, classifier_reward
from turing_learning.evolution import EvolutionStrategy
from turing_learning.examination import PANEL, telling_statistics
from turing_learning.examination._panel import Views, right_answers
from turing_learning.examination._panel import _cross_fitted as cross_fitted
from turing_learning.families import BurstAndCoast, Couzin

HERE = Path(__file__).parent
ROWS, MEDIANS = HERE / "power-draws.csv", HERE / "power.csv"
DRAWS = 6
SEED = 4521
"""Of the first draw; the others have the next numbers."""

GENERATIONS, POPULATION = 300, 60
"""Effort of the jury."""

FOLDS = 5

COLUMNS = (
    "panel",
    "gradient boosting",
    "logistic regression",
    "MiniRocket",
    "jury of 0.2.0",
    "jury, by majority",
)

SAMPLES = 150
"""Of each side."""
WALK = ("speed", "turn")
SHOAL = ("speed", "turn", "neighbor_distance")


def walks(mean: float, noise: float, rng: np.random.Generator) -> np.ndarray:
    """Return walks (K, 50, 2) with a mean speed and a spread of turns."""
    speed = mean + rng.standard_normal((SAMPLES, 50))
    return np.stack([speed, noise * rng.standard_normal((SAMPLES, 50))], axis=-1)


def shoals(rng: np.random.Generator, **changed: float) -> np.ndarray:
    """Return samples (K, 50, 3) of one fish of each Couzin group."""
    family = Couzin(
        individuals=6, steps=50, interval_s=0.1, signals=SHOAL, settling_steps=50, tank_cm=(30, 30)
    )
    truth = {
        "speed": 5.0,
        "turning_rate": 3.0,
        "repulsion_radius": 1.0,
        "orientation_width": 3.0,
        "attraction_width": 8.0,
        "noise": 0.1,
    }
    return family.observe(truth | changed, groups=SAMPLES, rng=rng)


def bursts(rng: np.random.Generator, factor: float = 1.0) -> np.ndarray:
    """Return samples (K, 50, 2) of burst and coast whose turns are larger by a factor."""
    family = BurstAndCoast(individuals=1, steps=50, interval_s=0.1, settling_steps=50)
    truth = {"speed": 8.0, "kick_interval": 0.8, "glide_time": 1.2, "turn": 0.7 * factor}
    return family.observe(truth, groups=SAMPLES, rng=rng)


def coupled(rng: np.random.Generator, delay: int = 0) -> np.ndarray:
    """Return samples (K, 50, 2): speed rises suddenly and decays, and turns follow it, as many steps later."""
    steps = 80
    kicks = (rng.random((SAMPLES, steps)) < 0.1) * rng.exponential(3.0, (SAMPLES, steps))
    speed = np.zeros((SAMPLES, steps))
    for step in range(1, steps):
        speed[:, step] = 0.8 * speed[:, step - 1] + kicks[:, step]
    turn = 0.6 * speed + 0.8 * rng.standard_normal((SAMPLES, steps))
    speed = speed + 0.2 * rng.standard_normal((SAMPLES, steps))
    return np.stack([speed, np.roll(turn, delay, axis=1)], axis=-1)[:, 30:]


def planted(
    rng: np.random.Generator,
) -> Iterator[tuple[str, tuple[str, ...], tuple[str, ...], np.ndarray, np.ndarray]]:
    """Yield name, signals, words of which one must be named, and samples of both sides."""
    for share in (0.1, 0.2, 0.4):
        name = f"walker, speed and turns off by {share:.0%}"
        yield name, WALK, ("speed", "turn"), walks(1, 1, rng), walks(1 + share, 1 + share, rng)
    for share in (0.1, 0.2, 0.4):
        name = f"Couzin, turning rate off by {share:.0%}"
        yield (
            name,
            SHOAL,
            ("turn", "straight"),
            shoals(rng),
            shoals(rng, turning_rate=3 * (1 + share)),
        )
    for share in (0.1, 0.2, 0.4):
        name = f"burst and coast, turns off by {share:.0%}"
        yield name, WALK, ("turn", "straight"), bursts(rng), bursts(rng, 1 + share)
    noisy = shoals(rng)
    noisy += 0.05 * noisy.std(axis=(0, 1)) * rng.standard_normal(noisy.shape)
    yield (
        "noise of the tracker",
        SHOAL,
        ("change", "spread", "rhythm", "persistence"),
        shoals(rng),
        noisy,
    )
    yield "a delay of 0.3 s", WALK, ("and",), coupled(rng), coupled(rng, 3)
    backward = coupled(rng)
    backward[..., 0] = backward[:, ::-1, 0].copy()
    yield "one signal reversed in time", WALK, ("asymmetry of rises",), coupled(rng), backward
    apart = coupled(rng)
    apart[..., 1] = coupled(rng)[..., 1]
    yield "correlation removed", WALK, ("and",), coupled(rng), apart


def others(windows: np.ndarray, labels: np.ndarray, names: tuple[str, ...]) -> dict[str, float]:
    """Return accuracies of what anybody would take: cross-validated, on window statistics or by MiniRocket."""
    from turing_learning.examination._statistics import named_statistics

    table = named_statistics(windows, names, 0.1)[1]
    judges = {
        "gradient boosting": HistGradientBoostingClassifier(),
        "logistic regression": make_pipeline(
            StandardScaler(), LogisticRegression(C=0.1, max_iter=1000)
        ),
    }
    found = {
        name: float((cross_val_predict(judge, table, labels, cv=5) == labels).mean())
        for name, judge in judges.items()
    }
    try:
        from aeon.transformations.collection.convolution_based import MiniRocket
    except ImportError:
        return found
    features = MiniRocket(random_state=0).fit_transform(windows.swapaxes(1, 2).astype(np.float32))
    judge = make_pipeline(
        StandardScaler(with_mean=False), RidgeClassifierCV(alphas=np.logspace(-3, 3, 10))
    )
    found["MiniRocket"] = float((cross_val_predict(judge, features, labels, cv=5) == labels).mean())
    return found


def evolved(samples: np.ndarray, genuine: np.ndarray, seed: int) -> Jury:
    """Evolve a jury on samples (K, T, D): `train_jury` of version 0.2.0, with the center and scale of its systems."""
    center = np.median(samples[genuine], axis=(0, 1))
    scale = np.quantile(np.abs(samples[genuine] - center), 0.99, axis=(0, 1))
    network = ElmanClassifier(samples.shape[2], scale=scale.tolist(), threads=1)
    classifier = Centered(network, center)
    half = POPULATION // 2
    strategy = EvolutionStrategy(
        network.parameters, parents=half, offspring=POPULATION - half, seed=seed
    )

    def rewarded() -> tuple[np.ndarray, np.ndarray]:
        genomes = strategy.ask()
        outputs = classifier.judge(genomes, samples)
        return genomes, classifier_reward(
            Judgments(outputs[:, genuine], outputs[:, ~genuine, None])
        )

    for _ in range(GENERATIONS):
        strategy.tell(rewarded()[1])
    genomes, reward = rewarded()
    informedness = 2 * reward - 1
    best = np.argsort(-informedness, kind="stable")[:half]
    voters = best[informedness[best] > 0]
    weights = informedness[voters] / max(informedness[voters].sum(), 1e-12)
    return Jury(classifier, genomes[voters], weights)


class Centered:
    """Classifiers that see samples around a center (D,)."""

    def __init__(self, network: ElmanClassifier, center: np.ndarray) -> None:
        self.network = network
        self.center = center
        self.parameters = network.parameters

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return outputs (N, S)."""
        return self.network.judge(genomes, samples - self.center)


def jury(windows: np.ndarray, genuine: np.ndarray, seed: int) -> tuple[float, float]:
    """Return the cross-fitted accuracy of juries by the share of votes, as `check` said it, and by majority."""
    fold = np.random.default_rng(seed).permutation(len(windows)) % FOLDS
    share = np.empty(len(windows))
    for part in range(FOLDS):
        out = fold == part
        judges = evolved(windows[~out], genuine[~out], FOLDS * seed + part)
        share[out] = judges.score(windows[out])
    right = np.where(genuine, share, 1 - share)
    return float(right.mean()), float((right > 0.5).mean())


def panel(windows: np.ndarray, genuine: np.ndarray, names: tuple[str, ...]) -> float:
    """Return the accuracy that `test` states, without the permutations, which take most of its time."""
    views = Views.of(windows, names, 0.1, PANEL, 0)
    groups = np.arange(len(windows))
    labels = genuine[:, None].astype(float)
    accuracies = []
    for examiner in PANEL:
        scores = cross_fitted(examiner, views.standardized[examiner.sees], labels, groups)
        accuracies.append(right_answers(scores, labels, groups).mean())
    return float(max(accuracies))


def row(real: np.ndarray, simulated: np.ndarray, names: tuple[str, ...], draw: int) -> list[str]:
    """Return the accuracies of all on one draw, and which statistic is named first."""
    genuine = np.repeat([True, False], SAMPLES)
    windows = np.concatenate((real, simulated))
    beside = others(windows, genuine, names)
    accuracies = [panel(windows, genuine, names), *map(beside.get, COLUMNS[1:4])]
    accuracies += jury(windows, genuine, draw)
    cells = []
    for accuracy in accuracies:
        cells.append("" if accuracy is None else f"{accuracy:.3f}")
    named = telling_statistics(real, simulated, np.arange(SAMPLES), names=names, units={})[0]
    return [*cells, named.what]


def main() -> None:
    """Do what is missing, and write the medians."""
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS
    rows = list(csv.reader(ROWS.open())) if ROWS.exists() else []
    done = {(row[0], int(row[1])) for row in rows}
    for draw in range(draws):
        for name, signals, words, real, simulated in planted(np.random.default_rng(SEED + draw)):
            if (name, draw) in done:
                continue
            cells = row(real, simulated, signals, draw)
            right = any(word in cells[-1] for word in words)
            cells.append("yes" if right else "no")
            with ROWS.open("a") as file:
                csv.writer(file, lineterminator="\n").writerow([name, draw, *cells])
    write_medians(list(csv.reader(ROWS.open())))


def write_medians(rows: list[list[str]]) -> None:
    """Write the median accuracies over the draws, and in how many of them the right statistic is named first."""
    with MEDIANS.open("w") as file:
        writer = csv.writer(file, lineterminator="\n")
        more = ["panel above the best of three", "named in the first draw", "rightly named"]
        writer.writerow(["difference", "draws", *COLUMNS, *more])
        for name in dict.fromkeys(row[0] for row in rows):
            own = [row[2:] for row in rows if row[0] == name]
            medians = []
            for place in range(len(COLUMNS)):
                values = [float(cells[place] or np.nan) for cells in own]
                medians.append(float(np.median(values)))
            lead = medians[0] - np.nanmax(medians[1:4])
            right = sum(cells[-1] == "yes" for cells in own)
            shown = [f"{median:.3f}" for median in medians]
            writer.writerow([name, len(own), *shown, f"{lead:+.3f}", own[0][-2], right])


if __name__ == "__main__":
    main()
