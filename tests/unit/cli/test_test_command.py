import json

import numpy as np
import pandas as pd
import pytest

RNG = np.random.default_rng(8)


def write_recording(path, turn, individuals=6, frames=300, scale=1.0):
    """Write a table of walkers at 10 frames per second."""
    headings = np.cumsum(turn * RNG.standard_normal((frames, individuals)), axis=0)
    positions = (
        np.cumsum(0.5 * np.stack((np.cos(headings), np.sin(headings)), axis=-1), axis=0) * scale
    )
    frame, who = np.meshgrid(np.arange(frames), np.arange(individuals), indexing="ij")
    columns = {"frame": frame, "id": who, "x": positions[..., 0], "y": positions[..., 1]}
    pd.DataFrame({name: values.ravel() for name, values in columns.items()}).to_csv(
        path, index=False
    )


READ = ("--fps", "10", "--pixels-per-cm", "1", "--y-axis", "up", "--quick")


def test_two_recordings_end_in_sentences_json_and_a_page(call, tmp_path, wide):
    write_recording(tmp_path / "real.csv", 0.3)
    write_recording(tmp_path / "simulated.csv", 0.9)
    code, out, _ = call(
        "test", "real.csv", "--against", "simulated.csv", *READ, "--out", "page.html", "--control"
    )
    assert code == 0
    assert out.startswith("told apart: ")
    assert "The simulated motion is told from the real one" in out
    assert "Control: " in out
    page = (tmp_path / "page.html").read_text()
    assert "What gives it away" in page
    assert "Telltale samples" in page
    # who types the command on the page gets the same page
    command = "test real.csv --against simulated.csv --fps 10 --pixels-per-cm 1 --y-axis up --control --quick"
    assert f"turing-learning {command}" in page
    code, out, _ = call("test", "real.csv", "--against", "simulated.csv", *READ, "--json")
    found = json.loads(out)
    assert found["accuracy"] > 0.9
    assert found["interval"][0] < found["accuracy"]
    assert {"p_value", "auc", "power_accuracy", "examiners", "telling"} <= found.keys()
    assert "turn" in found["telling"][0]["what"] or "straight" in found["telling"][0]["what"]


def test_the_simulated_recordings_have_a_scale_and_a_rate_of_their_own(call, tmp_path):
    write_recording(tmp_path / "real.csv", 0.3)
    write_recording(tmp_path / "pixels.csv", 0.3, scale=20.0)
    own = ("--against-pixels-per-cm", "20", "--signals", "speed")
    found = json.loads(
        call("test", "real.csv", "--against", "pixels.csv", *READ, *own, "--json")[1]
    )
    assert found["signals"] == ["speed"]
    assert found["accuracy"] < 0.8


def test_virtual_animals_keep_their_scale_beside_a_recording_in_pixels(call, tmp_path):
    write_recording(tmp_path / "pixels.csv", 0.3, scale=20.0)
    write_recording(tmp_path / "plain.csv", 0.3)
    plain = pd.read_csv(tmp_path / "plain.csv")
    stated = {"x": "x (cm)", "y": "y up (cm)"}
    plain.rename(columns=stated).to_csv(tmp_path / "virtual.csv", index=False)
    told = ("--fps", "10", "--pixels-per-cm", "20", "--y-axis", "down", "--signals", "speed")
    both = ("test", "pixels.csv", "--against", "virtual.csv")
    found = json.loads(call(*both, *told, "--quick", "--json")[1])
    assert found["accuracy"] < 0.8


def test_arrays_are_samples_and_several_files_are_groups(call, tmp_path):
    for k in range(4):
        np.save(tmp_path / f"real{k}.npy", RNG.standard_normal((10, 20, 2)))
        np.savez(tmp_path / f"simulated{k}.npz", samples=2 * RNG.standard_normal((10, 20, 2)))
    real = [f"real{k}.npy" for k in range(4)]
    simulated = [f"simulated{k}.npz" for k in range(4)]
    code, out, _ = call("test", *real, "--against", *simulated, "--quick", "--json")
    assert code == 0
    assert json.loads(out)["groups"] == [4, 4]
    one = json.loads(
        call("test", real[0], "--against", simulated[0], "--quick", "--signals", "a,b", "--json")[1]
    )
    assert one["groups"] == [10, 10]
    assert one["signals"] == ["a", "b"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("test",), "`REAL` must be one recording or several; got none"),
        (("test", "real.csv"), "`--against` must be one recording or several; got none"),
        (
            ("test", "a.npy", "--against", "real.csv"),
            "`REAL` must be recordings where the others are, or samples",
        ),
        (
            ("test", "a.npy", "--against", "a.npy", "--fps", "3"),
            "`--fps` must be left out for samples; got 3",
        ),
        (
            ("test", "real.csv", "--against", "real.csv", *READ, "--signals", "sped"),
            "`--signals` must be some of speed",
        ),
        (("test", "real.csv", "--against", "real.csv", "--out", "page.txt"), "page.txt"),
    ],
)
def test_what_cannot_be_tested_is_rejected_in_a_line(call, tmp_path, arguments, message):
    write_recording(tmp_path / "real.csv", 0.3)
    np.save(tmp_path / "a.npy", RNG.standard_normal((10, 20, 2)))
    code, _, err = call(*arguments)
    assert code == 2
    assert message in err
