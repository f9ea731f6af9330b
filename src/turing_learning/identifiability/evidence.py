"""Genuine and simulated samples to compare, and quantities of their motion."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.analysis import polarization
from turing_learning.config import Configuration, ConfigurationError
from turing_learning.errors import integer, require
from turing_learning.models import Parameter
from turing_learning.purposes import CHECK
from turing_learning.swarm import execution_of, initial_poses, simulate
from turing_learning.systems import Genuine, Source, System
from turing_learning.trajectories import SIGNALS, Trajectories, compute_signals

OBSERVING, TESTING, PROFILING, COMPARING, RECOVERING = range(5)
LEAST_TESTING = 4
"""Genuine samples that must be kept out for a test."""
LEAST_POINTS = 6
"""Values of a profile: with fewer, the stretch between the neighbors of one of them is half of the range or more."""

HISTOGRAM_BINS = 40
DRAWN_PERCENTILES = (0.5, 99.5)
"""Percentiles between which a picture shows a distribution; what is beyond them counts in the outermost bins."""
# simulated samples whose signals are compared
COMPARED = 500
GROUPS = 20
EVERY_S = 0.5


@dataclass(frozen=True)
class Effort:
    """How much is simulated and trained.

    Parameters
    ----------
    samples
        Samples of each kind that a panel learns from, at most, and simulated ones that it judges, at least.
    references
        Models that the run calls plausible, which are tested as if they were the system.
    points
        Values of each parameter in a profile, over its initial range, at least 6; 0 leaves profiles out.
    """

    samples: int = 200
    references: int = 12
    points: int = 8

    def __post_init__(self) -> None:
        integer("samples", self.samples, 10, error=ConfigurationError)
        integer("references", self.references, 2, error=ConfigurationError)
        integer("points", self.points, 0, error=ConfigurationError)
        rule = f"be at least {LEAST_POINTS}, or 0 for no profiles"
        remedy = "With fewer, a profile leaves half of the range open."
        fits = self.points == 0 or self.points >= LEAST_POINTS
        require(fits, "points", rule, self.points, remedy, error=ConfigurationError)


@dataclass(frozen=True, eq=False)
class Evidence:
    """Genuine samples, and a simulator of models."""

    learning: np.ndarray  #: (K, T, D), genuine samples that a panel learns from
    #: (H, T, D), genuine samples that neither the run nor a panel has learned from
    testing: np.ndarray
    #: (H,), which of them belong together, because they are of one individual
    groups: np.ndarray
    grouping: str  #: What a group is, in a word
    #: (values (M, P) in their users' units, rng) -> samples (at most M, C, T, D); simulations that fail are left out
    simulate: Callable[[np.ndarray, np.random.Generator], np.ndarray]
    #: Name -> parameter with its initial range, P of them
    parameters: Mapping[str, Parameter]
    names: tuple[str, ...] = ()  #: Of the D signals; empty: they have none
    interval_s: float = 1.0  #: Duration of a step (s)

    def __post_init__(self) -> None:
        count = len(self.testing)
        rule = f"keep at least {LEAST_TESTING} samples for testing"
        remedy = "Run again with a larger share, or shorter windows."
        require(count >= LEAST_TESTING, "held_out", rule, count, remedy, error=ConfigurationError)
        rule = "tell at least 2 groups of held-out samples apart"
        remedy = "Name other groups, such as blocks of time."
        groups = len(np.unique(self.groups))
        require(groups >= 2, "groups", rule, groups, remedy, error=ConfigurationError)


def stream(seed: int, *purpose: int) -> np.random.Generator:
    """Return the random numbers of one purpose."""
    return np.random.default_rng((CHECK, seed, *purpose))


def evidence_of(
    configuration: Configuration, source: Source, effort: Effort, seed: int, groups: np.ndarray | None = None
) -> Evidence:  # fmt: skip
    """Return genuine samples of a run's system, and what simulates models of it, from the run's source, opened again.

    Agents of a simulated swarm are observed one in each trial, so that no two samples have met; models are
    executed by a replica among agents, as in the run. Of a custom system they are the samples that the run
    learned from, and those held out; `groups` (H,) says which of these belong together, else the source does.
    """
    system = configuration.system
    rng = stream(seed, OBSERVING)
    data = source.genuine
    grouping = "trials" if data is None else data.grouping
    # Without a generation a failed simulation is left out; in a run it would be an error.
    source.generation = None
    if data is None:
        # Observed at once: two calls would draw other trials.
        genuine = source.genuine_samples(2 * effort.samples, rng)
        learning = genuine[: effort.samples]
        testing = genuine[effort.samples :]
    else:
        learning = source.genuine_samples(effort.samples, rng)
        testing = data.testing
        if data.live is not None:
            testing = source.genuine_samples(effort.samples, rng)
        if groups is not None:
            grouping = "groups"
        elif data.groups is not None:
            groups = data.groups
    return Evidence(
        learning=learning,
        testing=testing,
        groups=np.arange(len(testing)) if groups is None else groups,
        grouping=grouping,
        simulate=source.simulate,
        parameters=system.parameters,
        names=tuple(system.signals),
        interval_s=system.interval_s or 1.0,
    )


def labelled_groups(data: Genuine, labels: Any) -> np.ndarray:
    """Return which held-out samples (H,) belong together, by labels of all samples (K,)."""
    labels = np.asarray(labels)
    rule = f"be one label for each of the {len(data.samples)} samples"
    fits = labels.shape == (len(data.samples),)
    require(fits, "groups", rule, f"shape {labels.shape}", error=ConfigurationError)
    return np.unique(labels[data.held_out], return_inverse=True)[1]


class Stored:
    """What `check.json` holds: a dataclass by its fields."""

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name."""
        return dict(vars(self))


@dataclass(frozen=True)
class Quantity(Stored):
    """The distribution of one quantity."""

    name: str  #: What it is
    unit: str  #: Of its values
    edges: tuple[float, ...]  #: Of the bins
    genuine: tuple[float, ...]  #: Share of the genuine values in each bin
    simulated: tuple[float, ...]  #: The same of simulated ones

    @property
    def overlap(self) -> float:
        """Share that the two distributions have in common, 0 to 1."""
        return float(np.minimum(self.genuine, self.simulated).sum())


Values = Mapping[str, np.ndarray]
"""Name of a quantity -> its values, of any shape."""


def compare_quantities(
    genuine: Values, simulated: Values, units: Mapping[str, str]
) -> tuple[Quantity, ...]:
    """Bin the values of quantities that both sides have."""
    quantities = []
    for name, values in genuine.items():
        if not np.size(values) or not np.size(simulated.get(name, ())):
            continue
        sides = (np.ravel(values), np.ravel(simulated[name]))
        percentiles = np.array([np.percentile(side, DRAWN_PERCENTILES) for side in sides])
        low = float(percentiles[:, 0].min())
        high = float(percentiles[:, 1].max())
        # all values are the same: a bin of width 1 around them can be drawn
        if high - low < 1e-9 * max(abs(low), abs(high), 1.0):
            low -= 0.5
            high += 0.5
        edges = np.linspace(low, high, HISTOGRAM_BINS + 1)
        shares = []
        for side in sides:
            # What lies beyond the edges counts in the outermost bins.
            share = np.histogram(np.clip(side, low, high), edges)[0] / len(side)
            shares.append(tuple(share.tolist()))
        unit = units.get(name, "")
        quantities.append(Quantity(name, unit, tuple(edges.tolist()), shares[0], shares[1]))
    return tuple(quantities)


def signal_quantities(
    genuine: np.ndarray, simulated: np.ndarray, system: System
) -> tuple[Quantity, ...]:
    """Compare the signals of genuine samples of a system with those of simulated ones, (K, T, D) and (any, ..., T, D)."""
    genuine_values = {}
    model_values = {}
    for d, name in enumerate(system.signals):
        genuine_values[name] = genuine[..., d]
        model_values[name] = simulated[..., d]
    return compare_quantities(genuine_values, model_values, system.signal_units)


def swarm_quantities(
    configuration: Configuration, model: np.ndarray, *, seed: int
) -> tuple[Quantity, ...]:
    """Compare swarms of agents alone with swarms in which everybody executes a model (P,), from the same starts."""
    scenario = configuration.swarm
    rng = stream(seed, COMPARING, 1)
    poses = initial_poses(scenario, GROUPS, rng)
    every = max(1, round(EVERY_S / scenario.trial.control_interval_s))
    sides: list[Values] = []
    for executed in (-1, 0):
        everybody = np.full((GROUPS, scenario.individuals), executed)
        robots = execution_of(
            scenario, configuration.representation.behavior(model[None]), everybody
        )
        options = vars(robots) | {"seed": seed, "threads": configuration.threads}
        moved = simulate(
            scenario, initial_poses=poses, control_steps=scenario.control_steps, **options
        )
        observed = moved.poses[:, ::every, : scenario.individuals]
        directions = np.stack([np.cos(observed[..., 2]), np.sin(observed[..., 2])], axis=-1)
        signals = {"speed": moved.speeds[..., 0], "turn": moved.speeds[..., 1]}
        sides.append({**signals, **_together(observed[..., :2], directions, 1 / EVERY_S)})
    return compare_quantities(sides[0], sides[1], SIGNALS)


def recorded_quantities(
    recordings: Sequence[Trajectories], group: Any, estimate: np.ndarray, *, seed: int
) -> tuple[Quantity, ...]:
    """Compare how near neighbors are, and how aligned groups are, in recordings and in groups that execute the estimate.

    The `group` simulates positions (M, F, A, 2) of models (M, P), and has an `interval_s`, as
    `turing_learning.families.Family`.
    """
    rng = stream(seed, COMPARING, 1)
    genuine: list[Values] = []
    for recording in recordings:
        # Nobody is near to, or aligned with, an individual that is alone.
        if len(recording.individuals) < 2:
            continue
        likely = recording.cleared()
        neighbor = likely.signals(("neighbor_distance",))
        consecutive = likely.present[1:] & likely.present[:-1]
        aligned = polarization(np.diff(likely.positions, axis=0), consecutive)
        distances = neighbor.values[neighbor.valid]
        genuine.append({"neighbor_distance": distances, "polarization": aligned})
    simulated: list[Values] = []
    groups = getattr(group, "groups", (group,))
    models = np.tile(estimate, (-(-GROUPS // len(groups)), 1))
    for group_of_one in groups:
        positions = group_of_one.simulate(models, rng)
        directions = np.diff(positions[:, 1:], axis=1)
        simulated.append(_together(positions[:, 1:-1], directions, 1 / group.interval_s))
    return compare_quantities(_joined(genuine), _joined(simulated), SIGNALS)


def _joined(groups: Sequence[Values]) -> Values:
    """Return the values of several groups together."""
    values: dict[str, list[np.ndarray]] = {}
    for quantities in groups:
        for name, values_of_part in quantities.items():
            values.setdefault(name, []).append(np.ravel(values_of_part))
    return {name: np.concatenate(pieces) for name, pieces in values.items()}


def _together(positions: np.ndarray, directions: np.ndarray, fps: float) -> Values:
    """Return distances of nearest neighbors and polarization, of positions and directions (R, F, A, 2), NaN where absent."""
    if positions.shape[2] < 2:
        return {}
    present = np.isfinite(positions).all(axis=-1)
    names = ("neighbor_distance",)
    neighbor = compute_signals(np.nan_to_num(positions), fps=fps, names=names, present=present)
    distances = neighbor.values[neighbor.valid]
    return {"neighbor_distance": distances, "polarization": polarization(directions)}
