"""What the command prints, and its exit codes."""

import pytest

pytestmark = pytest.mark.usefixtures("wide")


def test_without_argument_the_experiments_are_listed(call, tmp_path):
    code, out, _ = call("reproduce")
    assert code == 0
    assert "Both case studies" in out
    assert out.count("not run yet") == out.count("about")
    assert list(tmp_path.iterdir()) == []


def test_the_list_shows_what_is_in_a_folder(call, conducted):
    _, out, _ = call("reproduce", "--out", conducted)
    assert "of 3 claims agree, fast form" in out


def test_it_ends_with_a_table_of_verdicts(call, tmp_path):
    code, out, _ = call("reproduce", "3.2", "--fast", "--page", "page.md")
    assert code == 0
    assert "snapshots-aggregation: " in out
    assert "3.2-snapshots" in out
    assert "of 1 claims agree, fast form" in out
    assert "not run yet" in (tmp_path / "page.md").read_text()
    assert (tmp_path / "runs" / "reproduction-fast" / "3.2" / "README.md").exists()


def test_an_unknown_experiment_has_exit_code_2(call):
    code, _, err = call("reproduce", "8.8")
    assert code == 2
    assert "`experiment` must be one of" in err


def test_a_page_that_cannot_be_written_has_exit_code_2(call):
    code, _, err = call("reproduce", "--page", "nowhere/page.md")
    assert code == 2
    assert "`page` must be a file that can be written; got nowhere/page.md" in err


def test_a_page_replaces_nothing_but_such_a_page(call, tmp_path):
    own, page = tmp_path / "notes.md", tmp_path / "page.md"
    own.write_text("my notes")
    code, _, err = call("reproduce", "3.2", "--fast", "--page", "notes.md")
    assert code == 2
    assert err == (
        "error: `page` must be a file that does not exist; got notes.md. Choose another name, or replace it with --force.\n"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["notes.md"]
    assert own.read_text() == "my notes"
    for _ in range(2):
        assert call("reproduce", "--page", "page.md")[0] == 0
    assert call("reproduce", "--page", "notes.md", "--force")[0] == 0
    assert own.read_text() == page.read_text()


def test_a_page_is_markdown(call, tmp_path):
    code, _, err = call("reproduce", "--page", "run.py")
    assert (code, err) == (2, "error: `page` must end with .md; got run.py.\n")
    assert list(tmp_path.iterdir()) == []


def test_what_may_be_replaced_is_the_page(call):
    code, _, err = call("reproduce", "3.2", "--force")
    assert code == 2
    assert "`force` must be given with a page" in err


def test_a_stop_has_exit_code_130_and_says_how_to_go_on(call, monkeypatch):
    from turing_learning.cli._stopping import StopRequest

    monkeypatch.setattr(StopRequest, "__call__", lambda self: True)
    code, _, err = call("reproduce", "3.2", "--fast")
    assert code == 130
    assert err == "stopped at snapshots-aggregation; the same command resumes\n"


def test_a_second_interrupt_has_exit_code_130(call, monkeypatch):
    def interrupt(*arguments, **named):
        raise KeyboardInterrupt

    monkeypatch.setattr("turing_learning.reproduction._reproduce.Work", interrupt)
    code, _, err = call("reproduce", "3.2", "--fast")
    assert (code, err) == (130, "interrupted; the same command resumes\n")
