"""The progress bar of runs from Python: where somebody looks, and nowhere else."""

import io
import sys
from types import SimpleNamespace

import turing_learning as tl

SMALL = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}


class Terminal(io.StringIO):
    def isatty(self):
        return True


def shown(monkeypatch, stream, **more):
    monkeypatch.setattr(sys, "stderr", stream)
    tl.infer("aggregation", generations=3, settings=SMALL, **more)
    return stream.getvalue()


def test_a_terminal_has_a_bar_and_a_pipe_has_none(monkeypatch, capsys):
    for name in ("FORCE_COLOR", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    text = shown(monkeypatch, Terminal())
    assert "getting ready" in text
    assert "generation 3/3, done" in text
    assert shown(monkeypatch, io.StringIO()) == ""
    assert shown(monkeypatch, Terminal(), progress=False) == ""
    assert shown(monkeypatch, Terminal(), observer=lambda state: None) == ""
    assert shown(monkeypatch, Terminal(), should_stop=lambda: False) == ""
    seen = []
    assert "generation 3/3" in shown(monkeypatch, Terminal(), progress=True, observer=seen.append)
    assert [state.completed for state in seen] == [1, 2, 3]
    assert capsys.readouterr().out == ""


def test_a_run_that_goes_on_has_a_bar(monkeypatch, tmp_path):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    shown(monkeypatch, io.StringIO(), out=tmp_path / "run", should_stop=lambda: True)
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    assert tl.resume(tmp_path / "run").complete
    assert "generation 3/3" in stream.getvalue()
    stream.truncate(0)
    assert tl.resume(tmp_path / "run").complete
    assert stream.getvalue() == ""


def test_a_cell_has_one_line_that_is_replaced(monkeypatch):
    lines = []

    class Handle:
        def update(self, data, raw):
            lines.append(data["text/plain"])

    def begin(data, raw, display_id):
        lines.append(data["text/plain"])
        return Handle()

    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=begin))
    assert shown(monkeypatch, io.StringIO()) == ""
    assert lines[0].startswith("getting ready")
    assert lines[-1] == f"[{'#' * 30}] generation 3/3, done"
