"""Virtual animals that move for half an hour: ``python half_hour.py RUN ring``, ``RUN zebrafish``, ``families [SEED]``.

RUN is the folder of a run on the first eight recordings of ring.py (``python half_hour.py recordings FOLDER`` writes
all ten as tables), or on the zebrafish. It moves groups for 1,800 s with its estimate. Their first and their last minute
are compared with what was recorded and not learned from: the other two recordings, or the part of the zebrafish that
the run holds out. In the row *recorded* single minutes of what was learned from stand for the model. A difference is a
Hellinger distance of histograms: 0 is the same, 1 is nothing in common. Rows are added to half_hour.csv.

With *families* the same is done for families of equations, all or those whose names follow, inferred from the zebrafish
as by the command. Their rows have no form, and their names stand before the minute.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import animals
import numpy as np
import ring
from table import append_rows, keys_done

import turing_learning as tl
from turing_learning.families import RecordedSystem, virtual_group
from turing_learning.families._tank import recorded_grid, tanks_of
from turing_learning.trajectories import Trajectories

PATH = Path(__file__).parent / "half_hour.csv"
GROUPS = 8
LONG_S = 1800.0
MINUTE_S = 60.0
BINS = 20
"""Of a histogram, each as likely as the others in what was recorded."""
COMPARED = ("speed", "turn", "nearest", "wall", "polarization")
"""Speed (cm/s), turn (rad/s), distance of the nearest other and of the wall (cm), length of the mean direction."""
NUMBERS = ("median_speed", "slowest", "resting", "outside")
"""Median speed, and that of the slowest individual of all minutes (cm/s); shares of the time with less than a tenth of
the recorded median, and of the places that are no tank."""
COMPARED_MINUTES = (1, 2, 15, 30)
FAMILIES = (
    "couzin",
    "burst-and-coast",
    "kicks+walls+social+differences+tracker",
    "persistent+walls+social+differences+tracker",
)
FORM = "0078"
"""The decision that says how networks of these rows move; the code of earlier ones is not there any more."""
FIELDS = ("form", "system", "seed", "what", *COMPARED, *NUMBERS)


def cut(recording: Trajectories, begin: int, frames: int) -> Trajectories:
    """Return some frames of a recording."""
    part = slice(begin, begin + frames)
    return Trajectories(
        recording.positions[part], recording.present[part], fps=recording.fps,
        individuals=recording.individuals,
    )  # fmt: skip


def minutes(recordings: list[Trajectories]) -> list[Trajectories]:
    """Return `GROUPS` minutes, evenly from all recordings."""
    parts = []
    for group in range(GROUPS):
        recording = recordings[group % len(recordings)]
        frames = round(MINUTE_S * recording.fps)
        share = (group // len(recordings) + 0.5) / np.ceil(GROUPS / len(recordings))
        parts.append(cut(recording, round(share * (len(recording.positions) - frames)), frames))
    return parts


def measured(recording: Trajectories, tanks: object) -> dict[str, np.ndarray]:
    """Return all values of what is compared, and whether a place is outside."""
    values: dict[str, np.ndarray] = {}
    signals = recording.signals(("speed", "turn", "neighbor_distance"))
    for k, name in enumerate(("speed", "turn", "nearest")):
        values[name] = signals.values[..., k][signals.valid]
    path = np.where(recording.present[..., None], recording.positions, np.nan)
    places = path[np.isfinite(path[..., 0])]
    inside = np.pad(tanks.inside[0], 1)
    # each cell has the distance of the wall that is nearest to its center
    distance = np.pad(tanks.distance[0].min(axis=-1), 1)
    cells = np.floor((places - tanks.corner[0]) / tanks.cell[0]).astype(int) + 1
    cells = np.clip(cells, 0, np.array(inside.shape) - 1)
    values["wall"] = distance[tuple(cells.T)]
    values["outside"] = ~inside[tuple(cells.T)]
    steps = np.diff(path, axis=0)
    with np.errstate(invalid="ignore"):
        directions = steps / np.linalg.norm(steps, axis=-1, keepdims=True)
    everybody = np.isfinite(directions).all(axis=(1, 2))
    values["polarization"] = np.linalg.norm(directions[everybody].mean(axis=1), axis=-1)
    own_speed = np.linalg.norm(steps, axis=-1) * recording.fps
    values["own"] = np.nanmedian(own_speed, axis=0)
    return values


def hellinger(values: np.ndarray, recorded: np.ndarray) -> float:
    """Return the distance of two distributions, by a histogram of what was recorded."""
    edges = np.unique(np.quantile(recorded, np.linspace(0, 1, BINS + 1)[1:-1]))
    shares = []
    for these in (values, recorded):
        counts = np.bincount(np.searchsorted(edges, these), minlength=len(edges) + 1)
        shares.append(np.sqrt(counts / counts.sum()))
    return float(np.sqrt(max(1 - shares[0] @ shares[1], 0.0)))


def pooled(recordings: list[Trajectories], tanks: object) -> dict[str, np.ndarray]:
    """Return `measured` of several recordings together."""
    each = [measured(recording, tanks) for recording in recordings]
    return {name: np.concatenate([values[name] for values in each]) for name in each[0]}


def recorded_parts(system: str) -> tuple[list[Trajectories], list[Trajectories]]:
    """Return what was learned from, and what was not."""
    if system == "ring":
        recordings = [ring.recorded(number) for number in range(ring.RECORDINGS)]
        return recordings[: ring.LEARNED], recordings[ring.LEARNED :]
    fish = animals.recordings()[system]
    windows = fish.windows(length_s=5, signals=animals.SIGNALS)
    parts = {}
    for part in ("learning", "held out"):
        learned = np.flatnonzero(windows.frames(part)[0].any(axis=1))
        stretches = np.split(learned, np.flatnonzero(np.diff(learned) > 1) + 1)
        parts[part] = [cut(fish, int(some[0]), len(some)) for some in stretches]
    return parts["learning"], parts["held out"]


def write_recordings(folder: Path) -> None:
    """Write the recordings of ring.py as tables."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(ring.RECORDINGS):
        table = ring.recorded(number).to_pandas()[["frame", "id", "x", "y"]]
        table.to_csv(folder / f"group{number + 1}.csv", index=False, float_format="%.3f")


def add_rows(
    form: str, system: str, seed: int, variants: dict[str, list[Trajectories]], tanks: object
) -> None:
    """Add the rows that are missing: what each of the variants differs by from what was not learned from."""
    expected = pooled(recorded_parts(system)[1], tanks)
    usual = float(np.median(expected["speed"]))
    done = keys_done(PATH, ("form", "system", "seed", "what"))
    for what, recordings in variants.items():
        if (form, system, str(seed), what) in done:
            continue
        values = pooled(recordings, tanks)
        row: dict[str, object] = {"form": form, "system": system, "seed": seed, "what": what}
        for name in COMPARED:
            row[name] = f"{hellinger(values[name], expected[name]):.3f}"
        row["median_speed"] = f"{np.median(values['speed']):.3g}"
        row["slowest"] = f"{values['own'].min():.3g}"
        row["resting"] = f"{(values['speed'] < 0.1 * usual).mean():.4f}"
        row["outside"] = f"{values['outside'].mean():.4f}"
        print(row, flush=True)
        append_rows(PATH, FIELDS, [row])


def minutes_of(groups: list[Trajectories], before: str = "") -> dict[str, list[Trajectories]]:
    """Return some minutes of groups, by name."""
    variants = {}
    for minute in COMPARED_MINUTES:
        frames = round(MINUTE_S * groups[0].fps)
        begin = (minute - 1) * frames
        variants[f"{before}minute {minute}"] = [cut(group, begin, frames) for group in groups]
    return variants


def add_families(seed: int, names: Sequence[str]) -> None:
    """Add the rows of families that are inferred from the zebrafish."""
    for name in names:
        options = {
            "trajectories": [animals.TRACKTOR / "zebrafish_video_idtracked.txt"], "model": name,
            "fps": 30.0, "scale": 20.0, "y_axis": "down", "bridge": 5, "every": 3,
        }  # fmt: skip
        system = RecordedSystem(options)
        windows, family, motion = system.opened()
        parameters, _ = system.parameters(family, motion)
        result = tl.infer(genuine=windows, simulate=family, parameters=parameters, seed=seed)
        print(name, result.estimate, flush=True)
        fish = animals.recordings()["zebrafish"]
        corner, far = fish.reach
        # who minds nobody is inferred without a tank, and would leave it
        tank_cm = None if family.tank_cm else tuple((far - corner).tolist())
        groups = []
        for k in range(GROUPS):
            group = virtual_group(
                family, result.estimate, duration_s=LONG_S, tank_cm=tank_cm, seed=100 * seed + k
            )
            groups.append(replace(group, positions=group.positions + corner))
        places = fish.positions[fish.present]
        tanks = tanks_of([recorded_grid(places)], [True])
        add_rows("", "zebrafish", seed, minutes_of(groups, f"{name}, "), tanks)


def main() -> None:
    """Add the rows of a run, or of families."""
    if sys.argv[1] == "recordings":
        write_recordings(Path(sys.argv[2]))
        return
    if sys.argv[1] == "families":
        seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
        add_families(seed, sys.argv[3:] or FAMILIES)
        return
    folder, system = Path(sys.argv[1]), sys.argv[2]
    run = tl.load_run(folder)
    network = tl.runs.RunFolder(folder).network()
    assert network is not None, "the run is not on a network"
    seed = run.configuration.run.seed
    groups = [
        virtual_group(network, run.estimate, duration_s=LONG_S, seed=100 * seed + k)
        for k in range(GROUPS)
    ]
    variants = {"recorded": minutes(recorded_parts(system)[0])} | minutes_of(groups)
    add_rows(FORM, system, seed, variants, network.brain.tanks)


if __name__ == "__main__":
    main()
