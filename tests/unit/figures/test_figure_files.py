import json
import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from turing_learning.figures import Picture, save_figure
from turing_learning.figures._picture import svg_markup
from turing_learning.figures.one_run import error_figure, fitness_figure
from turing_learning.figures.style import panel_grid

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def figure():
    return fitness_figure(
        np.full((4, 2), 0.25), np.full((4, 2), 0.75), stopped=np.array([0, 1, 1, 0])
    )


def test_a_figure_is_saved_as_png_and_svg(figure, tmp_path):
    png, svg = save_figure(figure, tmp_path, "fitness")
    with Image.open(png) as picture:
        assert picture.size == tuple((200 * figure.get_size_inches()).astype(int))
    assert ET.parse(svg).getroot().tag == f"{SVG}svg"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fitness.png", "fitness.svg"]


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    def files(folder):
        folder.mkdir()
        figure = error_figure(np.array([1.0, 0.5]), np.array([0.5, 0.1]))
        return [path.read_bytes() for path in save_figure(figure, folder, "error")]

    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_a_figure_is_drawn_once_for_each_file(tmp_path, monkeypatch):
    figure = error_figure(np.array([1.0, 0.5]), np.array([0.5, 0.1]))
    draw = figure.draw
    draws = []
    monkeypatch.setattr(figure, "draw", lambda renderer: [draws.append(renderer), draw(renderer)])
    save_figure(figure, tmp_path, "error")
    svg_markup(figure, "error", "")
    assert len(draws) == 3


def test_a_failed_save_leaves_the_old_file_and_nothing_else(figure, tmp_path, monkeypatch):
    (tmp_path / "a.png").write_text("old")

    def fail(file, **_):
        file.write_text("half")
        raise OSError("No space left on device")

    monkeypatch.setattr(figure, "savefig", fail)
    with pytest.raises(OSError, match="No space left"):
        save_figure(figure, tmp_path, "a")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a.png", "old")]


@pytest.mark.parametrize("name", ["", "a/b", "..", ".hidden"])
def test_a_name_that_is_a_path_is_refused(figure, tmp_path, name):
    with pytest.raises(
        ValueError, match=f"`name` must be a file name .* got {re.escape(repr(name))}"
    ):
        save_figure(figure, tmp_path, name)


def test_markup_is_one_element_with_a_description(figure):
    root = ET.fromstring(svg_markup(figure, "fit", 'Fitness "of" <both>'))
    assert root.tag == f"{SVG}svg"
    assert root.get("aria-label") == 'Fitness "of" <both>'
    width, height = 72 * figure.get_size_inches()
    assert root.get("viewBox") == f"0 0 {width:g} {height:g}"


def test_markup_of_two_figures_shares_no_id(figure):
    first, second = (svg_markup(figure, prefix, "") for prefix in ("a", "b"))
    ids = [set(re.findall(r'\bid="([^"]*)"', text)) for text in (first, second)]
    assert ids[0]
    assert not ids[0] & ids[1]


def test_every_reference_in_markup_has_its_target(figure):
    text = svg_markup(figure, "a", "")
    references = set(re.findall(r'(?:url\(|href=")#([^")]*)', text))
    assert references
    assert references <= set(re.findall(r'\bid="([^"]*)"', text))


def test_markup_refers_to_nothing_outside(figure):
    text = svg_markup(figure, "a", "")
    assert set(re.findall(r"https?://[^\"']*", text)) == {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }


def test_markup_takes_the_colors_of_the_page(figure):
    text = svg_markup(figure, "a", "")
    assert "var(--blue, #0072b2)" in text
    assert "var(--ink, #1f2933)" in text


def test_markup_keeps_texts_as_texts(figure):
    root = ET.fromstring(svg_markup(figure, "a", ""))
    texts = {"".join(element.itertext()).strip() for element in root.iter(f"{SVG}text")}
    assert {"Generation", "models", "classifiers", "selection stopped"} <= texts


def test_markup_says_where_its_curves_are_and_leaves_the_figure_as_it_was(figure, tmp_path):
    before = save_figure(figure, tmp_path, "before")[1].read_bytes()
    root = ET.fromstring(svg_markup(figure, "a", ""))
    (axes,) = json.loads(root.get("data-axes"))
    assert axes["xName"] == "Generation"
    assert [line["name"] for line in axes["lines"]] == ["models", "classifiers"]
    ids = {element.get("id") for element in root.iter()}
    assert {axes["id"], *(line["id"] for line in axes["lines"])} <= ids
    assert save_figure(figure, tmp_path, "before")[1].read_bytes() == before


def test_markup_says_which_panels_share_an_axis():
    panels = panel_grid(["a", "b", "c"], 2.0, sharex=True)
    for axes in panels.axes:
        axes.plot([1, 2], [3, 4])
    root = ET.fromstring(svg_markup(panels.figure, "a", ""))
    described = json.loads(root.get("data-axes"))
    assert [axes["xGroup"] for axes in described] == [0, 0, 0]
    assert [axes["yGroup"] for axes in described] == [0, 1, 2]


def test_markup_has_no_style_that_leaks_into_the_page(figure):
    assert "<style" not in svg_markup(figure, "a", "")


@pytest.mark.parametrize("prefix", ["", "1a", 'a"', "a b"])
def test_a_prefix_that_is_no_id_is_refused(figure, prefix):
    with pytest.raises(
        ValueError, match=f"`prefix` must be a letter.* got {re.escape(repr(prefix))}"
    ):
        svg_markup(figure, prefix, "")


def test_a_picture_is_saved_under_its_name_and_is_markup_with_its_caption(figure, tmp_path):
    picture = Picture("one", "Title", "What it shows.", figure)
    assert [path.name for path in picture.save(tmp_path)] == ["one.png", "one.svg"]
    assert picture.svg == svg_markup(figure, "one", "What it shows.")
