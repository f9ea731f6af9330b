"""What may turn one solution of a custom system into another. Decisions 0043 and 0069."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations, islice, permutations, product
from typing import Any

import numpy as np
import scipy  # its parts come when they are used: scipy.stats alone takes a second

from turing_learning.models import Parameter

FEW_EXCHANGES = 12
"""Exchanges of parameters up to which each is also tried together with each mirrored parameter."""

MOST_CANDIDATES = 300
"""Families of symmetries that are linear in the parameters, at most; as many others come to them."""

MOST_PRODUCTS = 1000
"""Symmetries with products of parameters that are made, at most."""

LEAST_INSIDE = 0.05
"""Share of the range whose images by such a symmetry are in range, too, at least."""

PROBES = 256
"""Models by which this share is measured."""

KEY_PROBES = 8
"""Those of them that are enough to tell two symmetries."""

LEAST_POSITIVE = 1e-9
"""Of half the range: what is less is taken for so much, where the logarithm is taken."""

MOST_IMAGES = 120
"""Images of a solution by symmetries in turn, at most: five parts in any order."""

MOST_TERMS = 100
"""Terms of an F-test with products of parameters, at most."""

TURNED_FRACTIONS = (1 / 2, 1 / 3, 1 / 4)
"""Parts of the range by which a parameter may be turned."""

NUMBERED_NAME = re.compile(r"(.*?)[_ ]?(\d+|(?<![^\W_])[^\W_])")
"""A name and the part of a model it is of, such as "mean_a" and "x2"."""


@dataclass(frozen=True, eq=False)
class Symmetry:
    """A transformation of models, which keeps volumes of coordinates: matrix @ coordinates + shift.

    The coordinate of a parameter is its number in units of the space, in which the range is from -1
    to 1, or the logarithm of how far that is from where the parameter is 0.

    Attributes
    ----------
    matrix : (P, P)
    shift : (P,)
    periodic : (P,) bool
        Which parameters begin again at the ends of their range.
    zeros : (P,)
        Where parameters are 0 whose logarithm is taken; -inf for the others.
    """

    matrix: np.ndarray
    shift: np.ndarray
    periodic: np.ndarray
    zeros: np.ndarray

    @classmethod
    def identity(cls, count: int) -> "Symmetry":
        """Return the symmetry of so many parameters that changes nothing."""
        zeros = np.full(count, -np.inf)
        return cls(np.eye(count), np.zeros(count), np.zeros(count, dtype=bool), zeros)

    @property
    def logarithmic(self) -> np.ndarray:
        """Of which parameters (P,) the logarithm is taken."""
        return np.isfinite(self.zeros)

    def images_of(self, models: np.ndarray) -> np.ndarray:
        """Return the images of models (..., P)."""
        images = self._models_of(self.coordinates(models) @ self.matrix.T + self.shift)
        if not self.periodic.any():
            return images
        return np.where(self.periodic, (images + 1) % 2 - 1, images)

    def halfway(self, models: np.ndarray) -> np.ndarray:
        """Return what lies between models (..., P) and their images, in its coordinates."""
        return self._models_of(
            (self.coordinates(models) + self.coordinates(self.images_of(models))) / 2
        )

    def coordinates(self, models: np.ndarray) -> np.ndarray:
        """Return the coordinates (..., P) of models (..., P)."""
        logarithmic = self.logarithmic
        if not logarithmic.any():
            return models
        sizes = np.where(logarithmic, models - self.zeros, 1)
        logarithms = np.log(np.maximum(sizes, LEAST_POSITIVE))
        return np.where(logarithmic, logarithms, models)

    def _models_of(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the models (..., P) of such coordinates."""
        logarithmic = self.logarithmic
        if not logarithmic.any():
            return coordinates
        sizes = np.exp(np.where(logarithmic, coordinates, 0))
        return np.where(logarithmic, sizes + self.zeros, coordinates)

    def joins(self, other: "Symmetry") -> bool:
        """Say whether both are linear in the same coordinates."""
        zeros = np.maximum(self.zeros, other.zeros)
        return self._linear_in(zeros) and other._linear_in(zeros)

    def _linear_in(self, zeros: np.ndarray) -> bool:
        """Say whether it is linear in the coordinates of zeros, which takes more logarithms.

        It is where parameters that have the same zero change places, and nothing else.
        """
        changed = zeros != self.zeros
        rows = self.matrix[changed]
        target = rows.argmax(axis=1)
        exchanged = (rows == np.eye(len(zeros))[target]).all() and changed[target].all()
        same = (zeros[target] == zeros[changed]).all()
        unused = not self.matrix[np.ix_(~changed, changed)].any()
        fixed = not self.shift[changed].any() and not self.periodic[changed].any()
        return bool(exchanged and same and unused and fixed)

    def after(self, before: "Symmetry") -> "Symmetry":
        """Return the symmetry that comes to this one after another, which it `joins`."""
        matrix = self.matrix @ before.matrix
        shift = self.matrix @ before.shift + self.shift
        periodic = self.periodic | ((self.matrix != 0) & before.periodic).any(axis=1)
        return Symmetry(matrix, shift, periodic, np.maximum(self.zeros, before.zeros))

    @property
    def exchanges(self) -> bool:
        """Whether parameters change places, and nothing else."""
        return bool((self.matrix >= 0).all() and not self.shift.any())

    @property
    def moved(self) -> np.ndarray:
        """Which parameters (P,) it changes."""
        still = (self.matrix == np.eye(len(self.shift))).all(axis=1) & (self.shift == 0)
        return np.asarray(~still)

    @property
    def key(self) -> tuple[float, ...]:
        """What is equal for equal ones, in whatever coordinates, beside rounding: some images."""
        images = self.images_of(_probes(len(self.shift))[:KEY_PROBES])
        return tuple((np.round(images.ravel(), 6) + 0.0).tolist())

    def orbit(self, models: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return models (N, P) with all their images, (order, N, P), and which (N,) are in range."""
        orbit = [models]
        for _ in range(self.order - 1):
            orbit.append(self.images_of(orbit[-1]))
        images = np.stack(orbit)
        return images, (np.abs(images) <= 1).all(axis=(0, 2))

    @property
    def order(self) -> int:
        """After how many times every model is as it was; 0 if more than four."""
        model = np.linspace(-0.83, 0.71, len(self.shift))
        image = model
        for times in range(1, 5):
            image = self.images_of(image)
            if np.allclose(image, model):
                return times
        return 0


@dataclass(frozen=True)
class _Axis:
    """A parameter, as far as symmetries are concerned."""

    index: int
    stem: str  #: Its name, without the part of a model it is of
    suffix: str  #: That part, "" where the name says none
    low: float  #: Of the range of the first models
    high: float
    scale: str
    positive: bool  #: Whether it is never below 0

    @property
    def kind(self) -> tuple[float, float, str]:
        """What parameters have in common that may be exchanged."""
        return self.low, self.high, self.scale

    @property
    def zero(self) -> float | None:
        """Where 0 is, in units of the space, if it is within the range and not in the middle."""
        if self.scale != "linear" or not self.low < 0 < self.high or self.low == -self.high:
            return None
        return -(self.low + self.high) / (self.high - self.low)

    @property
    def logarithm(self) -> tuple[float, float, float]:
        """The zero, in units of the space, and factor and summand of its coordinate.

        That is, how the logarithm of a positive parameter comes of its coordinate, see `Symmetry`.
        """
        if self.scale == "linear":
            half = (self.high - self.low) / 2
            return -(self.low + self.high) / (self.high - self.low), 1.0, float(np.log(half))
        middle = np.log(self.low * self.high) / 2
        return -np.inf, float(np.log(self.high / self.low) / 2), float(middle)

    @property
    def share(self) -> bool:
        """Whether it may be one of shares, which sum to 1."""
        return self.scale == "linear" and self.low >= 0 and self.high <= 1


def walked_symmetries(parameters: Mapping[str, Parameter]) -> list[Symmetry]:
    """Return what walkers of a custom system jump along.

    Parameters of the same range may be exchanged: two of them, or those of two parts of a model,
    such as the mean and the spread of each of two states. Any parameter may be mirrored at the
    middle of its range.
    """
    axes = _axes(parameters)
    count = len(axes)
    groups = [[axis.index for axis in group] for group in _alike(axes)]
    orders = sorted(_exchanges_across(groups, count) | _exchanges_within(groups, count))
    plain = [1.0] * count
    symmetries = [_signed(order, plain) for order in orders]
    for index in range(count):
        mirrored = plain.copy()
        mirrored[index] = -1.0
        symmetries.append(_signed(range(count), mirrored))
        if len(orders) > FEW_EXCHANGES:
            continue
        # the share of the first of two parts becomes that of the second where they are exchanged
        for order in orders:
            if order[index] == index:
                symmetries.append(_signed(order, mirrored))
    return symmetries


def candidate_symmetries(parameters: Mapping[str, Parameter]) -> list[list[Symmetry]]:
    """Return what may turn a solution of a custom system into another, the plainest first.

    Each list is a family: a system has all of it, or nothing. Equal parts of a model may change
    places; the share of the last part may be 1 minus the others. A parameter may be mirrored at the middle
    of its range or at 0, and turned by a part of its range, alone or together with another one. Positive
    parameters may become products of others and of their inverses.
    """
    axes = _axes(parameters)
    exchanges = sorted(_exchanges(axes), key=lambda family: -family[0].moved.sum())
    alone = {axis.index: list(_alone(axes, axis)) for axis in axes}
    families = list(exchanges)
    for symmetries in [*alone.values(), _together(axes)]:
        families.extend([symmetry] for symmetry in symmetries)
    pairs = [family[0] for family in exchanges if len(family) == 1]
    if len(pairs) <= FEW_EXCHANGES:
        for exchange in pairs:
            for axis in axes:
                if exchange.matrix[axis.index, axis.index] == 1:
                    families.extend([single.after(exchange)] for single in alone[axis.index])
    families = list(islice(_unique(families), MOST_CANDIDATES))
    for symmetry in islice(_products(axes), MOST_PRODUCTS):
        _, inside = symmetry.orbit(_probes(len(axes)))
        if inside.mean() >= LEAST_INSIDE:
            families.append([symmetry])
    return list(islice(_unique(families), 2 * MOST_CANDIDATES))


def _axes(parameters: Mapping[str, Parameter]) -> list[_Axis]:
    """Return parameters as axes."""
    axes = []
    for index, (name, parameter) in enumerate(parameters.items()):
        assert parameter.initial is not None
        low, high = parameter.initial
        split = NUMBERED_NAME.fullmatch(name)
        stem, suffix = (split[1], split[2]) if split else (name, "")
        positive = parameter.scale == "log" or (parameter.low is not None and parameter.low >= 0)
        axes.append(_Axis(index, stem, suffix, low, high, parameter.scale, positive))
    return axes


@cache
def _probes(count: int) -> np.ndarray:
    """Return some models (N, P) of so many parameters, anywhere in their ranges; not to be written to."""
    return np.random.default_rng(0).uniform(-1, 1, (PROBES, count))


def _alike(axes: Sequence[_Axis]) -> list[list[_Axis]]:
    """Return groups of two and more parameters of one kind."""
    groups: dict[tuple[float, float, str], list[_Axis]] = {}
    for axis in axes:
        groups.setdefault(axis.kind, []).append(axis)
    return [group for group in groups.values() if len(group) > 1]


def _unique(families: Iterable[list[Symmetry]]) -> Iterator[list[Symmetry]]:
    """Yield families of symmetries, each once.

    Without those that change nothing, or come back after more than four turns.
    """
    keys = set()
    for family in families:
        key = frozenset(symmetry.key for symmetry in family)
        if key not in keys and all(symmetry.order > 1 for symmetry in family):
            keys.add(key)
            yield family


def _signed(order: Sequence[int], signs: Sequence[float]) -> Symmetry:
    """Return what takes parameters in an order, each with a sign."""
    count = len(order)
    matrix = np.eye(count)[list(order)] * np.asarray(signs)[:, None]
    return replace(Symmetry.identity(count), matrix=matrix)


def _mirrored(count: int, about: dict[int, float]) -> Symmetry:
    """Return what mirrors some parameters at these values."""
    symmetry = Symmetry.identity(count)
    for index, value in about.items():
        symmetry.matrix[index, index] = -1
        symmetry.shift[index] = 2 * value
    return symmetry


def _turned(count: int, indices: Iterable[int], fraction: float) -> Symmetry:
    """Return what turns some parameters by a part of their range, at whose ends they begin again."""
    symmetry = Symmetry.identity(count)
    for index in indices:
        symmetry.shift[index] = 2 * fraction
        symmetry.periodic[index] = True
    return symmetry


def _remaining(axes: Sequence[_Axis], shares: Sequence[_Axis], share: _Axis) -> Symmetry:
    """Return what puts in place of a share what all of the shares leave of 1."""
    symmetry = Symmetry.identity(len(axes))
    middle = (share.low + share.high) / 2
    half = (share.high - share.low) / 2
    for summand in shares:
        symmetry.matrix[share.index, summand.index] = -1
    symmetry.shift[share.index] = (1 - (len(shares) + 1) * middle) / half
    return symmetry


def _alone(axes: Sequence[_Axis], axis: _Axis) -> Iterator[Symmetry]:
    """Yield what mirrors or turns one parameter."""
    count = len(axes)
    yield _mirrored(count, {axis.index: 0.0})
    if axis.zero is not None:
        yield _mirrored(count, {axis.index: axis.zero})
    if axis.share and axis.low + axis.high != 1:
        yield _remaining(axes, [axis], axis)
    if axis.scale != "linear":
        return
    for fraction in TURNED_FRACTIONS:
        yield _turned(count, [axis.index], fraction)
    # such as the supplementary angle, of the same sine
    half = _turned(count, [axis.index], 1 / 2)
    yield half.after(_mirrored(count, {axis.index: 0.0}))


def _together(axes: Sequence[_Axis]) -> Iterator[Symmetry]:
    """Yield what mirrors or turns several parameters at once."""
    count = len(axes)
    zeros = {}
    for axis in axes:
        if axis.scale == "linear" and axis.low < 0 < axis.high:
            zeros[axis.index] = axis.zero or 0.0
    yield _mirrored(count, zeros)
    yield _mirrored(count, {axis.index: 0.0 for axis in axes})
    for group in _alike(axes):
        yield _mirrored(count, {axis.index: zeros.get(axis.index, 0.0) for axis in group})
        if group[0].scale == "linear":
            yield _turned(count, [axis.index for axis in group], 1 / 2)
    for rows in _parts(axes):
        for members in zip(*rows, strict=False):
            yield _mirrored(count, {axis.index: zeros.get(axis.index, 0.0) for axis in members})
    for first, second in combinations(zeros, 2):
        yield _mirrored(count, {first: zeros[first], second: zeros[second]})
    for axis in axes:
        if axis.scale != "linear":
            continue
        half = _turned(count, [axis.index], 1 / 2)
        for index, value in zeros.items():
            if index != axis.index:
                # an amplitude of the other sign, half a turn on
                yield half.after(_mirrored(count, {index: value}))
    for first_axis, second_axis in combinations(axes, 2):
        yield _mirrored(count, {first_axis.index: 0.0, second_axis.index: 0.0})


def _product(axes: Sequence[_Axis], powers: Mapping[int, Mapping[int, float]]) -> Symmetry:
    """Return what puts products of powers of positive parameters in place of some of them."""
    symmetry = Symmetry.identity(len(axes))
    for index, factors in powers.items():
        symmetry.zeros[index], unit, summand = axes[index].logarithm
        symmetry.matrix[index] = 0
        symmetry.shift[index] = -summand / unit
        for factor, power in factors.items():
            symmetry.zeros[factor], factor_unit, factor_summand = axes[factor].logarithm
            symmetry.matrix[index, factor] = power * factor_unit / unit
            symmetry.shift[index] += power * factor_summand / unit
    return symmetry


def _products(axes: Sequence[_Axis]) -> Iterator[Symmetry]:
    """Yield what is linear in logarithms of positive parameters, the plainest first."""
    positive = [axis for axis in axes if axis.positive]
    indices = [axis.index for axis in positive]
    groups = [[], *([index] for index in indices)]
    groups.extend([axis.index for axis in group] for group in _alike(positive))
    for rate, partner in permutations(indices, 2):
        # two rates, and others that are in proportion to one of them, such as a volume
        exchanged = {rate: {partner: 1}, partner: {rate: 1}}
        for group in groups:
            if rate in group or partner in group:
                continue
            # which is an exchange of coordinates
            if not group and axes[rate].kind == axes[partner].kind:
                continue
            proportional = {index: {index: 1, rate: 1, partner: -1} for index in group}
            yield _product(axes, exchanged | proportional)
    for ratio in indices:
        # a ratio, and what it is the ratio to: the other part takes its place
        for group, power in product(groups, (1, -1)):
            if ratio in group:
                continue
            proportional = {index: {index: 1, ratio: power} for index in group}
            inverted = _product(axes, {ratio: {ratio: -1}} | proportional)
            yield inverted
            for axis in axes:
                if axis.share and axis.index != ratio and axis.index not in group:
                    yield inverted.after(_remaining(axes, [axis], axis))
    for rate, time in permutations(indices, 2):
        # a rate and a time
        yield _product(axes, {rate: {time: -1}, time: {rate: -1}})
        # a side and an area; a part and the middle of both
        for power in (1, 2):
            yield _product(axes, {rate: {rate: -1, time: power}})
    for rate, partner, factor in permutations(indices, 3):
        # two rates, one of which is in units of a third parameter
        yield _product(axes, {rate: {partner: 1, factor: 1}, partner: {rate: 1, factor: -1}})
    for rate, time in combinations(indices, 2):
        # a rate and a time, and a scale of both
        for scale, power in product(indices, (-1, 1)):
            if scale not in (rate, time):
                inverses = {rate: {time: -1}, time: {rate: -1}}
                yield _product(axes, inverses | {scale: {scale: 1, rate: power, time: power}})


def _parts(axes: Sequence[_Axis]) -> Iterator[list[list[_Axis]]]:
    """Yield ways to take a model for parts that are alike.

    Lists of parameters of one kind, in which the numbers of the parts are the places.
    """
    stems: dict[tuple[str, tuple[float, float, str]], list[_Axis]] = {}
    for axis in axes:
        if axis.suffix:
            stems.setdefault((axis.stem, axis.kind), []).append(axis)
    named = [group for group in stems.values() if len(group) > 1]
    yield from _subsets(named)
    groups = _alike(axes)
    for part_count in range(2, max(map(len, groups), default=1) + 1):
        for strided in (False, True):
            rows = []
            for group in groups:
                size = len(group) // part_count
                if len(group) % part_count:
                    continue
                columns = np.arange(len(group)).reshape(part_count, size)
                if strided:
                    columns = np.arange(len(group)).reshape(size, part_count).T
                rows.append([[group[k] for k in column] for column in columns.T])
            for subset in _subsets(rows):
                yield [row for group in subset for row in group]


def _subsets(groups: list[Any]) -> Iterator[list[Any]]:
    """Yield all groups of as many members together, and each alone; of few, any of them."""
    if len(groups) <= 4:
        for count in range(len(groups), 0, -1):
            yield from map(list, combinations(groups, count))
        return
    yield groups
    for group in groups:
        yield [group]


def _exchanges(axes: Sequence[_Axis]) -> Iterator[list[Symmetry]]:
    """Yield what exchanges two parts of a model: all pairs of parts that it is taken for."""
    count = len(axes)
    for rows in _parts(axes):
        part_count = min(map(len, rows))
        rows = [row for row in rows if len(row) == part_count]
        pairs = list(combinations(range(part_count), 2))
        yield [_exchange(count, rows, pair) for pair in pairs]
        used_indices = {axis.index for row in rows for axis in row}
        free_axes = [axis for axis in axes if axis.share and axis.index not in used_indices]
        for shares in _shares(free_axes, part_count - 1):
            family = [
                _exchange(count, [*rows, shares], pair)
                for pair in pairs
                if pair[1] < part_count - 1
            ]
            for number, share in enumerate(shares):
                with_last = _exchange(count, rows, (number, part_count - 1))
                family.append(_remaining(axes, shares, share).after(with_last))
            yield family


def _shares(axes: Sequence[_Axis], count: int) -> Iterator[list[_Axis]]:
    """Yield so many neighboring parameters of one kind that may be shares."""
    for begin in range(len(axes) - count + 1):
        neighbors = list(axes[begin : begin + count])
        if len({axis.kind for axis in neighbors}) == 1:
            yield neighbors


def _exchange(count: int, rows: Sequence[Sequence[_Axis]], pair: tuple[int, int]) -> Symmetry:
    """Return what exchanges two of the parts whose parameters are in rows."""
    first, second = pair
    index_pairs = [(row[first].index, row[second].index) for row in rows]
    return _signed(_exchanged(count, index_pairs), [1.0] * count)


def _exchanges_across(groups: Sequence[Sequence[int]], count: int) -> set[tuple[int, ...]]:
    """Return orders in which two parameters of a group are exchanged.

    That is alone, or in all groups of one size. Groups of one size are taken for the kinds of
    parameters that each part of a model has.
    """
    orders: set[tuple[int, ...]] = set()
    for size in {len(indices) for indices in groups}:
        same = [indices for indices in groups if len(indices) == size]
        for first, second in combinations(range(size), 2):
            pairs = [(indices[first], indices[second]) for indices in same]
            orders.add(_exchanged(count, pairs))
            for pair in pairs:
                orders.add(_exchanged(count, [pair]))
    return orders


def _exchanges_within(groups: Sequence[Sequence[int]], count: int) -> set[tuple[int, ...]]:
    """Return orders in which two parts of a model are exchanged, all in one range.

    The parameters of a part are every second one, or one half of them.
    """
    orders: set[tuple[int, ...]] = set()
    for indices in groups:
        half = len(indices) // 2
        if len(indices) % 2 or half < 2:
            continue
        orders.add(_exchanged(count, list(zip(indices[::2], indices[1::2], strict=True))))
        orders.add(_exchanged(count, list(zip(indices[:half], indices[half:], strict=True))))
    return orders


def _exchanged(count: int, pairs: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Return the order of so many parameters in which some pairs are exchanged."""
    order = list(range(count))
    for first, second in pairs:
        order[first] = second
        order[second] = first
    return tuple(order)


@dataclass(frozen=True, eq=False)
class SymmetryGroup:
    """Symmetries of a system, and all that come of them in turn; the first changes nothing.

    Attributes
    ----------
    members
        G symmetries.
    reference : (P,)
        A solution.
    scale : (P,)
        How far from it counts, for each parameter.
    widest : (P,)
        How far from the middle of the space images are solutions.
    """

    members: Sequence[Symmetry]
    reference: np.ndarray
    scale: np.ndarray
    widest: np.ndarray

    @classmethod
    def generated(
        cls,
        generators: Sequence[Symmetry],
        reference: np.ndarray,
        scale: np.ndarray,
        widest: np.ndarray,
    ) -> "SymmetryGroup":
        """Return what comes of generators, as far as images of the reference are within +-widest."""
        members = [Symmetry.identity(len(reference))]
        images = [reference]
        periodic = _periodic(generators)
        for member in members:
            for generator in generators:
                if not generator.joins(member):
                    continue
                further = generator.after(member)
                image = further.images_of(reference)
                if (np.abs(image) > widest).any():
                    continue
                offsets = _between(np.array(images), image, periodic) / scale
                if (np.abs(offsets).max(axis=1) > 1).all():
                    members.append(further)
                    images.append(image)
                    if len(members) == MOST_IMAGES:
                        return cls(members, reference, scale, widest)
        return cls(members, reference, scale, widest)

    @cached_property
    def periodic(self) -> np.ndarray:
        """Which parameters (P,) begin again at the ends of their range."""
        return _periodic(self.members)

    @property
    def state(self) -> dict[str, np.ndarray]:
        """What it is, as arrays, see `restored`."""
        return {
            "matrices": np.stack([member.matrix for member in self.members]),
            "shifts": np.stack([member.shift for member in self.members]),
            "periodic": np.stack([member.periodic for member in self.members]),
            "zeros": np.stack([member.zeros for member in self.members]),
            "reference": self.reference,
            "scale": self.scale,
            "widest": self.widest,
        }

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray]) -> "SymmetryGroup":
        """Return the group of a `state`."""
        # A group that a run follows has no logarithms, and earlier runs have stored none.
        none = np.full(state["shifts"].shape, -np.inf)
        columns = (
            *(state[name] for name in ("matrices", "shifts", "periodic")),
            state.get("zeros", none),
        )
        members = [Symmetry(*entry) for entry in zip(*columns, strict=True)]
        return cls(members, state["reference"], state["scale"], state["widest"])

    def folded(self, models: np.ndarray) -> np.ndarray:
        """Return of all images of each of the models (N, P) that nearest to the reference.

        Images out of range do not count, such as where shares come to more than 1.
        """
        images = np.stack([member.images_of(models) for member in self.members])
        offsets = _between(images, self.reference, self.periodic)
        distances = ((offsets / self.scale) ** 2).sum(axis=2)
        outside = (np.abs(images[1:]) > self.widest).any(axis=2)
        distances[1:][outside] = np.inf
        nearest: np.ndarray = images[distances.argmin(axis=0), np.arange(len(models))]
        return nearest


def _periodic(symmetries: Sequence[Symmetry]) -> np.ndarray:
    """Return which parameters (P,) begin again at the ends of their range."""
    return np.any([symmetry.periodic for symmetry in symmetries], axis=0)


def _between(models: np.ndarray, origin: np.ndarray, periodic: np.ndarray) -> np.ndarray:
    """Return the way (..., P) from another model to models: the shorter one around a circle."""
    offset = models - origin
    return np.where(periodic, (offset + 1) % 2 - 1, offset)


def one_side(symmetry: Symmetry, models: np.ndarray) -> np.ndarray:
    """Return models (N, P), those on the side of fewer of them turned to the other side.

    Between the sides lies what the symmetry leaves as it is.
    """
    if symmetry.order != 2:
        return models
    offsets = models - symmetry.images_of(models)
    offsets /= models.std(axis=0) + 1e-12
    along = np.linalg.svd(offsets, full_matrices=False)[2][0]
    turned = offsets @ along < 0
    if turned.mean() > 0.5:
        turned = ~turned
    return np.where(turned[:, None], symmetry.images_of(models), models)


def share_beyond(symmetry: Symmetry, models: np.ndarray) -> float:
    """Return the share of models (N, P) that `one_side` turns."""
    return float((one_side(symmetry, models) != models).any(axis=1).mean())


def oddness(symmetry: Symmetry, models: np.ndarray, outputs: np.ndarray) -> tuple[float, float]:
    """Return how often outputs (N, F) would tell models (N, P) from their images by chance.

    Models are to be anywhere, evenly: then what a symmetry of the system leaves as it is has
    nothing to do with what changes its sign. Those with an image out of range are left out. The
    second number asks whether outputs change at all with what is moved. Both are p-values of
    F-tests, of the output that differs most.
    """
    orbit, inside = symmetry.orbit(models)
    orbit = orbit[:, inside]
    models = models[inside]
    outputs = outputs[inside]
    if not len(models):
        return 1.0, 1.0
    # how much room each image has, beside the others
    room = np.where(symmetry.logarithmic, orbit - symmetry.zeros, 1).prod(axis=2)
    terms = np.stack([_terms(image) for image in orbit])
    even = (terms * room[..., None]).sum(axis=0) / room.sum(axis=0)[:, None]
    fixed = np.abs(terms[0] - _terms(np.where(symmetry.moved, 0.0, models))).max(axis=0) < 1e-9
    plain = _basis(even[:, fixed])
    bent = _basis(even[:, ~fixed], plain)
    odd = _basis(terms[0] - even, np.c_[plain, bent])
    residual = outputs - outputs.mean(axis=0)
    residual = residual - plain @ (plain.T @ residual)
    without = residual - bent @ (bent.T @ residual)
    return _p_value(odd, without, plain, bent), _p_value(bent, residual, plain)


def _p_value(basis: np.ndarray, outputs: np.ndarray, *besides: np.ndarray) -> float:
    """Return how often a basis (N, M) would explain so much of one of the outputs (N, F) by chance.

    Outputs are without what other bases explain.
    """
    count = basis.shape[1]
    freedom = len(outputs) - 1 - count - sum(terms.shape[1] for terms in besides)
    if not count or freedom < 1 or not outputs.shape[1]:
        return 1.0
    explained = ((basis.T @ outputs) ** 2).sum(axis=0)
    unexplained = np.maximum((outputs**2).sum(axis=0) - explained, 1e-12)
    chances = scipy.stats.f.sf(explained / count / (unexplained / freedom), count, freedom)
    return float(min(1.0, chances.min() * len(chances)))


def _terms(models: np.ndarray) -> np.ndarray:
    """Return models (N, P), their squares, and their products where models are enough for few."""
    first, second = np.triu_indices(models.shape[1], 1)
    terms = [models, models**2]
    count = 1 + 2 * models.shape[1] + len(first)
    if count <= MOST_TERMS and len(models) > 3 * count:
        terms.append(models[:, first] * models[:, second])
    return np.concatenate(terms, axis=1)


def _basis(terms: np.ndarray, besides: np.ndarray | None = None) -> np.ndarray:
    """Return an orthonormal basis of centered terms (N, M), without what another basis spans."""
    residual = terms - terms.mean(axis=0)
    if not residual.shape[1]:
        return residual
    if besides is not None:
        residual = residual - besides @ (besides.T @ residual)
    vectors, values, _ = np.linalg.svd(residual, full_matrices=False)
    basis: np.ndarray = vectors[:, values > 1e-6 * np.sqrt(len(terms))]
    return basis
