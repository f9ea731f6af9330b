"""Where to spend the next trials: models that may be right, as a cloud of walkers in the space of parameters."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from ..errors import integer, number
from ._checks import Seed, check_seed, generation_rng, state_arrays

Density = Callable[..., np.ndarray]
"""Logarithm (N,) of the density with which models (N, P) are the right one; if `hopeful`, of little-known ones, too.

Explorers ask for a `power` of it, from 0 to 1. Walkers say with `least` (N,) from which value on a move counts:
anything below may be minus infinity, which saves computing it.
"""

WALKERS = 150
_NEAREST = 2  # a walker's companions are the nearest 1 / 2 of all
_SCATTER = 1e-4
_SCOUTS = 0.25  # of all proposals
_EXPLORED = 0.16  # power of the density that explorers follow: they lie 2.5 times wider
_LOST = 20.0  # a walker so far below the best, in the logarithm of the density, starts again beside another


class TrialDesign:
    """Walkers that follow a density, and batches of models around them.

    After `start`, a uniform Latin hypercube, each batch is drawn by `propose` around walkers, wider than they
    lie; in the first part of a run some proposals have a parameter drawn anew, or two groups exchanged. `move`
    lets the walkers follow a new density by the Metropolis rule: by differences of two others, by one parameter
    drawn anew, and by exchanges of two groups, in turn. Moves cost no trial, so every exchange is tried in
    earnest, and as many centers stay alive as the density has.

    A quarter of each batch is drawn from scouts. They are walkers to which a model is not less likely for being
    little known. Explorers are scouts that follow a power of the density, because a map is too sure of itself
    where nothing has been tried. Where only a product of two parameters shows, many models are equally good;
    without explorers, trials gather in the part of them that is known best.

    Source: ter Braak, A Markov chain Monte Carlo version of the genetic algorithm differential evolution
    (2006).

    Parameters
    ----------
    dimension
        Number of parameters P, in units in which the range of first models is [-1, 1].
    seed
        Entropy: a non-negative integer or a sequence of them.
    groups, dependent
        Indices of parameters that may be exchanged, and of those drawn anew then; see `EvolutionStrategy`.
    limits : (P,) bool
        Which parameters end at -1 and 1. The others may leave the range at a cost, that of a normal one with
        the deviation `margin` beyond it.
    saturated : (P,) bool
        Of those that may leave it: for which anything beyond -1 and 1 is the same as that end, and is stated as
        such.
    walkers
        Number of walkers W.
    moves
        Moves of each walker per batch.
    widening
        How many times wider than the walkers the proposals lie.
    exploration
        Share of proposals that jump at the beginning; it falls to 0 at 0.6 of the run.
    margin
        See `limits`.
    symmetries
        What may turn one solution into another: the order in which parameters are taken, and their signs. They take the
        place of `groups`.
    explorers
        Share of explorers in the last batch of a run; it grows from 0 in proportion to the trials spent.
    """

    def __init__(
        self, dimension: int, *, seed: Seed, groups: Sequence[Sequence[int]] = (), dependent: Sequence[int] = (),
        limits: np.typing.ArrayLike = False, saturated: np.typing.ArrayLike = False, walkers: int = WALKERS,
        moves: int = 12, widening: float = 2.5, exploration: float = 0.15, margin: float = 0.05,
        explorers: float = 0.0, symmetries: Sequence[tuple[Sequence[int], Sequence[float]]] = (),
    ) -> None:  # fmt: skip
        self.dimension = integer("dimension", dimension, 1)
        self._seed = check_seed(seed)
        self._groups = np.array([list(group) for group in groups], dtype=np.int64)
        self._dependent = list(dependent)
        self._symmetries = [(np.asarray(order), np.asarray(signs, dtype=float)) for order, signs in symmetries]
        self._limits, self._saturated = (
            np.broadcast_to(np.asarray(one, dtype=bool), (dimension,)) for one in (limits, saturated)
        )
        self._moves = integer("moves", moves, 1)
        self._widening = number("widening", widening, least=1)
        self._exploration = number("exploration", exploration, least=0, most=1)
        self._margin = number("margin", margin, above=0)
        self._share = number("explorers", explorers, least=0, most=1 - _SCOUTS)
        count = integer("walkers", walkers, 4)
        self._places = generation_rng(self._seed, 0).uniform(-1, 1, (count, dimension))
        self._scouts = self._places[: count // 2].copy()
        self._explorers = self._scouts.copy()
        self._step = 0

    @property
    def walkers(self) -> np.ndarray:
        """Draws of the right model (W, P)."""
        return self._stated(self._places)

    @property
    def furthest(self) -> np.ndarray:
        """How far (P,) from the middle of their range parameters may be tried."""
        return np.where(self._limits | self._saturated, 1.0, 1.5)

    def start(self, count: int) -> np.ndarray:
        """Return the first models (count, P): in each parameter one in each of `count` equal parts of its range."""
        rng = generation_rng(self._seed, 1)
        strata = np.stack([rng.permutation(count) for _ in range(self.dimension)], axis=1)
        return 2 * (strata + rng.random(strata.shape)) / count - 1

    def propose(self, count: int, progress: float) -> np.ndarray:
        """Return models (count, P) to be tried next; `progress` is the share of the trials spent."""
        rng = generation_rng(self._seed, 2 * self._step + 2)
        walkers = self._places
        chosen = np.concatenate([rng.permutation(len(walkers)) for _ in range(-(-count // len(walkers)))])[:count]
        models, scale = walkers[chosen].copy(), walkers.std(axis=0) + 1e-9
        distances = (((walkers[chosen][:, None] - walkers) / scale) ** 2).sum(axis=2)
        near = np.argsort(distances, axis=1, kind="stable")[:, 1 : 1 + len(walkers) // _NEAREST]
        pairs = rng.integers(near.shape[1], size=(2, count))
        jump = rng.random(count) < self._exploration * max(0.0, 1 - progress / 0.6)
        first, second = (walkers[near[np.arange(count), pair]] for pair in pairs)
        models[~jump] += (np.sqrt((self._widening**2 - 1) / 2) * (first - second))[~jump]
        for k in np.flatnonzero(jump):
            self._jump(models[k : k + 1], rng, exchange=bool(rng.random() < 0.5))
        order, scouts, explorers = rng.permutation(count), round(_SCOUTS * count), round(self._share * progress * count)
        for sent, cloud in ((order[:scouts], self._scouts), (order[scouts:][:explorers], self._explorers)):
            models[sent] = cloud[rng.integers(len(cloud), size=len(sent))]
        return np.clip(models, -self.furthest, self.furthest)

    def gather(self, places: np.ndarray) -> None:
        """Let the walkers go on from models (N, P), each from one, evenly."""
        self._places = places[np.arange(len(self._places)) * len(places) // len(self._places)].copy()

    def move(self, density: Density) -> None:
        """Let all walkers follow a density."""
        rng = generation_rng(self._seed, 2 * self._step + 3)
        self._places = self._followed(self._places, density, rng)
        self._scouts = self._followed(self._scouts, partial(density, hopeful=True), rng)
        if self._share:
            self._explorers = self._followed(self._explorers, partial(density, hopeful=True, power=_EXPLORED), rng)
        self._step += 1

    def _followed(self, walkers: np.ndarray, density: Density, rng: np.random.Generator) -> np.ndarray:
        """Return where walkers (W, P) are after their moves by the Metropolis rule."""
        walkers = walkers.copy()
        height = self._height(walkers, density)
        lost = height < height.max() - _LOST
        alive = np.flatnonzero(~lost)
        companions = alive[rng.integers(len(alive), size=int(lost.sum()))]
        walkers[lost] = walkers[companions]
        height[lost] = height[companions]
        count = self._moves if self._step else 3 * self._moves
        for move in range(count):
            moved = self._moved(walkers, move, rng)
            # drawn before the density is computed, which need not be where it is too low to count
            least = height + np.log(rng.random(len(walkers)))
            new = self._height(moved, density, least)
            accepted = new > least
            walkers[accepted] = moved[accepted]
            height[accepted] = new[accepted]
        return walkers

    def _moved(self, place: np.ndarray, number: int, rng: np.random.Generator) -> np.ndarray:
        moved, count = place.copy(), len(place)
        if number % 2 == 0:
            pairs = rng.integers(count, size=(2, count))
            reach = 2.38 / np.sqrt(2 * self.dimension) * rng.uniform(0.3, 1.2, count)
            reach[rng.random(count) < 0.15] = 1.0  # to another center
            moved += reach[:, None] * (place[pairs[0]] - place[pairs[1]])
            moved += _SCATTER * rng.standard_normal(moved.shape)
        else:
            self._jump(moved, rng, exchange=number % 4 == 3)
        return moved

    def _jump(self, models: np.ndarray, rng: np.random.Generator, *, exchange: bool) -> None:
        """Exchange two groups of each model (N, P) in place, or draw one of its parameters anew."""
        if exchange and self._symmetries:
            for model in models:
                order, signs = self._symmetries[rng.integers(len(self._symmetries))]
                model[:] = signs * model[order]
            return
        rows = np.arange(len(models))
        if not exchange or len(self._groups) < 2:
            parameter = rng.integers(self.dimension, size=len(models))
            models[rows, parameter] = rng.uniform(-1, 1, len(models))
            return
        order = rng.permuted(np.tile(np.arange(len(self._groups)), (len(models), 1)), axis=1)
        first = self._groups[order[:, 0]]
        second = self._groups[order[:, 1]]
        before = models.copy()
        models[rows[:, None], first] = before[rows[:, None], second]
        models[rows[:, None], second] = before[rows[:, None], first]
        models[:, self._dependent] = rng.uniform(-1, 1, (len(models), len(self._dependent)))

    def _height(self, models: np.ndarray, density: Density, least: np.ndarray | None = None) -> np.ndarray:
        """Return the density (N,) of models (N, P), less what it costs to leave the range; see `Density` for `least`."""
        outside = np.maximum(np.abs(models) - 1, 0)
        cost = 0.5 * ((outside / self._margin) ** 2).sum(axis=1)
        height = np.full(len(models), -np.inf)
        allowed = ~(outside[:, self._limits] > 0).any(axis=1)
        stated = self._stated(models[allowed])
        if least is None:
            height[allowed] = density(stated) - cost[allowed]
        else:
            height[allowed] = density(stated, least=least[allowed] + cost[allowed]) - cost[allowed]
        return height

    def _stated(self, models: np.ndarray) -> np.ndarray:
        return np.where(self._saturated, np.clip(models, -1, 1), models) if self._saturated.any() else models

    def state(self) -> dict[str, np.ndarray]:
        """Return walkers, scouts, explorers and the number of moves made."""
        return {
            "walkers": self._places.copy(),
            "scouts": self._scouts.copy(),
            **({"explorers": self._explorers.copy()} if self._share else {}),
            "step": np.array(self._step, dtype=np.int64),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state of a design with the same settings."""
        held = state_arrays(state, {"walkers": "W P", "step": ""}, W=len(self._places), P=self.dimension)
        scouts = state.get("scouts", held["walkers"][: len(self._scouts)])  # states of before had none
        clouds = {"scouts": scouts, "explorers": state.get("explorers", scouts)}
        held |= state_arrays(clouds, dict.fromkeys(clouds, "V P"), V=len(self._scouts), P=self.dimension)
        self._places, self._scouts, self._explorers = held["walkers"], held["scouts"], held["explorers"]
        self._step = int(held["step"])
