"""A laboratory's run without the laboratory: the same program, before emulated robots in virtual time."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from turing_learning.config import ConfigurationError
from turing_learning.robots.program._equipment import Equipment, laboratory_calibration
from turing_learning.robots.program._laboratory_config import Laboratory

from ._arena import EmulatedLaboratory
from ._camera import overhead_camera


@contextmanager
def as_emulated(laboratory: Laboratory) -> Iterator[Laboratory]:
    """Lend a laboratory as it can be rehearsed, for `rehearse` and what it runs.

    It is marked as emulated, as its runs are: they go on as rehearsals. It has no landmarks, which are not drawn. Where the file of
    the calibration is not there yet, it has the calibration of a camera above the arena's middle, in a file that is removed at
    the end.

    Parameters
    ----------
    laboratory
        As it is.
    """
    setup, scenario = laboratory.setup, laboratory.configuration.scenario
    changes: dict[str, object] = {"landmarks": {}}
    with TemporaryDirectory() as folder:
        width, height = scenario.arena.width_cm, scenario.arena.height_cm
        if width is not None and height is not None and not Path(setup.camera.calibration).exists():
            path = Path(folder) / "camera.json"
            overhead_camera(width, height).save(path)
            changes["calibration"] = str(path)
        camera = setup.camera.model_copy(update=changes)
        yield replace(laboratory, setup=setup.model_copy(update={"camera": camera, "emulated": True}))


def rehearse(laboratory: Laboratory, seed: int | None = None) -> Equipment:
    """Return the doors to an emulated laboratory with the robots, the arena and the calibration of a run.

    Its operator does whatever is asked. Time passes as fast as the computer can.

    Parameters
    ----------
    laboratory
        What is emulated.
    seed
        Of places, noise and batteries; None takes that of the run. A run that goes on should not meet the same noise again.

    Raises
    ------
    ConfigurationError
        If the calibration cannot be read, or the markers are not those that emulated robots wear.
    """
    setup, configuration = laboratory.setup, laboratory.configuration
    try:
        emulated = EmulatedLaboratory(
            configuration.scenario,
            seed=configuration.run.seed if seed is None else seed,
            calibration=laboratory_calibration(setup),
        )
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    if setup.labels != emulated.labels or setup.camera.markers != "triangles":
        raise ConfigurationError(
            f"`robots` must wear triangles in {', '.join(emulated.labels)} for a rehearsal; got {', '.join(setup.labels)}."
        )
    names = {
        str(replica.address): name
        for replica, name in zip(setup.replicas, emulated.names[-len(setup.replicas) :], strict=True)
    }
    return Equipment(
        emulated.clock, lambda address: emulated.link(names[address]), lambda: emulated.camera, emulated.operator
    )
