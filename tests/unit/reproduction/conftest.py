import pytest

from turing_learning.reproduction import reproduce


@pytest.fixture(scope="session")
def conducted(tmp_path_factory):
    """All experiments in their fast form; the folder is not to be changed."""
    folder = tmp_path_factory.mktemp("conducted") / "experiments"
    reproduce("all", fast=True, out=folder)
    return folder
