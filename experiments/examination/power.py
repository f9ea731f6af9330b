"""Planted differences: how well do the panel, its members and other classifiers tell them, and is the right thing named?

Run with ``python experiments/examination/power.py``; it writes power.csv. MiniRocket is that of aeon, if it is installed
(``pip install aeon``). Seeds differ from those with which the panel was built.
"""

import csv
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression, RidgeClassifierCV
from sklearn.model_selection import cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import turing_learning as tl
from turing_learning.examination import PANEL
from turing_learning.families import BurstAndCoast, Couzin

TABLE = Path(__file__).parent / "power.csv"
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


def main() -> None:
    """Write a row for each planted difference that has none yet."""
    names = ["gradient boosting", "logistic regression", "MiniRocket"]
    headings = [
        "difference",
        "panel",
        "p_value",
        "power_accuracy",
        "seconds",
        *names,
        "named",
        "right",
    ]
    rows = list(csv.reader(TABLE.open())) if TABLE.exists() else [headings]
    done = {row[0] for row in rows}
    for name, signals, words, real, simulated in planted(np.random.default_rng(4521)):
        if name in done:
            continue
        begin = time.process_time()
        found = tl.test(real, simulated, names=signals, examiners=PANEL)
        seconds = time.process_time() - begin
        labels = np.repeat([True, False], SAMPLES)
        beside = others(np.concatenate((real, simulated)), labels, signals)
        first = found.telling[0].what
        right = any(word in first for word in words)
        power = found.examined.power_accuracy or float("nan")
        numbers = [
            f"{found.accuracy:.3f}",
            f"{found.p_value:.2f}",
            f"{power:.3f}",
            f"{seconds:.0f}",
        ]
        numbers += [f"{beside[key]:.3f}" if key in beside else "" for key in names]
        rows.append([name, *numbers, first, "yes" if right else "no"])
        with TABLE.open("w") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
