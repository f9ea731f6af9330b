"""Who executes what: agents their controller, replicas models of any representation."""

from dataclasses import dataclass

import numpy as np

from ..models import Behavior
from ._drivers import Drivers
from ._scenario import Scenario


@dataclass(frozen=True, eq=False)
class Execution:
    """What each robot of R trials executes, as `simulate` and `observe` take it.

    Attributes
    ----------
    controllers : (R, A, 2 n)
        Left and right wheel speed for each sensor state, as fractions of the maximum; of a network the largest that it may give.
    fields_of_view : (R, A)
        Of the sensors (rad); None where all are the scenario's.
    drivers
        Networks that drive some of the robots; None if all are reactive.
    """

    controllers: np.ndarray
    fields_of_view: np.ndarray | None
    drivers: Drivers | None


def execution_of(scenario: Scenario, models: Behavior, executed: np.ndarray) -> Execution:
    """Return what robots execute of which some are replicas.

    Parameters
    ----------
    models : (M, ...)
        What replicas of M models execute.
    executed : (R, A)
        The model, 0 to M - 1, that each robot executes; -1 for an agent.
    """
    replica = executed >= 0
    speeds, view = models.wheel_speeds, models.field_of_view
    return Execution(
        controllers=np.where(replica[..., None], speeds[executed], scenario.controller),
        fields_of_view=None if view is None else np.where(replica, view[executed], scenario.sensor.field_of_view),
        drivers=None if models.weights is None else Drivers(models.weights, models.hidden, executed),
    )


def mixed_groups(scenario: Scenario, models: int) -> np.ndarray:
    """Return which model each robot executes (M, A) in a trial for each of M models: replicas of it after agents (-1)."""
    executed = np.full((models, scenario.individuals), -1)
    executed[:, scenario.agents :] = np.arange(models)[:, None]
    return executed
