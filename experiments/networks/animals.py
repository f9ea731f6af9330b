"""Networks learned from real animals, put to the test: ``python animals.py [learned] [SEED ...]``.

For each recording and seed a network is learned, its gains are inferred by Turing Learning, and both are tested against
held-out windows, and against all: in windows of 5 s and of 20 s. Rows go to animals.csv; what has its rows is not
repeated. With the word `learned` no gains are inferred. The extra `networks` has to be installed. A seed of both
recordings takes some ten minutes of two processors.
"""

import sys
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from table import append_rows, keys_done

import turing_learning as tl
from turing_learning.examination import TuringTest
from turing_learning.families import Network
from turing_learning.trajectories import Trajectories, Windows

HERE = Path(__file__).parent
TRACKTOR = HERE.parents[1] / "tests" / "reference" / "data" / "tracktor"
PATH = HERE / "animals.csv"
SIGNALS = ("speed", "turn", "neighbor_distance")
WINDOWS_S = (5, 20)
TRIALS = 3000
SIMULATED = 200
"""Groups that are simulated, a sample of each, for a test."""
PERMUTATIONS = 99
"""Exchanges of labels in a test."""
BLOCK_S = 20
"""Windows of real animals that begin within so long (s) are of one group: they were recorded at the same time."""
FORM = "0078"
"""The decision that says how networks of these rows move; the code of earlier ones is not there any more."""
FIELDS = (
    "form", "recording", "seed", "model", "window_s", "against", "real_windows", "accuracy", "low", "high", "p_value", "auc",
    "power_accuracy", "learning_s", "gains",
)  # fmt: skip


def recordings() -> dict[str, Trajectories]:
    """Return both recordings at about ten frames a second; rate and scale of the fish are assumptions."""
    fish = tl.load_trajectories(
        TRACKTOR / "zebrafish_video_idtracked.txt", fps=30, pixels_per_cm=20
    )
    termites = tl.load_trajectories(
        TRACKTOR / "termite_video_idtracked.txt", fps=25, pixels_per_cm=20
    )
    return {
        "zebrafish": fish.bridged(max_gap=5).thinned(3),
        "termites": termites.bridged(max_gap=5).thinned(2),
    }


def tested(
    network: Network, gains: dict[str, float], windows: Windows, against: str, seed: int
) -> TuringTest:
    """Put free-running groups with these gains to the test."""
    rng = np.random.default_rng([seed, 7])
    values = np.tile([gains[name] for name in network.parameters], (SIMULATED, 1))
    steps = windows.learning.shape[1]
    simulated = replace(network, steps=steps, settling_steps=steps)(values, rng)[:, 0]
    block = round(BLOCK_S / windows.interval_s)
    real, index = windows.held_out, windows.held_out_index
    if against == "all":
        real = np.concatenate([windows.learning, real])
        index = np.concatenate([windows.learning_index, index])
    groups = index[:, 1] // block
    return tl.test(
        real,
        simulated,
        groups=(groups, np.arange(len(simulated))),
        names=windows.names,
        seed=seed,
        permutations=PERMUTATIONS,
    )


def rows(
    name: str, cut: dict[int, Windows], network: Network, seconds: float, seed: int, model: str
) -> list[dict[str, object]]:
    """Return the rows of one recording, cut into windows, of a network that was learned in so many s, and of a model."""
    gains = dict.fromkeys(network.parameters, 1.0)
    if model == "gains":
        result = tl.infer(
            genuine=cut[5],
            simulate=network,
            parameters=network.parameters,
            seed=seed,
            trials=TRIALS,
        )
        gains = dict(result.estimate)
    table = []
    for length, windows in cut.items():
        # a few held-out windows of 20 s say nothing
        for against in ("held out", "all") if length == WINDOWS_S[0] else ("all",):
            real = len(windows.held_out) + (len(windows.learning) if against == "all" else 0)
            try:
                test = tested(network, gains, windows, against, seed)
            except ValueError as error:
                print(f"{name}, {length} s, {against}: {error}")
                continue
            examined = test.examined
            low, high = examined.interval
            # nothing would have been noticed by so few groups
            power = np.nan if examined.power_accuracy is None else examined.power_accuracy
            table.append({
                "form": FORM, "recording": name, "seed": seed, "model": model, "window_s": length, "against": against,
                "real_windows": real, "accuracy": f"{test.accuracy:.3f}", "low": f"{low:.3f}", "high": f"{high:.3f}",
                "p_value": f"{test.p_value:.3f}", "auc": f"{examined.auc:.3f}",
                "power_accuracy": f"{power:.3f}", "learning_s": round(seconds),
                "gains": " ".join(f"{key}={value:.2f}" for key, value in gains.items()),
            })  # fmt: skip
            print(table[-1], flush=True)
    return table


def main() -> None:
    """Write the rows that are missing."""
    words = sys.argv[1:]
    models = ["as learned"]
    if "learned" in words:
        words.remove("learned")
    else:
        models.append("gains")
    done = keys_done(PATH, ("form", "recording", "seed", "model"))
    for seed, (name, recording) in product(map(int, words or (1, 2, 3)), recordings().items()):
        missing = [model for model in models if (FORM, name, str(seed), model) not in done]
        if not missing:
            continue
        cut = {length: recording.windows(length_s=length, signals=SIGNALS) for length in WINDOWS_S}
        begun = time.perf_counter()
        network = Network.learned(recording, cut[5], seed=seed)
        seconds = time.perf_counter() - begun
        for model in missing:
            append_rows(PATH, FIELDS, rows(name, cut, network, seconds, seed, model))


if __name__ == "__main__":
    main()
