"""Ridges: models that are as good as each other, because only products or sums of parameters show.

Draws say along which direction a ridge runs, and end where nothing was tried. Whether it goes on is
asked of samples of models all along it (`Examiner.along_ridge`). Decision 0076.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy  # its parts come when they are used: scipy.stats alone takes a second

from turing_learning.models import Parameter

WIDE = 0.1
"""Width of the central 90 % of draws, in widths of the range, from which a ridge is looked for."""

MOST_UNEXPLAINED = 0.2, 0.4
"""Shares of a parameter's variance, up to which the others say what it is, one tried after the other."""

SIMPLE = np.array([0, 1 / 3, 1 / 2, 1, 2, 3])
"""Sizes of exponents and factors that are tried."""

ROUNDED = 0.2
"""By how much those of draws may differ from these."""

LEAST_POSITIVE = 1e-3
"""Of half the range: what is less is taken for so much, where the logarithm is taken."""

SWEEPS = 30
"""Steps of each draw along a ridge of several directions."""

INTERVAL_TAIL = 0.05
"""Share of the draws beyond each end of an interval."""


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of models in which a ridge may be straight: logarithms of parameters, or numbers.

    Models (N, P) are in units of the space, in which the range is from -1 to 1.
    """

    logarithmic: bool  #: Whether these are logarithms, but for a constant
    zeros: np.ndarray  #: (P,), where parameters are 0 whose logarithm is taken; -inf for the others
    units: np.ndarray  #: (P,), of the coordinates, in units of the space or of its logarithm
    possible: np.ndarray  #: (P,) bool, which parameters have such a coordinate

    def of(self, models: np.ndarray) -> np.ndarray:
        """Return the coordinates (N, P) of models (N, P)."""
        logarithmic = np.isfinite(self.zeros)
        sizes = np.where(logarithmic, models - self.zeros, 1)
        logarithms = np.log(np.maximum(sizes, LEAST_POSITIVE))
        return self.units * np.where(logarithmic, logarithms, models)

    def models_of(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the models (N, P) of such coordinates (N, P)."""
        logarithmic = np.isfinite(self.zeros)
        models = coordinates / self.units
        sizes = np.exp(np.where(logarithmic, models, 0))
        return np.where(logarithmic, sizes + self.zeros, models)


def ridge_coordinates(parameters: Mapping[str, Parameter]) -> list[Coordinates]:
    """Return the coordinates in which a ridge of a custom system may be straight."""
    count = len(parameters)
    zeros = np.full(count, -np.inf)
    units = np.ones((2, count))
    possible = np.zeros((2, count), dtype=bool)
    for index, parameter in enumerate(parameters.values()):
        assert parameter.initial is not None
        low, high = parameter.initial
        half = (high - low) / 2
        if parameter.scale == "log":
            units[0, index] = np.log(high / low) / 2
            possible[0, index] = True
            continue
        units[1, index] = half
        possible[1, index] = True
        if parameter.low is not None and parameter.low >= 0:
            zeros[index] = -(low + high) / (high - low)
            possible[0, index] = True
    numbers = np.full(count, -np.inf)
    return [
        Coordinates(True, zeros, units[0], possible[0]),
        Coordinates(False, numbers, units[1], possible[1]),
    ]


@dataclass(frozen=True, eq=False)
class Ridge:
    """What shows of some parameters, each a product or a sum, and so what does not."""

    coordinates: Coordinates
    #: (M, P), exponents of each product, or factors of each sum
    shown: np.ndarray

    @property
    def members(self) -> np.ndarray:
        """Which parameters (P,) lie along it."""
        return np.asarray((self.shown != 0).any(axis=0))

    @property
    def directions(self) -> np.ndarray:
        """Directions (K, P) of its coordinates."""
        members = self.members
        free = scipy.linalg.null_space(self.shown[:, members]).T
        directions = np.zeros((len(free), len(members)))
        directions[:, members] = free
        return directions

    def spread(self, draws: np.ndarray, widest: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return draws (D, P) moved to anywhere on the ridge, all models in range equally likely.

        Each keeps what shows of it. Models are within +-widest (P,).
        """
        coordinates = self.coordinates
        low = coordinates.of(-widest[None])[0]
        high = coordinates.of(widest[None])[0]
        moved = np.clip(coordinates.of(draws), low, high)
        directions = self.directions
        # where all models are equally likely, their logarithms are not
        slopes = np.isfinite(coordinates.zeros) / coordinates.units
        for _ in range(1 if len(directions) == 1 else SWEEPS):
            along = rng.standard_normal((len(moved), len(directions))) @ directions
            lengths = np.where(along == 0, 1e-12, along)
            bounds = np.sort(((low - moved) / lengths, (high - moved) / lengths), axis=0)
            backward = np.minimum(bounds[0].max(axis=1), 0)
            forward = np.maximum(bounds[1].min(axis=1), 0)
            steps = _exponential(along @ slopes, backward, forward, rng)
            moved = np.clip(moved + steps[:, None] * along, low, high)
        return coordinates.models_of(moved)

    def middle(self, draws: np.ndarray) -> np.ndarray:
        """Return the model (P,) on the ridge that is nearest to the medians of draws (D, P) on it.

        In units of their spread. What shows of it is the median of what shows of them. The medians
        alone are beside a ridge that is curved or has several directions.
        """
        values = self.coordinates.of(draws)
        medians = np.median(values, axis=0)
        missing = np.median(values @ self.shown.T, axis=0) - self.shown @ medians
        steps = values.var(axis=0)[:, None] * self.shown.T
        moved = medians + steps @ np.linalg.solve(self.shown @ steps, missing)
        on_ridge = self.coordinates.models_of(moved[None])[0]
        return np.where(self.members, on_ridge, np.median(draws, axis=0))

    def ends(self, models: np.ndarray) -> list[np.ndarray]:
        """Return the thirds (N, P) of models (3 N, P) on it that are farthest to either side, for each direction."""
        thirds: list[np.ndarray] = []
        for direction in self.directions:
            order = np.argsort(self.coordinates.of(models) @ direction, kind="stable")
            size = len(models) // 3
            thirds.extend((models[order[:size]], models[order[-size:]]))
        return thirds


def _exponential(
    slopes: np.ndarray, low: np.ndarray, high: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Draw numbers (N,) from low (N,) to high (N,), with a density whose logarithm has slopes (N,)."""
    growth = slopes * (high - low)
    uniform = rng.random(len(growth))
    flat = np.abs(growth) < 1e-6
    growth = np.where(flat, 1.0, growth)
    # from the end where the density is higher, so that nothing overflows
    share = np.log1p(uniform * np.expm1(-np.abs(growth))) / -np.abs(growth)
    share = np.where(growth > 0, 1 - share, share)
    return low + (high - low) * np.where(flat, uniform, share)


def ridges(
    draws: np.ndarray, widest: np.ndarray, alternatives: Sequence[Coordinates]
) -> Iterator[Ridge]:
    """Yield the ridges along which draws (D, P) of a solution, within +-widest (P,), may lie.

    One for each of the coordinates in which some parameters follow from the others, if one of these
    is wide. Exponents and factors are taken for simple ones.
    """
    low, high = np.quantile(draws, [INTERVAL_TAIL, 1 - INTERVAL_TAIL], axis=0)
    wide = high - low > WIDE * 2 * widest
    if not wide.any() or len(widest) < 2:
        return
    tried = set()
    for coordinates, most_unexplained in product(alternatives, MOST_UNEXPLAINED):
        values = coordinates.of(draws)
        spreads = values.std(axis=0) + 1e-12
        correlation = np.corrcoef(values.T) + 1e-9 * np.eye(len(widest))
        unexplained = 1 / np.diag(np.linalg.inv(correlation))
        members = np.flatnonzero((unexplained < most_unexplained) & coordinates.possible)
        if len(members) < 2 or not wide[members].any():
            continue
        variances, vectors = np.linalg.eigh(correlation[np.ix_(members, members)])
        shows = variances < most_unexplained
        if shows.all() or not shows.any():
            continue
        simple = _simple(vectors[:, shows].T / spreads[members])
        if not len(simple):
            continue
        shown = np.zeros((len(simple), len(widest)))
        shown[:, members] = simple
        key = coordinates.logarithmic, shown.tobytes()
        if key not in tried:
            tried.add(key)
            yield Ridge(coordinates, shown)


def _simple(normals: np.ndarray) -> np.ndarray:
    """Return simple exponents or factors (M, N) of what shows, given by normals (M, N) of a ridge.

    Each of the M has one parameter of its own. None where they are not simple, and none of what is
    one parameter alone.
    """
    count = len(normals)
    own = scipy.linalg.qr(normals, mode="r", pivoting=True)[1][:count]
    reduced = np.linalg.solve(normals[:, own], normals)
    nearest = SIMPLE[np.abs(np.abs(reduced)[..., None] - SIMPLE).argmin(axis=-1)]
    if np.abs(np.abs(reduced) - nearest).max() > ROUNDED:
        return np.empty((0, normals.shape[1]))
    # no -0, which would be another key
    simple = np.sign(reduced) * nearest + 0.0
    return simple[(simple != 0).sum(axis=1) > 1]


def expressions(shown: np.ndarray, logarithmic: bool, names: Sequence[str]) -> tuple[str, ...]:
    """Return what shows, given by exponents or factors (M, P) of the parameters, as "a x b^2 / c" or "a + 2 b"."""
    texts = []
    for row in shown:
        sizes = row / np.abs(row[row != 0]).min()
        numerator: list[str] = []
        denominator: list[str] = []
        for name, size in zip(names, sizes * np.sign(sizes[np.flatnonzero(sizes)[0]]), strict=True):
            if not size:
                continue
            number = f"{abs(size):.3g}"
            if number == "1":
                text = name
            elif logarithmic:
                text = f"{name}^{number}"
            else:
                text = f"{number} {name}"
            (numerator if size > 0 else denominator).append(text)
        joint, apart = (" x ", " / ") if logarithmic else (" + ", " - ")
        texts.append(apart.join([joint.join(numerator), *denominator]))
    return tuple(texts)
