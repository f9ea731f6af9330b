import subprocess

import pytest

from turing_learning.config import ConfigurationError
from turing_learning.studies import refuse_script, write_slurm


def test_the_script_is_a_valid_one_that_names_study_and_runs(tmp_path):
    script = tmp_path / "a job.sh"
    submit = write_slurm(script, tmp_path / "my study", 30)
    assert submit.startswith(
        f"job=$(sbatch --parsable --array=1-30 '{script}') && sbatch --dependency=afterany:"
    )
    text = script.read_text()
    assert f"study-run '{tmp_path}/my study' \"$SLURM_ARRAY_TASK_ID\"" in text
    assert f"study-collect '{tmp_path}/my study'" in text
    assert "#SBATCH --cpus-per-task=1" in text
    assert (
        "#SBATCH --signal=B:TERM@60" in text
    )  # without B the steps are signaled, of which there are none
    assert subprocess.run(["bash", "-n", script], check=False).returncode == 0


def test_a_script_is_replaced_by_force_only(tmp_path):
    script = tmp_path / "job.sh"
    script.write_text("mine")
    with pytest.raises(
        ConfigurationError,
        match=r"^`write-slurm` must be a file that does not exist; got .*job\.sh",
    ):
        write_slurm(script, tmp_path, 1)
    assert script.read_text() == "mine"
    write_slurm(script, tmp_path, 1, force=True)
    assert "sbatch" in script.read_text()


def test_a_script_must_be_in_a_folder_that_exists(tmp_path):
    with pytest.raises(
        ConfigurationError, match=r"^`write-slurm` must be a file in a folder that exists; got "
    ):
        write_slurm(tmp_path / "missing" / "job.sh", tmp_path, 1)


def test_a_script_in_a_folder_that_is_not_ones_own_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    with pytest.raises(
        ConfigurationError,
        match=r"^`write-slurm` must be a file that can be written; got .*job\.sh\.",
    ):
        refuse_script(tmp_path / "job.sh", force=False)


def test_a_script_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    def fail(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("turing_learning.studies._backends.write_atomically", fail)
    with pytest.raises(
        ConfigurationError,
        match=r"file that can be written; got .*job\.sh \(No space left on device\)",
    ):
        write_slurm(tmp_path / "job.sh", tmp_path, 1)


@pytest.mark.parametrize("character", ["\n", "\r", "\x1b", "\udc80"])
def test_a_path_that_would_be_executed_is_refused(character, tmp_path):
    for script, study in (
        (f"job{character}touch.sh", "study"),
        ("job.sh", f"study{character}touch here"),
    ):
        with pytest.raises(
            ConfigurationError,
            match=r"^`(write-slurm|study)` must have a path without control characters",
        ):
            write_slurm(tmp_path / script, tmp_path / study, 1)
    assert list(tmp_path.iterdir()) == []
