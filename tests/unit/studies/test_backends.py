"""What is said of clusters; the cluster itself is tested in tests/reliability."""

import sys
from contextlib import ExitStack
from types import SimpleNamespace

import pytest

from turing_learning.config import ConfigurationError
from turing_learning.studies._backends import dask_cluster, require_visible


def test_without_the_extra_a_cluster_is_refused(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(
            ConfigurationError,
            match=r"^`cluster` must be left out without the extra `cluster`; got 'tcp://x:1'",
        ),
        ExitStack() as stack,
    ):
        stack.enter_context(dask_cluster("tcp://x:1"))


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (
            {"w1": True, "w2": False},
            r"^`out` must be a folder that all workers of the cluster share; got .*, which w2 does",
        ),
        (
            {"w1": ImportError("no module")},
            r"^`cluster` must have turing-learning installed on all workers; .* from w1\.$",
        ),
    ],
)
def test_workers_that_cannot_take_part_are_named(answer, message, tmp_path):
    client = SimpleNamespace(run=lambda *arguments, **options: answer)
    with pytest.raises(ConfigurationError, match=message):
        require_visible(client, tmp_path / "study.json", "tcp://x:1")


def test_a_cluster_that_does_not_work_is_named(tmp_path):
    def run(*arguments, **options):
        raise OSError("lost")

    with pytest.raises(
        ConfigurationError,
        match=r"^`cluster` must be able to work; got 'tcp://x:1' \(OSError\('lost'\)\)",
    ):
        require_visible(SimpleNamespace(run=run), tmp_path, "tcp://x:1")
