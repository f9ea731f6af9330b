"""Turing Learning: infer the rules that individuals follow from nothing but their motion, without a metric.

The three nouns at the top are the boxes of the method's picture: a sample source (for example a simulated
swarm, `swarm`), classifiers that judge motion samples (`classifiers`), and the coevolution that pits models
against classifiers (`coevolution`, on top of `evolution`). `infer` runs all of it, with simulated robots or
with a custom system (recorded samples and a simulator), whose parameters may be described by `Parameter`;
`resume` resumes a run; `load_run` opens a stored run; `pool` combines several runs; `study` does many runs, and
`load_study` opens them. `load_trajectories` reads recorded motion. `test` puts any simulator to the test,
and `compare` several models of one system.

Rejected input raises `errors.RefusedError`, a ValueError; `config.ConfigurationError` and `runs.RunFolderError` are kinds of it.
A run that has begun and fails raises `systems.CustomSystemError`, `runs.RunStorageError` or `robots.LaboratoryError`.

Names are listed in ``__init__.pyi`` and imported on first use, so that ``import turing_learning`` is fast.
"""

from typing import Any

import lazy_loader

_attached, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("turing-learning")
    return _attached(name)
