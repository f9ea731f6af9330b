"""The documentation builds, every link and docstring of it, and works without a network."""

import re
import runpy
import subprocess
import sys
import zlib
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
ROOMS = sorted(
    {path.parent.name for path in (ROOT / "src" / "turing_learning").glob("*/__init__.py")}
    - {"cli"}
)

needs_sphinx = pytest.mark.skipif(find_spec("sphinx") is None, reason="needs the extra docs")


LOOKED_AT = [
    DOCS / "index.md",
    DOCS / "reproduction.md",
    DOCS / "experiments" / "4.3.md",
    DOCS / "experiments" / "as-printed" / "3.2.md",
    DOCS / "gallery" / "swarm.ipynb",
    DOCS / "reference" / "families.md",
]
"""Pages that are written; all are read and their links followed. Writing all, and all sources, would take twice the time."""

OF_A_PART = "search index couldn't be loaded"
"""Part of the one warning that a site of some pages gives."""


@pytest.fixture(scope="session")
def site(once):
    """The folder of the pages that are looked at, built without a warning, as the whole must be."""
    extensions = runpy.run_path(str(DOCS / "conf.py"))["extensions"]
    extensions.remove("sphinx.ext.viewcode")

    def sphinx(folder, *arguments):
        options = ["-q", "-D", f"extensions={','.join(extensions)}", "-d", folder / "doctrees"]
        command = [sys.executable, "-m", "sphinx", *options, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        warnings = [line for line in done.stderr.splitlines() if OF_A_PART not in line]
        assert (done.returncode, warnings) == (0, [])

    def build(folder):
        sphinx(folder, "-b", "dummy", DOCS, folder / "nothing")
        sphinx(folder, "-b", "html", DOCS, folder / "html", *LOOKED_AT)

    return once("site", build) / "html"


@needs_sphinx
def test_the_reference_shows_docstrings_with_their_sources(site):
    page = (site / "reference" / "families.html").read_text(encoding="utf-8")
    assert "Physical Review Letters 75 (1995) 1226" in page
    assert 'id="turing_learning.families.Vicsek"' in page


@needs_sphinx
@pytest.mark.parametrize("name", [room for room in ROOMS if room != "kernels"])
def test_the_reference_shows_every_public_name(site, name):
    # Sphinx's list of all that its pages describe: name, kind, priority, page#anchor ($: the name itself), shown name.
    described = zlib.decompress((site / "objects.inv").read_bytes().split(b"zlib.\n", 1)[1])
    places = {tuple(line.split(" ")[::3]) for line in described.decode().splitlines()}
    room = f"turing_learning.{name}"
    names = import_module(room).__all__
    page = f"reference/{name}.html#$"
    assert [each for each in names if (f"{room}.{each}", page) not in places] == []


@pytest.mark.parametrize("name", ["", *(f".{room}" for room in ROOMS if room != "kernels")])
def test_completion_offers_every_public_name(name):
    room = import_module(f"turing_learning{name}")
    assert set(room.__all__) - set(dir(room)) == set()


@pytest.mark.parametrize("name", [room for room in ROOMS if room != "kernels"])
def test_the_map_of_a_room_names_every_public_name(name):
    room = import_module(f"turing_learning.{name}")
    assert [each for each in room.__all__ if f"`{each}`" not in room.__doc__] == []


@needs_sphinx
def test_the_site_loads_nothing_from_elsewhere(site):
    loaded = re.compile(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?:https?:)?//[^"]+"')
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > len(LOOKED_AT)
    assert [
        (page.name, found[0])
        for page in pages
        if (found := loaded.search(page.read_text(encoding="utf-8")))
    ] == []


@needs_sphinx
def test_experiments_come_along_as_pages_with_their_tables(site):
    page = (site / "experiments" / "4.3.html").read_text(encoding="utf-8")
    assert "What the paper prints" in page
    assert 'src="../_images/' in page
    assert "_downloads/" in page
    reproduction = (site / "reproduction.html").read_text(encoding="utf-8")
    assert 'href="experiments/4.3.html"' in reproduction
    assert 'href="experiments/as-printed/4.3.html"' in reproduction
    as_printed = (site / "experiments" / "as-printed" / "3.2.html").read_text(encoding="utf-8")
    assert 'src="../../_images/' in as_printed


def test_the_home_page_plays_a_replay_that_comes_along():
    address = re.search(r'<iframe[^>]* src="([^"]+)"', (DOCS / "index.md").read_text("utf-8"))[1]
    page = (DOCS / address).read_text(encoding="utf-8")
    assert "25 replicas" in page
    assert len(page) < 250_000


def test_every_experiment_has_a_page():
    written = {path.parent.name for path in (ROOT / "experiments").glob("*/README.md")}
    assert {path.stem for path in (DOCS / "experiments").glob("*.md")} - {"index"} == written


def test_every_room_has_a_page_of_the_reference():
    pages = {path.stem for path in (DOCS / "reference").glob("*.md")} - {"index", "turing_learning"}
    assert pages == set(ROOMS)
    index = (DOCS / "reference" / "index.md").read_text(encoding="utf-8")
    assert [room for room in ROOMS if f"\n{room}\n" not in index] == []


def test_every_decision_has_a_number_of_its_own():
    records = sorted((DOCS / "decisions").glob("0*.md"))[1:]  # the first is the template
    numbers = {path.name[:4] for path in records}
    assert len(numbers) == len(records) > 60
    for path in records:
        stated = path.read_text(encoding="utf-8").split()[1].rstrip(".:")
        assert int(stated) == int(path.name[:4])
