import pytest

from turing_learning.reproduction import reproduce


@pytest.fixture(scope="session")
def conducted(once):
    """All experiments in their fast form; the folder is not to be changed."""
    return once("conducted", lambda folder: reproduce("all", fast=True, out=folder / "experiments")) / "experiments"
