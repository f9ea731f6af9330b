"""Groups that were never recorded, in motion: virtual animals."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from turing_learning.errors import brief, integer, number, require

from ..trajectories import Trajectories
from ._family import LONGEST, Family
from ._recorded import Replicates

DENSER = 1.5
"""Ratio of densities, or of the sides of tanks, from which on a group counts as unlike those that were recorded."""


def virtual_group(
    family: Family | Replicates,
    parameters: Mapping[str, float],
    *,
    individuals: int | None = None,
    duration_s: float = 60.0,
    tank_cm: tuple[float, float] | None = None,
    seed: int = 1,
    as_tracked: bool = False,
) -> Trajectories:
    """Simulate a group of any size, in any tank, and return it as if it had been recorded.

    Parameters
    ----------
    family
        What is simulated; the first group of `Replicates`.
    parameters
        Name -> value of each parameter, such as the estimate of a run.
    individuals
        Number of individuals A, >= 1; by default that of the family.
    duration_s
        From the first frame to the last (s): at least three frames.
    tank_cm
        Width and height (cm) of a tank; by default that of the family.
    seed
        Of all randomness, >= 0.
    as_tracked
        Whether individuals are lost as the tracker of the recordings lost them; see `Network`.

    Returns
    -------
    Trajectories
        In cm, with the steps per second of the family.

    Raises
    ------
    ValueError
        If a parameter is missing, there are too many steps or individuals, the family knows no such tank, or
        it knows no losses and `as_tracked` is given.
    """
    group = family.groups[0] if isinstance(family, Replicates) else family
    rule = "be a family of models, which says where everybody is"
    require(isinstance(group, Family), "family", rule, type(group).__name__)
    names = list(group.parameters)
    require(
        set(parameters) == set(names), "parameters", f"name {', '.join(names)}", brief(parameters)
    )
    integer("seed", seed)
    number("duration_s", duration_s, above=0)
    # a family simulates two frames more than the steps of a sample, and as many that nobody sees
    steps = round(duration_s * group.fps) - 1
    longest = LONGEST - group.settling_steps
    rule = f"be at least {2 * group.interval_s:g} s, and at most {longest * group.interval_s:g} s"
    require(1 <= steps <= longest, "duration_s", rule, f"{duration_s:g} s")
    rule = "be left out of models that know no tracker's losses"
    remedy = "A network of recordings with gaps knows them."
    require(group.loses_individuals or not as_tracked, "as_tracked", rule, "given", remedy)
    size = group.individuals
    if individuals is not None:
        size = integer("individuals", individuals, 1)
    longer = group.in_group(size, tank_cm, steps=steps)
    values = np.array([[float(parameters[name]) for name in names]])
    rng = np.random.default_rng(seed)
    positions = (longer.track if as_tracked else longer.simulate)(values, rng)[0]
    present = np.isfinite(positions).all(axis=-1)
    # where individuals come and go there are more than at once
    everybody = positions.shape[1]
    width = len(str(everybody))
    return Trajectories(
        positions=np.where(present[..., None], positions, 0.0),
        present=present,
        fps=group.fps,
        individuals=tuple(f"{k + 1:0{width}}" for k in range(everybody)),
        source="simulation",
    )


def beyond_recorded(
    simulated: Trajectories,
    recordings: Sequence[Trajectories],
    tank_cm: tuple[float, float] | None = None,
) -> list[str]:
    """Return in words where a simulated group leaves what was recorded: its density, its tank, its places.

    Parameters
    ----------
    simulated
        The group.
    recordings
        What its model was inferred from, in cm.
    tank_cm
        Width and height (cm) of its tank, where that is another one.
    """
    recorded_sides = np.array([np.ptp(recording.reach, axis=0) for recording in recordings])
    areas = recorded_sides.prod(axis=1)
    densities = np.array([recording.at_once for recording in recordings]) / areas
    if tank_cm is None:
        sides = np.ptp(simulated.reach, axis=0)
    else:
        sides = np.array(tank_cm)
    density = simulated.at_once / sides.prod()
    warnings = []
    if not densities.min() / DENSER <= density <= densities.max() * DENSER:
        recorded = _range(densities * 1e4)
        warnings.append(
            f"{density * 1e4:.3g} individuals in a square metre; recorded were {recorded}"
        )
    longest = recorded_sides.max(axis=1)
    if not longest.min() / DENSER <= sides.max() <= longest.max() * DENSER:
        where = "they spread over" if tank_cm is None else "a tank of"
        warnings.append(
            f"{where} {sides[0]:.3g} x {sides[1]:.3g} cm; recorded were {_range(longest)} cm at most"
        )
    return warnings


def _range(values: np.ndarray) -> str:
    low = float(values.min())
    high = float(values.max())
    if math.isclose(low, high, rel_tol=0.005):
        return f"{low:.3g}"
    return f"{low:.3g} to {high:.3g}"
