import csv

import pytest

from turing_learning.reproduction import reproduce


@pytest.fixture(scope="session")
def conducted(once):
    """All experiments in their fast form; the folder is not to be changed."""
    return once("experiments", lambda folder: reproduce("all", fast=True, out=folder))


@pytest.fixture
def rows(conducted):
    """Return the rows of a table of an experiment."""

    def read(experiment, table):
        with (conducted / experiment / "tables" / f"{table}.csv").open(newline="") as file:
            return list(csv.DictReader(file))

    return read
