"""Write run folders as version 0.2.0 leaves them, for test_stored_runs.py.

    python tests/frozen/write_runs.py       # with version 0.2.0 alone

One archive for each kind of folder, without pictures and pages, and `expected.json`: what the folders hold, and what they
come to when they are resumed. The names of the computer and of the processor are not kept, nor where a recording was.
"""

import io
import json
import shutil
import sys
import tarfile
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from check import (
    AGGREGATION,
    EFFORT,
    HERE,
    METHOD,
    OF_STUDY,
    SMALL,
    command,
    infer,
    infer_walk,
    laboratory_file,
    outcome,
    plain,
    toml,
    walk,
    walks,
)

RUNS = HERE / "runs"
TERMITES = HERE.parent / "reference" / "data" / "tracktor" / "termite_video_idtracked.txt"
FRAMES = 250  # of the recording, 10 s
LEFT_OUT = ("figures", "report.html", "lock")
FEW = SMALL | {
    "models.parents": 4,
    "models.offspring": 4,
    "classifiers.parents": 4,
    "classifiers.offspring": 4,
    "run.generations": 12,
    "run.checkpoint_every": 4,
}
STORED_STUDY = AGGREGATION | FEW | {"run.history": "thin"}
TRIALS = FEW | {"classifiers.hidden": 3, "run.trials": 40}
SWARM_TRIALS = AGGREGATION | TRIALS | {"scenario.trial.duration_s": 1.0}


def short_walk(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The walk, of fewer steps."""
    return walk(parameters, rng)[:, :12]


def short_walks() -> np.ndarray:
    """Recorded walks of fewer steps."""
    return walks()[:, :12]


def recording(folder: Path) -> Path:
    """Write the recording that is learned from, and return the file."""
    path = folder / "termites.txt"
    lines = TERMITES.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: FRAMES + 1]))
    return path


def stop_after(generations: int) -> Any:
    """Return what stops a run after some generations, or batches of trials."""
    asked = iter([False] * (generations - 1))
    return lambda: next(asked, True)


def main() -> None:
    """Write all of it."""
    import turing_learning as tl

    assert tl.__version__ == "0.2.0"
    shutil.rmtree(RUNS, ignore_errors=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        expected = by_generations(folder) | by_trials(folder) | in_a_laboratory(folder)
        for path in sorted(each for each in folder.iterdir() if each.is_dir()):
            write(path)
    (RUNS / "expected.json").write_text(
        json.dumps(plain(expected), indent=1, sort_keys=True) + "\n"
    )


def by_generations(folder: Path) -> dict[str, Any]:
    """Write runs and studies by generations."""
    import turing_learning as tl
    from turing_learning.identifiability import Effort

    expected: dict[str, Any] = {}
    settings = AGGREGATION | FEW
    whole = infer("aggregation", settings, out=folder / "aggregation")
    expected["aggregation"] = outcome(whole)
    found = whole.check(effort=Effort(**EFFORT), recoveries=1, recovery_generations=4, seed=2)
    expected["check"] = {"test": plain(found.test), "parameters": plain(found.parameters)}
    detect = (
        "detect",
        folder / "aggregation",
        "--simulate",
        2,
        "--samples",
        3,
        "--seed",
        4,
        "--rule",
        "discriminant",
    )
    expected["detect"] = json.loads(command(*detect, "--json"))

    infer("aggregation", settings, out=folder / "stopped", should_stop=stop_after(7))
    infer_walk(short_walk, genuine=short_walks(), out=folder / "custom", settings=FEW)
    expected["custom"] = outcome(tl.load_run(folder / "custom"))
    stopped = {"out": folder / "custom-stopped", "settings": FEW, "should_stop": stop_after(6)}
    infer_walk(short_walk, genuine=short_walks(), **stopped)

    of_runs = {
        key: value for key, value in (METHOD | STORED_STUDY).items() if key not in OF_STUDY[:2]
    }
    tl.study("aggregation", runs=2, first_seed=5, settings=of_runs, workers=1, out=folder / "study")
    expected["study"] = [
        outcome(tl.load_run(path)) for path in sorted((folder / "study" / "runs").iterdir())
    ]
    shutil.copytree(folder / "study", folder / "study-stopped")
    shutil.rmtree(folder / "study-stopped" / "runs" / "0002")
    return expected


def by_trials(folder: Path) -> dict[str, Any]:
    """Write runs by trials: simulated robots, a custom system, and recorded motion."""
    import turing_learning as tl

    infer("aggregation", SWARM_TRIALS, out=folder / "trials")
    infer("aggregation", SWARM_TRIALS, out=folder / "trials-stopped", should_stop=stop_after(5))
    custom = {"genuine": short_walks(), "settings": TRIALS}
    infer_walk(short_walk, out=folder / "custom-trials", **custom)
    infer_walk(
        short_walk, out=folder / "custom-trials-stopped", should_stop=stop_after(5), **custom
    )
    options = (
        "--fps",
        25,
        "--scale",
        30,
        "--y-axis",
        "down",
        "--window",
        1,
        "--every",
        2,
        "--signals",
        "speed,turn",
    )
    settings = toml(METHOD | TRIALS, folder / "settings.toml")
    recorded = (
        "infer",
        "--trajectories",
        recording(folder),
        *options,
        "--model",
        "vicsek",
        "--config",
        settings,
    )
    command(*recorded, "--out", folder / "recorded-trials")
    names = (
        "trials",
        "trials-stopped",
        "custom-trials",
        "custom-trials-stopped",
        "recorded-trials",
    )
    return {name: outcome(tl.load_run(folder / name)) for name in names}


def in_a_laboratory(folder: Path) -> dict[str, Any]:
    """Write rehearsals of runs in a laboratory."""
    import turing_learning as tl
    from turing_learning.robots import as_emulated, load_laboratory, rehearse
    from turing_learning.runs import start_laboratory

    expected: dict[str, Any] = {}
    file = laboratory_file(folder, repeats=1, generations=2)
    command("robots", "run", "--config", file, "--emulated", "--out", folder / "laboratory")
    expected["laboratory"] = outcome(tl.load_run(folder / "laboratory"))
    with as_emulated(load_laboratory(file)) as laboratory:
        equipment = rehearse(laboratory)
        start_laboratory(
            laboratory, folder / "laboratory-stopped", equipment=equipment, should_stop=lambda: True
        )
    shutil.copytree(folder / "laboratory-stopped", folder / "resumed")
    command("resume", folder / "resumed")
    expected["laboratory-stopped"] = outcome(tl.load_run(folder / "resumed"))
    shutil.rmtree(folder / "resumed")
    return expected


def write(path: Path) -> None:
    """Write a folder as an archive, always the same one."""
    for manifest in sorted(path.rglob("manifest.json")):
        make_anonymous(manifest.parent)
    if "trials" in path.name:  # the newest checkpoint is enough, and large
        for checkpoint in sorted(path.glob("checkpoints/*"))[:-1]:
            checkpoint.unlink()
    RUNS.mkdir(exist_ok=True)
    with tarfile.open(RUNS / f"{path.name}.tar.xz", "w:xz", preset=9) as archive:
        for file in sorted(each for each in path.rglob("*") if each.is_file()):
            within = file.relative_to(path)
            if not set(within.parts) & set(LEFT_OUT):
                data = file.read_bytes()
                entry = tarfile.TarInfo(str(Path(path.name) / within))
                entry.size = len(data)
                archive.addfile(entry, io.BytesIO(data))


def make_anonymous(path: Path) -> None:
    """Let a run not say where it was written; its seals fit."""
    from turing_learning.runs import RunFolder

    folder = RunFolder(path)
    machine = {"system": "Linux", "architecture": "x86_64", "processor": None, "processors": 2}
    changes: dict[str, Any] = {"process": {"pid": 1, "host": "host"}, "machine": machine}
    recorded = folder.manifest().get("recording")
    if recorded:
        changes["recording"] = recorded | {
            "options": recorded["options"] | {"trajectories": ["/termites.txt"]}
        }
    folder.update_manifest(**changes)


if __name__ == "__main__":
    sys.exit(main())
