"""Gains of simulated animals whose attraction was halved: ``python gains.py CASES [ANIMALS]``.

A network learns from ten minutes of six animals of a composed family. Then other animals are recorded for ten minutes,
and the gains of the network are inferred from them with the usual settings. Of which animals:

* *network*: those that the network itself moves with half of the attraction. The truth of all gains is known.
* *elsewhere*: as *network*, but groups of models begin as in the recording that was learned from, not as in this one.
* *samples*: the same animals again, but each window is of a group of its own that begins as in what was learned from.
* *begun*: the same, but the groups begin as in the recording. So the model with the true gains is exactly right.
* *form of 0063*: as *network*, before decision 0064. Its code is not there any more.
* *equations*: those of the family, whose attraction was halved. Whether that is a gain of 0.5 is not known beforehand.

Each case is a recording and a run with seeds of their own. Rows go to gains.csv, one for each case and gain; what is
there is not done again. The extra `networks` has to be installed.
"""

import sys
from pathlib import Path

import numpy as np
from table import append_rows, keys_done

import turing_learning as tl
from turing_learning.families import Composed, Network, virtual_group
from turing_learning.trajectories import Trajectories, Windows

HERE = Path(__file__).parent
PATH = HERE / "gains.csv"
RECORDED_S = 600.0
WINDOW_S = 4.0
SIGNALS = ("speed", "turn", "neighbor_distance", "neighbor_bearing")
"""As of the command."""
FAMILY = Composed(
    individuals=6, interval_s=0.1, tank_cm=(40.0, 30.0), settling_steps=3000,
    parts=("kicks", "walls", "social"),
)  # fmt: skip
TRUTH = {
    "speed": 12.0, "kick_interval": 0.6, "glide_time": 0.6, "turn": 0.4, "bend": 0.3,
    "wall_turning": 4.0, "wall_distance": 4.0,
    "attraction": 2.0, "alignment": 1.0, "balance_distance": 3.0, "social_range": 12.0,
}  # fmt: skip
HALVED = 0.5
SAMPLES = 720
"""Windows, as many as there are to learn from in a recording."""
FIELDS = ("animals", "case", "gain", "truth", "estimate", "low", "high", "verdict")


def network() -> Network:
    """Return the network, from its file where there is one."""
    path = HERE / "gains.safetensors"
    if not path.exists():
        recording = virtual_group(FAMILY, TRUTH, duration_s=RECORDED_S, seed=1)
        windows = recording.windows(length_s=WINDOW_S, signals=SIGNALS)
        Network.learned(recording, windows, seed=1).save(path)
    return Network.load(path)


def recorded(animals: str, case: int) -> Trajectories:
    """Return a recording of animals whose attraction was halved."""
    seed = 1000 + case
    if animals == "equations":
        halved = TRUTH | {"attraction": HALVED * TRUTH["attraction"]}
        return virtual_group(FAMILY, halved, duration_s=RECORDED_S, seed=seed)
    learned = network()
    gains = dict.fromkeys(learned.parameters, 1.0) | {"attraction": HALVED}
    return virtual_group(learned, gains, duration_s=RECORDED_S, seed=seed)


def rows(animals: str, case: int) -> list[dict[str, object]]:
    """Return what is inferred of a case."""
    learned = network()
    genuine: Windows | np.ndarray
    if animals != "samples":
        recording = recorded(animals, case)
        genuine = recording.windows(length_s=WINDOW_S, signals=SIGNALS)
        if animals != "elsewhere":
            learned = learned.in_recordings(recording, genuine)
    if animals in ("samples", "begun"):
        gains = dict.fromkeys(learned.parameters, 1.0) | {"attraction": HALVED}
        rng = np.random.default_rng([1000, case])
        genuine = learned.observe(gains, groups=SAMPLES, rng=rng)
    result = tl.infer(genuine=genuine, simulate=learned, parameters=learned.parameters, seed=case)
    table = []
    for gain in learned.parameters:
        low, high = result.interval[gain] if result.interval else (np.nan, np.nan)
        truth = HALVED if gain == "attraction" else 1.0
        table.append({
            "animals": animals, "case": case, "gain": gain, "truth": truth,
            "estimate": f"{result.estimate[gain]:.3f}", "low": f"{low:.3f}", "high": f"{high:.3f}",
            "verdict": result.verdict,
        })  # fmt: skip
    return table


def main() -> None:
    """Write the rows that are missing."""
    done = keys_done(PATH, ("animals", "case"))
    cases = int(sys.argv[1])
    animals = sys.argv[2] if len(sys.argv) > 2 else "network"
    for case in range(1, cases + 1):
        if (animals, str(case)) in done:
            continue
        added = rows(animals, case)
        print(added, flush=True)
        append_rows(PATH, FIELDS, added)


if __name__ == "__main__":
    main()
