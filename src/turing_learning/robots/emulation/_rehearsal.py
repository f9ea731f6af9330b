"""A laboratory's run without the laboratory: the same program, before emulated robots in virtual time."""

from turing_learning.config import ConfigurationError
from turing_learning.robots.program._equipment import Equipment, laboratory_calibration
from turing_learning.robots.program._laboratory_config import Laboratory

from ._arena import EmulatedLaboratory


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
