"""A laboratory's run without the laboratory: before emulated robots in virtual time, or in plain simulation."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from turing_learning.coevolution import Samples
from turing_learning.config import ConfigurationError
from turing_learning.errors import refusing_as, require
from turing_learning.models import Behavior
from turing_learning.purposes import REHEARSAL
from turing_learning.robots.links._epuck import EPuck
from turing_learning.robots.program._equipment import CameraPoses, Equipment, laboratory_tracker
from turing_learning.robots.program._setup import Laboratory
from turing_learning.robots.program._source import LARGEST
from turing_learning.swarm import Scenario, Trials, alone
from turing_learning.systems import Source

from ._camera import overhead_camera
from ._hands import EmulatedLaboratory


@contextmanager
def as_emulated(laboratory: Laboratory) -> Iterator[Laboratory]:
    """Yield a laboratory in the form that can be rehearsed, for `rehearse` and the run.

    It is marked as emulated, and so are its runs: they are resumed as rehearsals. It has no landmarks, which
    are not rendered. If the file of the calibration does not exist yet, it has the calibration of a camera
    above the arena's middle, in a file that is removed at the end. Its robots are emulated e-pucks before a camera, whatever
    the real ones are.
    """
    setup, scenario = laboratory.setup, laboratory.configuration.swarm
    changes: dict[str, object] = {"landmarks": {}}
    with TemporaryDirectory() as folder:
        width, height = scenario.arena.width_cm, scenario.arena.height_cm
        known = setup.camera.calibration is not None and Path(setup.camera.calibration).exists()
        if width is not None and height is not None and not known:
            path = Path(folder) / "camera.json"
            overhead_camera(width, height).save(path)
            changes["calibration"] = str(path)
        camera = setup.camera.model_copy(update=changes)
        plain = {"camera": camera, "emulated": True, "open_replica": None, "tracker": None}
        yield replace(laboratory, setup=setup.model_copy(update=plain))


def rehearse(laboratory: Laboratory, seed: int | None = None) -> Equipment:
    """Return the devices of an emulated laboratory with the robots, the arena and the calibration of a run.

    Its operator does whatever is asked. Time passes as fast as the computer can. The seed of places, noise and batteries is
    that of the run if None; a resumed run should not meet the same noise again. Raise ConfigurationError if the calibration
    cannot be read, or a robot cannot wear its marker.
    """
    setup, configuration = laboratory.setup, laboratory.configuration
    tracker = laboratory_tracker(setup, configuration.swarm.robot)
    with refusing_as(ConfigurationError):
        emulated = EmulatedLaboratory(
            configuration.swarm,
            seed=configuration.run.seed if seed is None else seed,
            calibration=tracker.calibration,
            markers=tracker.markers,
            labels=setup.labels,
        )
    robots = zip((*setup.agents, *setup.replicas), emulated.names, strict=True)
    names = {str(robot.address): name for robot, name in robots if robot.address}
    return Equipment(
        emulated.clock,
        lambda address: EPuck(emulated.link(names[address])),
        lambda: CameraPoses(emulated.camera, tracker, emulated.clock),
        emulated.operator,
    )


class SimulatedLaboratory(Source):
    """Samples of trials in which each replica executes a model of its own, among the same agents, in plain simulation.

    The counterpart of `LaboratorySource` in the paper's comparison: the same setup, without links, images, a
    tracker, dispersal and infrared sensors. The robots begin each trial at places drawn uniformly; a wall
    only stops them. Source: paper, section 5.4.

    Parameters
    ----------
    scenario
        The laboratory's, with R replicas.
    seed
        Of `observe`; the random numbers of `collect` come from the run.
    of_trials
        Whether of a run of trials, see `LaboratorySource`.
    """

    def __init__(self, scenario: Scenario, seed: int = 0, *, of_trials: bool = False) -> None:
        self._scenario, self._seed = scenario, seed
        self.together, self.ends = scenario.replicas, LARGEST if of_trials else None

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the wheel speeds (M, P), fractions of the maximum; see `LaboratorySource.to_units`."""
        return models if self.ends else np.tanh(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples of the agents in all trials (trials x agents, T, 2), and one of each model (M, 1, T, 2)."""
        return self._samples(self.to_units(models), rng)

    def observe(self, speeds: np.ndarray, stage: str) -> Samples:
        """Return samples of models (M, P) in wheel speeds; see `collect`. Each stage has its own random numbers."""
        return self._samples(speeds, np.random.default_rng([REHEARSAL, self._seed, *stage.encode()]))

    def _samples(self, speeds: np.ndarray, rng: np.random.Generator) -> Samples:
        scenario = self._scenario
        trials, rest = divmod(len(speeds), scenario.replicas)
        require(trials and not rest, "models", f"be a multiple of {scenario.replicas} replicas, not 0", len(speeds))
        executed = alone(scenario, trials)
        executed[:, scenario.agents :] = np.arange(len(speeds)).reshape(trials, -1)
        motion = Trials.draw(scenario, executed, rng).observe(Behavior(speeds), 1)
        shape = motion.shape[2:]
        return Samples(
            genuine=motion[:, : scenario.agents].reshape(-1, *shape),
            counterfeit=motion[:, scenario.agents :].reshape(-1, 1, *shape),
        )
