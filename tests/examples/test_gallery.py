"""The notebooks of the gallery: committed as they ran at full size, and executed here in a fast form."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
NOTEBOOKS = ("swarm", "fish", "custom", "learned")
REQUIRED = {"learned": "torch"}
"""Notebook -> what it needs beside the extra docs."""
CONCLUSION = {"learned": "The simulated motion is told"}
"""Notebook -> with what it ends, if not with a verdict."""
FAST = """
import turing_learning.examination._convolution
turing_learning.examination._convolution.FEATURES = 100
from turing_learning.identifiability import Effort
FEW = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}
LEAST = {"effort": Effort(samples=12, points=0), "recoveries": 0}
"""

nbformat = pytest.importorskip("nbformat", reason="needs the extra docs")
pytestmark = pytest.mark.skipif(find_spec("ipykernel") is None, reason="needs the extra docs")


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_committed_as_it_ran_from_its_beginning(name):
    cells = [
        cell
        for cell in nbformat.read(GALLERY / f"{name}.ipynb", 4).cells
        if cell.cell_type == "code"
    ]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell.outputs]
    assert not [
        output
        for output in outputs
        if output.output_type == "error" or output.get("name") == "stderr"
    ]
    assert CONCLUSION.get(name, "Verdict: ") in str(outputs)
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 3


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs(name, tmp_path):
    if name in REQUIRED:
        pytest.importorskip(REQUIRED[name], reason="needs the extra networks")
    notebook = nbformat.read(GALLERY / f"{name}.ipynb", 4)
    shortened = 0
    for cell in (cell for cell in notebook.cells if cell.cell_type == "code"):
        cell.source, runs = re.subn(r"generations=\d+", "generations=2, settings=FEW", cell.source)
        cell.source, budgets = re.subn(r"trials=\d+", "trials=60", cell.source)
        cell.source = re.sub(r"in \(1, 2(, \d)+\)", "in (1, 2)", cell.source)
        cell.source, checks = re.subn(
            r"(runs\[0\]|result|wrong)\.check\(.*?\)", r"\1.check(**LEAST)", cell.source
        )
        cell.source, lessons = re.subn(r"(?<=windows, )seed=1\)", "seed=1, steps=30)", cell.source)
        # it is executed in another folder
        cell.source = cell.source.replace('"../../tests', f'"{GALLERY.parents[1]}/tests')
        shortened += runs + budgets + checks + lessons
    assert shortened >= 2
    notebook.cells.insert(0, nbformat.v4.new_code_cell(FAST))
    nbformat.write(notebook, tmp_path / "fast.ipynb")
    paths = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    execute = [
        sys.executable,
        "-c",
        "from nbclient.cli import main; main()",
        "--inplace",
        tmp_path / "fast.ipynb",
    ]
    done = subprocess.run(
        execute, cwd=tmp_path, env=os.environ | {"PATH": paths}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-3000:]
    cells = [
        cell for cell in nbformat.read(tmp_path / "fast.ipynb", 4).cells if cell.cell_type == "code"
    ]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
