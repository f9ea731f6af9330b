"""Messages that are put into the words of the command line: the table must know those that there are."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import turing_learning as tl
from turing_learning.cli import main
from turing_learning.cli._wording import _SENTENCES, on_the_command_line
from turing_learning.runs import RunFolderError


@cache
def said() -> tuple[str, ...]:
    """Return every text of the package, those with fields as their parts, and none of the table itself."""
    found = []
    for path in Path(tl.__file__).parent.rglob("*.py"):
        if path.name != "_wording.py":
            nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            found += [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return tuple(found)


def longest_text(pattern: str) -> str:
    """Return the longest text in a pattern without the name in front, which is a field in some messages."""
    pattern = re.sub("^`[a-z]+`", "", pattern)
    parts = re.split(r"\\[dSw]\+|\.\*\??|\.\+\??|(?<!\\)\((?:\?:)?|(?<!\\)\)\??|\|", pattern)
    return max((re.sub(r"\\(.)", r"\1", part) for part in parts), key=len)


@pytest.mark.parametrize("pattern", [pattern for pattern, _ in _SENTENCES])
def test_each_sentence_that_is_translated_is_one_that_is_said(pattern):
    text = longest_text(pattern)
    assert len(text) >= 10
    assert any(text in one for one in said()), text


def test_what_is_not_in_the_table_stays_as_it_is():
    message = "`models.parents` must be 1 or more; got 0 [--set models.parents]."
    assert on_the_command_line(message) == message


def test_python_and_the_command_line_are_told_their_own_way_to_replace_a_run(tmp_path, capsys):
    run = tmp_path / "run"
    tl.infer("aggregation", generations=1, settings={"models.population": 4, "classifiers.population": 4}, out=run)
    with pytest.raises(RunFolderError, match="replace it with force=True"):
        tl.infer("aggregation", out=run)
    with pytest.raises(SystemExit):
        main(["infer", "aggregation", "--out", str(run)])
    assert "replace it with --force." in capsys.readouterr().err
