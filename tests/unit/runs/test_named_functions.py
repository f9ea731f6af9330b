"""Which functions that a folder names are imported, and when (SECURITY.md)."""

import hashlib
import json
import sys

import pytest
from own_models import RANGES, recorded

import turing_learning as tl
from turing_learning.runs import RunFolder, RunFolderError

PARTS = """
from own_models import walk
from turing_learning.classifiers import ElmanClassifier
from turing_learning.evolution import EvolutionStrategy


def network(inputs, scale):
    return ElmanClassifier(inputs=inputs, hidden=2, scale=scale, threads=1)


def optimizer(dimension, size, **begin):
    return EvolutionStrategy(dimension, parents=size // 2, offspring=size // 2, **begin)


def simulate(parameters, rng):
    return walk(parameters, rng)
"""
SETTINGS = {
    "models.population": 4,
    "classifiers.population": 4,
    "run.generations": 4,
    "run.threads": 1,
    "run.checkpoint_every": 2,
    "models.optimizer": "named_parts:optimizer",
    "classifiers.network": "named_parts:network",
}


@pytest.fixture
def named(tmp_path, monkeypatch):
    """A stopped run whose folder names a module, which is not imported any more."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "named_parts.py").write_text(PARTS)
    path = tmp_path / "run"
    stop = iter([False, False, True])
    system = {"genuine": recorded(), "simulate": "named_parts:simulate", "parameters": RANGES}
    tl.infer(**system, settings=SETTINGS, out=path, should_stop=lambda: next(stop))
    sys.modules.pop("named_parts")
    yield path
    sys.modules.pop("named_parts", None)


def test_reading_a_run_imports_nothing_that_its_folder_names(named, tmp_path):
    result = tl.load_run(named)
    assert result.history["classifier"].to_numpy().shape == (3, 4, 13)
    str(result)
    result.report(tmp_path / "page.html")
    assert "named_parts" not in sys.modules


def test_resuming_a_run_imports_what_its_folder_names(named):
    assert tl.resume(named, genuine=recorded()).complete
    assert "named_parts" in sys.modules


def rename_in_configuration(path, word):
    """Let config.toml name another module, and the manifest hold its new digest."""
    text = (path / "config.toml").read_text().replace(f"named_parts:{word}", f"other_parts:{word}")
    (path / "config.toml").write_text(text)
    digest = hashlib.sha256(text.encode()).hexdigest()
    manifest = json.loads((path / "manifest.json").read_text())
    (path / "manifest.json").write_text(json.dumps(manifest | {"configuration_sha256": digest}))


def rename_in_manifest(path, word):
    """Let the manifest name another module."""
    text = (
        (path / "manifest.json").read_text().replace(f"named_parts:{word}", f"other_parts:{word}")
    )
    (path / "manifest.json").write_text(text)


def without_seals(path):
    (path / "seals.txt").unlink()


def without_the_seal_of_the_manifest(path):
    lines = (path / "seals.txt").read_text().splitlines(keepends=True)
    (path / "seals.txt").write_text("".join(line for line in lines if "manifest.json" not in line))


@pytest.mark.parametrize(
    "unseal", [without_seals, without_the_seal_of_the_manifest, lambda path: None]
)
@pytest.mark.parametrize(
    ("rename", "word"),
    [
        (rename_in_configuration, "network"),
        (rename_in_configuration, "optimizer"),
        (rename_in_manifest, "simulate"),
    ],
)
def test_functions_that_an_edited_folder_names_are_not_imported(
    named, tmp_path, unseal, rename, word
):
    (tmp_path / "other_parts.py").write_text("raise SystemExit('imported')")
    result = tl.load_run(named)
    rename(named, word)
    unseal(named)
    assert "other_parts" in "".join(
        path.read_text() for path in named.glob("*.[tj]*") if path.name != "result.json"
    )
    for door in (
        lambda: tl.load_run(named),
        lambda: tl.resume(named, genuine=recorded()),
        lambda: result.check(genuine=recorded()),
        lambda: RunFolder(named).configuration(),
    ):
        with pytest.raises(RunFolderError, match=r"manifest\.json"):
            door()
    assert "other_parts" not in sys.modules
