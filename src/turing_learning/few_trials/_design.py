"""Where to spend the next trials: models that may be right, as a cloud of walkers in the space of
parameters."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from turing_learning.errors import integer, number
from turing_learning.evolution import Seed, check_seed, generation_rng, state_arrays

from ._space import SearchSpace
from ._symmetry import SymmetryGroup

LogDensity = Callable[..., np.ndarray]
"""Logarithm (N,) of the density with which models (N, P) are the right one.

See `Density` for more arguments.
"""

WALKERS = 150
"""Number of walkers."""

MOVES_PER_BATCH = 8
"""Moves of each walker per batch, and three times as many in the first one."""

WIDENING = 2.5
"""How many times wider than the walkers the proposals lie."""

EXPLORATION = 0.15
"""Share of proposals that jump at the beginning."""

EXPLORED_UNTIL = 0.6
"""Share of the trials at which it has fallen to 0."""

RANGE_MARGIN = 0.05
"""Deviation of a normal distribution beyond -1 and 1: what it costs to leave the range where a
parameter has no ends."""

SCOUTS = 0.25
"""Share of proposals that are scouts."""

EXPLORED_POWER = 0.16
"""Power of the density that explorers follow: they lie 2.5 times wider."""

RESTARTED_BELOW = 20.0
"""A walker so far below the best, in the logarithm of the density, starts again where another one
is."""

STRIDE = 2.38
"""Length of a move by the difference of two walkers, for a normal density, times root 2 P (ter
Braak 2006)."""

TO_ANOTHER_CENTER = 0.15
"""Share of these moves that are as long as the difference itself, so that they lead from center to
center."""

SCATTER = 1e-4
"""Deviation of what is added to such a move, so that walkers are not bound to the differences
between them."""


class TrialDesign:
    """Walkers that follow a density, and batches of models around them.

    After `start`, a uniform Latin hypercube, each batch is drawn by `propose` around walkers, wider
    than they lie; in the first part of a run some proposals have a parameter drawn anew, or two
    groups exchanged. `move` lets the walkers follow a new density by the Metropolis rule: by
    differences of two others, by one parameter drawn anew, and by exchanges of two groups, in turn.
    Moves cost no trial, so every exchange is tried in earnest, and as many centers stay alive as
    the density has.

    A quarter of each batch is drawn from scouts. They are walkers to which a model is not less
    likely for being little known. Explorers are scouts that follow a power of the density, because
    a map is too sure of itself where nothing has been tried. Where only a product of two parameters
    shows, many models are equally good; without explorers, trials gather in the part of them that
    is known best.

    Source: ter Braak, A Markov chain Monte Carlo version of the genetic algorithm differential
    evolution (2006). The numbers: decision 0028, "Design".

    Parameters
    ----------
    space
        Of the models.
    seed
        Entropy: a non-negative integer or a sequence of them.
    explorers
        Share of explorers in the last batch of a run; it grows from 0 in proportion to the trials
        spent.
    walkers
        Number of walkers W.
    widening, exploration
        As `WIDENING` and `EXPLORATION` say.
    """

    def __init__(
        self,
        space: SearchSpace,
        *,
        seed: Seed,
        explorers: float = 0.0,
        walkers: int = WALKERS,
        widening: float = WIDENING,
        exploration: float = EXPLORATION,
    ) -> None:
        self.space = space
        self.dimension = space.dimension
        self._seed = check_seed(seed)
        self._groups = np.array([list(group) for group in space.groups], dtype=np.int64)
        self._dependent = list(space.dependent)
        self._symmetries = list(space.symmetries)
        self._widening = number("widening", widening, least=1)
        self._exploration = number("exploration", exploration, least=0, most=1)
        self._explorers_share = number("explorers", explorers, least=0, most=1 - SCOUTS)
        count = integer("walkers", walkers, 4)
        self._raw_walkers = generation_rng(self._seed, 0).uniform(-1, 1, (count, self.dimension))
        self._scouts = self._raw_walkers[: count // 2].copy()
        self._explorers = self._scouts.copy()
        self._step = 0

    @property
    def walkers(self) -> np.ndarray:
        """Draws of the right model (W, P)."""
        return self._at_ends(self._raw_walkers)

    def start(self, count: int) -> np.ndarray:
        """Return the first models (count, P).

        In each parameter one in each of `count` equal parts of its range.
        """
        rng = generation_rng(self._seed, 1)
        strata = np.stack([rng.permutation(count) for _ in range(self.dimension)], axis=1)
        return 2 * (strata + rng.random(strata.shape)) / count - 1

    def propose(self, count: int, progress: float) -> np.ndarray:
        """Return models (count, P) to be tried next.

        `progress` is the share of the trials spent.
        """
        rng = generation_rng(self._seed, 2 * self._step + 2)
        models = self._around_walkers(count, progress, rng)
        order = rng.permutation(count)
        scouts = round(SCOUTS * count)
        explorers = round(self._explorers_share * progress * count)
        sent = order[:scouts]
        models[sent] = self._scouts[rng.integers(len(self._scouts), size=len(sent))]
        sent = order[scouts:][:explorers]
        models[sent] = self._explorers[rng.integers(len(self._explorers), size=len(sent))]
        furthest = self.space.furthest
        return np.clip(models, -furthest, furthest)

    def _around_walkers(self, count: int, progress: float, rng: np.random.Generator) -> np.ndarray:
        """Return models (count, P): walkers, moved by the difference of two neighbors.

        Some jump instead.
        """
        walkers = self._raw_walkers
        rounds = -(-count // len(walkers))
        chosen = np.concatenate([rng.permutation(len(walkers)) for _ in range(rounds)])[:count]
        models = walkers[chosen].copy()
        scale = walkers.std(axis=0) + 1e-9
        distances = (((walkers[chosen][:, None] - walkers) / scale) ** 2).sum(axis=2)
        # neighbors are the nearest half of all, so that differences are those within one center
        nearest = np.argsort(distances, axis=1, kind="stable")[:, 1 : 1 + len(walkers) // 2]
        pairs = rng.integers(nearest.shape[1], size=(2, count))
        jumps = self._exploration * max(0.0, 1 - progress / EXPLORED_UNTIL)
        jump = rng.random(count) < jumps
        rows = np.arange(count)
        difference = walkers[nearest[rows, pairs[0]]] - walkers[nearest[rows, pairs[1]]]
        # a walker plus so many times a difference has `widening` times the walkers' deviation
        length = np.sqrt((self._widening**2 - 1) / 2)
        models[~jump] += (length * difference)[~jump]
        for k in np.flatnonzero(jump):
            self._jump(models[k : k + 1], rng, exchange=bool(rng.random() < 0.5))
        return models

    def gather(self, models: np.ndarray) -> None:
        """Let the walkers go on from models (N, P), each from one, evenly."""
        count = len(self._raw_walkers)
        self._raw_walkers = models[np.arange(count) * len(models) // count].copy()

    def move(self, density: LogDensity) -> None:
        """Let all walkers follow a density."""
        rng = generation_rng(self._seed, 2 * self._step + 3)
        self._raw_walkers = self._moved_walkers(self._raw_walkers, density, rng)
        optimistic = partial(density, optimistic=True)
        self._scouts = self._moved_walkers(self._scouts, optimistic, rng)
        if self._explorers_share:
            wide = partial(density, optimistic=True, power=EXPLORED_POWER)
            self._explorers = self._moved_walkers(self._explorers, wide, rng)
        self._step += 1

    def fold(self, group: SymmetryGroup) -> None:
        """Bring all walkers to one of the regions that are images of each other."""
        self._raw_walkers = group.folded(self._raw_walkers)
        self._scouts = group.folded(self._scouts)
        self._explorers = group.folded(self._explorers)

    def _moved_walkers(
        self, walkers: np.ndarray, density: LogDensity, rng: np.random.Generator
    ) -> np.ndarray:
        """Return where walkers (W, P) are after their moves by the Metropolis rule."""
        walkers = walkers.copy()
        height = self._height(walkers, density)
        lost = height < height.max() - RESTARTED_BELOW
        alive = np.flatnonzero(~lost)
        companions = alive[rng.integers(len(alive), size=int(lost.sum()))]
        walkers[lost] = walkers[companions]
        height[lost] = height[companions]
        for round_number in range(MOVES_PER_BATCH if self._step else 3 * MOVES_PER_BATCH):
            moved = self._proposed_moves(walkers, round_number, rng)
            # drawn before the density is computed, which need not be where it is too low to count
            floor_height = height + np.log(rng.random(len(walkers)))
            heights = self._height(moved, density, floor_height)
            accepted = heights > floor_height
            walkers[accepted] = moved[accepted]
            height[accepted] = heights[accepted]
        return walkers

    def _proposed_moves(
        self, walkers: np.ndarray, round_number: int, rng: np.random.Generator
    ) -> np.ndarray:
        """Return where walkers (W, P) may go.

        Along a difference of two others, or by a jump, in turn.
        """
        moved = walkers.copy()
        count = len(walkers)
        if round_number % 2:
            self._jump(moved, rng, exchange=round_number % 4 == 3)
            return moved
        pairs = rng.integers(count, size=(2, count))
        length = STRIDE / np.sqrt(2 * self.dimension) * rng.uniform(0.3, 1.2, count)
        length[rng.random(count) < TO_ANOTHER_CENTER] = 1.0
        moved += length[:, None] * (walkers[pairs[0]] - walkers[pairs[1]])
        moved += SCATTER * rng.standard_normal(moved.shape)
        return moved

    def _jump(self, models: np.ndarray, rng: np.random.Generator, *, exchange: bool) -> None:
        """Exchange two groups of each model (N, P) in place, or draw one of its parameters anew."""
        if exchange and self._symmetries:
            for model in models:
                symmetry = self._symmetries[rng.integers(len(self._symmetries))]
                model[:] = symmetry.images_of(model)
            return
        rows = np.arange(len(models))
        if not exchange or len(self._groups) < 2:
            parameter = rng.integers(self.dimension, size=len(models))
            models[rows, parameter] = rng.uniform(-1, 1, len(models))
            return
        numbers = np.tile(np.arange(len(self._groups)), (len(models), 1))
        order = rng.permuted(numbers, axis=1)
        first = self._groups[order[:, 0]]
        second = self._groups[order[:, 1]]
        before = models.copy()
        models[rows[:, None], first] = before[rows[:, None], second]
        models[rows[:, None], second] = before[rows[:, None], first]
        shape = len(models), len(self._dependent)
        models[:, self._dependent] = rng.uniform(-1, 1, shape)

    def _height(
        self, models: np.ndarray, density: LogDensity, least: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the density (N,) of models (N, P), less what it costs to leave the range.

        For `least` see `Density`.
        """
        outside = np.maximum(np.abs(models) - 1, 0)
        cost = 0.5 * ((outside / RANGE_MARGIN) ** 2).sum(axis=1)
        height = np.full(len(models), -np.inf)
        allowed = ~(outside[:, self.space.walls] > 0).any(axis=1)
        stated = self._at_ends(models[allowed])
        if least is None:
            height[allowed] = density(stated) - cost[allowed]
        else:
            floor = least[allowed] + cost[allowed]
            height[allowed] = density(stated, least=floor) - cost[allowed]
        return height

    def _at_ends(self, models: np.ndarray) -> np.ndarray:
        """Return models (N, P), those beyond the end of a saturated parameter at that end."""
        saturated = self.space.saturated
        if not saturated.any():
            return models
        return np.where(saturated, np.clip(models, -1, 1), models)

    def state(self) -> dict[str, np.ndarray]:
        """Return walkers, scouts, explorers and the number of moves made."""
        state = {
            "walkers": self._raw_walkers.copy(),
            "scouts": self._scouts.copy(),
            "step": np.array(self._step, dtype=np.int64),
        }
        if self._explorers_share:
            state["explorers"] = self._explorers.copy()
        return state

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state of a design with the same settings."""
        shapes = {"walkers": "W P", "step": ""}
        arrays = state_arrays(state, shapes, W=len(self._raw_walkers), P=self.dimension)
        scouts = state.get("scouts", arrays["walkers"][: len(self._scouts)])
        clouds = {"scouts": scouts, "explorers": state.get("explorers", scouts)}
        shapes = dict.fromkeys(clouds, "V P")
        arrays |= state_arrays(clouds, shapes, V=len(self._scouts), P=self.dimension)
        self._raw_walkers = arrays["walkers"]
        self._scouts = arrays["scouts"]
        self._explorers = arrays["explorers"]
        self._step = int(arrays["step"])
