"""Write run folders as version 0.1.0 leaves them, for test_stored_runs.py.

    python tests/frozen/write_runs.py       # with version 0.1.0 alone

One archive for each kind of folder, without pictures and pages, and `expected.json`: what the folders hold, and what they come to
when they are resumed. The names of the computer and of the processor are not kept.
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
    walk,
    walks,
)

RUNS = HERE / "runs"
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


def short_walk(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The walk, of fewer steps."""
    return walk(parameters, rng)[:, :12]


def short_walks() -> np.ndarray:
    """Recorded walks of fewer steps."""
    return walks()[:, :12]


def stop_after(generations: int) -> Any:
    """Return what stops a run after some generations."""
    asked = iter([False] * (generations - 1))
    return lambda: next(asked, True)


def main() -> None:
    """Write all of it."""
    import turing_learning as tl
    from turing_learning.identifiability import Effort
    from turing_learning.robots import as_emulated, load_laboratory, rehearse
    from turing_learning.runs import start_laboratory

    assert tl.__version__ == "0.1.0"
    expected: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        settings = AGGREGATION | FEW

        whole = infer("aggregation", settings, out=folder / "aggregation")
        expected["aggregation"] = outcome(whole)
        found = whole.check(effort=Effort(**EFFORT), recoveries=1, recovery_generations=4, seed=2)
        expected["check"] = {"verdict": found.verdict, "test": plain(found.test), "parameters": plain(found.parameters)}
        detected = command("detect", folder / "aggregation", "--simulate", 2, "--samples", 3, "--seed", 4, "--json")
        expected["detect"] = json.loads(detected)

        infer("aggregation", settings, out=folder / "stopped", should_stop=stop_after(7))
        infer_walk(short_walk, genuine=short_walks(), out=folder / "custom", settings=FEW)
        expected["custom"] = outcome(tl.load_run(folder / "custom"))
        infer_walk(
            short_walk, genuine=short_walks(), out=folder / "custom-stopped", settings=FEW, should_stop=stop_after(6)
        )

        given = {key: value for key, value in (METHOD | STORED_STUDY).items() if key not in OF_STUDY[:2]}
        tl.study("aggregation", runs=2, first_seed=5, settings=given, workers=1, out=folder / "study")
        expected["study"] = [outcome(tl.load_run(path)) for path in sorted((folder / "study" / "runs").iterdir())]
        shutil.copytree(folder / "study", folder / "study-stopped")
        shutil.rmtree(folder / "study-stopped" / "runs" / "0002")

        file = laboratory_file(folder, repeats=1, generations=2)
        command("robots", "run", "--config", file, "--emulated", "--out", folder / "laboratory")
        expected["laboratory"] = outcome(tl.load_run(folder / "laboratory"))
        with as_emulated(load_laboratory(file)) as laboratory:
            equipment = rehearse(laboratory)
            start_laboratory(laboratory, folder / "laboratory-stopped", equipment=equipment, should_stop=lambda: True)
        shutil.copytree(folder / "laboratory-stopped", folder / "resumed")
        command("resume", folder / "resumed")
        expected["laboratory-stopped"] = outcome(tl.load_run(folder / "resumed"))
        shutil.rmtree(folder / "resumed")

        for path in sorted(each for each in folder.iterdir() if each.is_dir()):
            write(path)
    (RUNS / "expected.json").write_text(json.dumps(plain(expected), indent=1, sort_keys=True) + "\n")


def write(path: Path) -> None:
    """Write a folder as an archive, always the same one."""
    RUNS.mkdir(exist_ok=True)
    with tarfile.open(RUNS / f"{path.name}.tar.xz", "w:xz", preset=9) as archive:
        for file in sorted(each for each in path.rglob("*") if each.is_file()):
            within = file.relative_to(path)
            if not set(within.parts) & set(LEFT_OUT):
                data = anonymous(file.read_bytes()) if file.name == "manifest.json" else file.read_bytes()
                entry = tarfile.TarInfo(str(Path(path.name) / within))
                entry.size = len(data)
                archive.addfile(entry, io.BytesIO(data))


def anonymous(manifest: bytes) -> bytes:
    """Return a manifest that does not say where it was written."""
    content = json.loads(manifest)
    content["process"] = {"pid": 1, "host": "host"}
    content["machine"] = {"system": "Linux", "architecture": "x86_64", "processor": None, "processors": 2}
    return json.dumps(content, indent=2).encode() + b"\n"


if __name__ == "__main__":
    sys.exit(main())
