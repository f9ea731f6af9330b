import numpy as np
import pandas as pd
import pytest
from walkers import READ, SMALL

FRAMES = 400
INDIVIDUALS = 4


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    """A table of walkers."""
    rng = np.random.default_rng(6)
    headings = np.cumsum(0.3 * rng.standard_normal((FRAMES, INDIVIDUALS)), axis=0)
    steps = 0.5 * np.stack((np.cos(headings), np.sin(headings)), axis=-1)
    steps *= 1 + 0.3 * rng.random((FRAMES, INDIVIDUALS, 1))
    positions = 20 * rng.random((INDIVIDUALS, 2)) + np.cumsum(steps, axis=0)
    frame, who = np.meshgrid(np.arange(FRAMES), np.arange(INDIVIDUALS), indexing="ij")
    table = {"frame": frame, "id": who, "x": positions[..., 0], "y": positions[..., 1]}
    path = tmp_path_factory.mktemp("recorded") / "walkers.csv"
    pd.DataFrame({name: values.ravel() for name, values in table.items()}).to_csv(path, index=False)
    return path


@pytest.fixture(scope="session")
def run(recorded, done, tmp_path_factory):
    """A short run on it."""
    path = tmp_path_factory.mktemp("runs") / "walk"
    options = ("--trajectories", recorded, *READ, "--model", "burst-and-coast", "--window", "1")
    done("infer", *options, *SMALL, "--longest-rest", "20", "--out", path)
    return path
