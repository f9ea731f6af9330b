"""What turns a solution into others: proposed, seen in the first models, and folded away."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from turing_learning.few_trials import (
    Examiner,
    PooledClassifier,
    SearchSpace,
    Symmetry,
    SymmetryGroup,
    candidate_symmetries,
)
from turing_learning.few_trials._examination import paired_p_value
from turing_learning.few_trials._readout import Evidence
from turing_learning.few_trials._symmetry import oddness
from turing_learning.models import Parameter

CLUSTERS = [f"{axis}{number}" for number in (1, 2, 3) for axis in "xy"]
THREE = {name: Parameter(0, 1) for name in ("mean_a", "mean_b", "mean_c")}


def family_of(names, moves):
    """Return the family of a model with these parameters of one range that has such a symmetry."""
    families = candidate_symmetries({name: Parameter(-5, 5) for name in names})
    model = np.linspace(-0.9, 0.8, len(names))
    wanted = moves(model.copy())
    for family in families:
        if any(np.allclose(symmetry.images_of(model), wanted) for symmetry in family):
            return family
    raise AssertionError("no such symmetry is proposed")


def exchanged(first, second):
    def moves(model):
        model[[*first, *second]] = model[[*second, *first]]
        return model

    return moves


@pytest.mark.parametrize(
    ("names", "first", "second"),
    [
        (CLUSTERS, (0, 1), (4, 5)),
        (["p", "q", "r", "s", "t", "u"], (0, 3), (2, 5)),
        (["p", "q", "r", "s", "t", "u"], (0, 1, 2), (3, 4, 5)),
        (["x_a", "y_a", "x_b", "z", "y_b"], (0, 1), (2, 4)),
    ],
)
def test_parts_of_any_size_change_places(names, first, second):
    family_of(names, exchanged(first, second))


def test_three_parts_have_six_solutions_and_trials_are_brought_to_one_of_them():
    family = family_of(CLUSTERS, exchanged((0, 1), (2, 3)))
    assert len(family) == 3
    solution = np.array([-0.5, 0.1, 0.2, 0.4, 0.7, -0.3])
    group = SymmetryGroup.generated(family, solution, np.full(6, 0.01), np.full(6, 1.0))
    assert len(group.members) == 6
    images = np.stack([member.images_of(solution) for member in group.members])
    assert len(np.unique(images.round(9), axis=0)) == 6
    near = images + 0.01
    assert np.allclose(group.folded(near) - 0.01, solution)
    again = SymmetryGroup.restored(group.state)
    assert (again.folded(near) == group.folded(near)).all()
    # as runs stored it before symmetries knew logarithms
    earlier = {name: value for name, value in group.state.items() if name != "zeros"}
    assert (SymmetryGroup.restored(earlier).folded(near) == group.folded(near)).all()


def test_a_share_of_three_becomes_what_the_others_leave():
    parameters = {"share_a": Parameter(0, 1), "share_b": Parameter(0, 1)} | {
        name: Parameter(-3, 3) for name in THREE
    }
    model = 2 * np.array([0.2, 0.5, 0.1, 0.6, 0.9]) - 1
    wanted = 2 * np.array([0.3, 0.5, 0.9, 0.6, 0.1]) - 1  # the first and the third part
    symmetries = [one for family in candidate_symmetries(parameters) for one in family]
    assert any(np.allclose(symmetry.images_of(model), wanted) for symmetry in symmetries)


@pytest.mark.parametrize(
    ("parameters", "model", "image"),
    [
        ({"f": Parameter(-1, 3)}, [2 / 3], [-2 / 3]),  # -2.33, out of range, is 2.33 with a sign
        ({"f": Parameter(-1, 3)}, [-0.25], [-0.75]),  # 0.5 and -0.5
        ({"angle": Parameter(0, 6.28)}, [0.3], [-0.7]),  # half a turn
        ({"angle": Parameter(0, 6.28)}, [0.3], [0.7]),  # the supplement, of the same sine
        ({"size": Parameter(-2, 2), "turn": Parameter(0, 6.28)}, [0.4, 0.3], [-0.4, -0.7]),
    ],
)
def test_signs_and_turns(parameters, model, image):
    symmetries = [one for family in candidate_symmetries(parameters) for one in family]
    assert any(np.allclose(symmetry.images_of(np.array(model)), image) for symmetry in symmetries)


def squared(parameters, rng):
    """Yield samples (N, 1, 2) that know the square of the first parameter, and the second."""
    mean = np.c_[parameters[:, 0] ** 2, parameters[:, 1]]
    return (mean + 0.05 * rng.standard_normal(mean.shape))[:, None]


class Squares:
    """A source of such samples."""

    def collect(self, models, rng):
        return SimpleNamespace(counterfeit=squared(models, rng)[:, None])


@pytest.fixture(scope="module")
def examined():
    """An examiner of such a system, what is known of its first models, and a generator."""
    rng = np.random.default_rng(3)
    candidates = candidate_symmetries({"root": Parameter(-1, 1), "level": Parameter(-1, 1)})
    space = SearchSpace.between(-np.ones(2), np.ones(2), limits=True, candidates=candidates)
    genuine = squared(np.tile([0.6, 0.3], (100, 1)), rng)
    models = rng.uniform(-1, 1, (150, 2))
    outputs = squared(models, rng)[:, 0]
    evidence = Evidence(space, models, outputs, genuine[:, 0], 1, observed_anew=False)
    return (
        Examiner(Squares(), space, genuine, ("square", "level"), PooledClassifier()),
        evidence,
        rng,
    )


def test_a_solution_has_the_images_that_samples_resemble(examined):
    examiner, evidence, rng = examined
    draws = np.array([0.6, 0.3]) + 0.01 * rng.standard_normal((600, 2))
    group = examiner.symmetries(draws, evidence, 1000, rng)
    assert [
        member.images_of(np.array([0.6, 0.3])).round(9).tolist() for member in group.members
    ] == [[0.6, 0.3], [-0.6, 0.3]]


def test_a_mixture_of_images_is_seen_and_nothing_else_is_taken_for_one(examined):
    examiner, evidence, rng = examined
    side = rng.choice([-1, 1], 200)
    draws = np.c_[side * 0.6, np.full(200, 0.3)] + 0.02 * rng.standard_normal((200, 2))
    group = examiner.mixture(draws, evidence, 1000, rng)
    assert len(group.members) == 2
    assert (np.sign(group.folded(draws)[:, 0]) == np.sign(group.reference[0])).all()
    draws[:, 0] = 0.6 + 0.02 * rng.standard_normal(200)
    draws[:, 1] = side * 0.3  # which is no symmetry
    assert examiner.mixture(draws, evidence, 1000, rng) is None


def test_a_symmetry_after_another_is_one_again():
    turn = replace(Symmetry.identity(1), shift=np.array([1.0]), periodic=np.array([True]))
    mirror = replace(Symmetry.identity(1), matrix=-np.eye(1), shift=np.array([0.2]))
    models = np.linspace(-0.9, 0.9, 7)[:, None]
    assert np.allclose(
        turn.after(mirror).images_of(models), turn.images_of(mirror.images_of(models))
    )
    assert turn.order == mirror.order == 2


def test_what_begins_again_at_the_end_of_its_range_is_folded_around_the_circle():
    half_turn = replace(Symmetry.identity(1), shift=np.array([1.0]), periodic=np.array([True]))
    group = SymmetryGroup.generated(
        [half_turn], np.array([0.98]), np.array([0.05]), np.array([1.0])
    )
    assert len(group.members) == 2
    folded = group.folded(np.array([[-0.99], [-0.01], [0.97]]))
    np.testing.assert_allclose(folded, [[-0.99], [0.99], [0.97]])
    # beyond the range it is the same place again, not a further solution
    wide = SymmetryGroup.generated([half_turn], np.array([1.2]), np.array([0.05]), np.array([2.0]))
    assert len(wide.members) == 2


def oscillation(models, rng):
    """Samples (N, 60, 1) of an amplitude and a phase (N, 2)."""
    steps = np.linspace(0, 4 * np.pi, 60)
    motion = models[:, :1] * np.sin(steps + models[:, 1:])
    return (motion + rng.normal(0, 0.5, motion.shape))[:, :, None]


@pytest.mark.parametrize(
    ("amplitude", "phase", "alike"),
    [(-1, lambda phase: phase + np.pi, True), (-1, lambda phase: -phase, False)],
)
def test_broad_draws_tell_a_false_symmetry_from_a_right_one(amplitude, phase, alike):
    rng = np.random.default_rng(5)
    # both signs, any phase: the means over all of them are alike for either symmetry
    models = np.c_[rng.choice((-1.0, 1.0), 75), rng.uniform(-np.pi, np.pi, 75)]
    images = np.c_[amplitude * models[:, 0], phase(models[:, 1])]
    p_value = paired_p_value(models, oscillation(models, rng), oscillation(images, rng), rng)
    assert (p_value >= 0.01) == alike


def positive(*names):
    return {name: Parameter(0.1, 5) for name in names}


def numbers(parameters, values):
    """Return values of parameters in units of the space."""
    found = []
    for parameter, value in zip(parameters.values(), values, strict=True):
        ends = np.array([*parameter.initial, value])
        if parameter.scale == "log":
            ends = np.log(ends)
        found.append(2 * (ends[2] - ends[0]) / (ends[1] - ends[0]) - 1)
    return np.array(found)


@pytest.mark.parametrize(
    ("parameters", "model", "image"),
    [
        # a drug by mouth: fast in and slow out, or slow in and fast out of another volume
        (
            {"absorption": Parameter(0.05, 4), "elimination": Parameter(0.05, 4), "volume": Parameter(0, 80)},
            [2, 0.5, 24],
            [0.5, 2, 6],
        ),
        (
            {"absorption": Parameter(0.05, 4), "elimination": Parameter(0.05, 4), "volume": Parameter(1, 90, "log")},
            [2, 0.5, 24],
            [0.5, 2, 6],
        ),
        # rates whose ranges differ
        ({"fast": Parameter(0.1, 9), "slow": Parameter(0.1, 4)}, [3, 0.5], [0.5, 3]),
        (positive("size", "ratio"), [1.5, 2], [3, 0.5]),
        (positive("size", "ratio") | {"share": Parameter(0, 1)}, [1.5, 2, 0.3], [3, 0.5, 0.7]),
        # of which few models of the range have an image in range
        (
            {"rate": Parameter(0.02, 5), "ratio": Parameter(0.05, 20), "share": Parameter(0, 1)},
            [0.2, 5, 0.6],
            [1, 0.2, 0.4],
        ),
        (positive("rate", "time"), [2, 0.8], [1.25, 0.5]),
        # meals of a predator that many prey confuse
        (positive("hunger", "half", "swamp"), [1.2, 2, 0.8], [0.75, 1.25, 0.5]),
        (positive("side", "area"), [1.25, 5], [4, 5]),
        (positive("side", "middle"), [1, 2], [4, 2]),
        (positive("cold", "warm", "factor"), [2, 0.5, 1.6], [0.8, 1.25, 1.6]),
    ],
)  # fmt: skip
def test_products_take_the_place_of_positive_parameters(parameters, model, image):
    model = numbers(parameters, model)
    image = numbers(parameters, image)
    symmetries = [one for family in candidate_symmetries(parameters) for one in family]
    found = [one for one in symmetries if np.allclose(one.images_of(model), image)]
    assert len(found) == 1
    assert np.allclose(found[0].images_of(image), model)


def test_no_product_takes_the_place_of_what_may_be_negative():
    parameters = {"shift": Parameter(-1, 5), "open": Parameter(None, 5, initial=(1, 5))}
    for family in candidate_symmetries(parameters):
        assert not any(one.logarithmic.any() for one in family)


def test_nothing_is_tried_twice_in_whatever_coordinates():
    parameters = {name: Parameter(0.2, 5, "log") for name in "abc"} | {"share": Parameter(0, 1)}
    families = candidate_symmetries(parameters)
    models = np.random.default_rng(1).uniform(-0.9, 0.9, (20, 4))
    actions = {
        tuple(sorted(one.images_of(models).round(6).tobytes() for one in family))
        for family in families
    }
    assert len(actions) == len(families)


def flip_flop():
    parameters = {name: Parameter(0.05, 4) for name in ("absorption", "elimination")}
    parameters["volume"] = Parameter(0.5, 80)
    model = numbers(parameters, [1.6, 0.4, 20])
    image = numbers(parameters, [0.4, 1.6, 5])
    for symmetry, *_ in candidate_symmetries(parameters):
        if np.allclose(symmetry.images_of(model), image):
            return symmetry, model, image
    raise AssertionError("no such symmetry is proposed")


def test_a_group_may_hold_what_is_linear_in_logarithms_and_what_is_not():
    scaled, model, image = flip_flop()
    exchange = replace(Symmetry.identity(3), matrix=np.eye(3)[[1, 0, 2]])
    mirror = replace(Symmetry.identity(3), matrix=np.diag([1.0, 1.0, -1.0]))
    assert scaled.joins(exchange)
    assert not scaled.joins(mirror)
    assert np.allclose(exchange.after(scaled).images_of(model), exchange.images_of(image))
    size = np.full(3, 0.01)
    group = SymmetryGroup.generated([scaled, mirror], model, size, np.ones(3))
    # that of both in turn would be linear in neither
    assert len(group.members) == 3
    again = SymmetryGroup.restored(group.state)
    np.testing.assert_allclose(again.folded(image[None]), model[None])


def test_first_models_rule_out_no_symmetry_of_a_rate_and_a_time():
    parameters = {name: Parameter(0.05, 10) for name in ("rate", "time")}
    model, image = numbers(parameters, [2, 0.8]), numbers(parameters, [1.25, 0.5])
    symmetries = [one for family in candidate_symmetries(parameters) for one in family]
    (inverse,) = [one for one in symmetries if np.allclose(one.images_of(model), image)]
    right = []
    wrong = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        # evenly in the range, so unevenly in logarithms
        models = rng.uniform(-1, 1, (400, 2))
        rate, time = 0.05 + 9.95 * (models.T + 1) / 2
        duration = np.tanh(0.5 * (1 / rate + time - 3))[:, None]
        right.append(oddness(inverse, models, duration + 0.1 * rng.standard_normal((400, 1)))[0])
        wrong.append(oddness(inverse, models, rate[:, None] + rng.standard_normal((400, 1)))[0])
    assert np.median(right) > 0.01
    assert np.median(wrong) < 1e-5


def levels(parameters, rng, *, product):
    """Samples (N, 12, 1) of the levels of a drug, or of a product alone."""
    absorption, elimination, volume = parameters.T[..., None]
    hours = np.array([0.25, 0.5, 1, 1.5, 2, 3, 4, 6, 8, 12, 18, 24])
    if product:
        level = np.broadcast_to(absorption * elimination, (len(parameters), 12))
    else:
        gap = absorption - elimination + 1e-9
        shape = np.exp(-elimination * hours) - np.exp(-absorption * hours)
        level = 100 / volume * absorption * shape / gap
    return (level * np.exp(0.1 * rng.standard_normal(level.shape)))[..., None]


@pytest.mark.parametrize("product", [False, True])
def test_another_solution_is_no_other_place_of_a_ridge(product):
    scaled, model, image = flip_flop()
    middle, half = np.array([2.025, 2.025, 40.25]), np.array([1.975, 1.975, 39.75])
    rng = np.random.default_rng(6)

    class Levels:
        def collect(self, models, rng):
            return SimpleNamespace(counterfeit=levels(models, rng, product=product)[:, None])

    space = SearchSpace.between(middle - half, middle + half, limits=True, candidates=[[scaled]])
    genuine = levels(np.tile(middle + half * model, (25, 1)), rng, product=product)
    models = rng.uniform(-1, 1, (150, 3))
    outputs = np.tanh(
        levels(middle + half * models, rng, product=product)[:, ::3, 0] - genuine.mean()
    )
    evidence = Evidence(space, models, outputs, genuine[:, ::3, 0], 1, observed_anew=False)
    draws = model + 0.005 * rng.standard_normal((600, 3))
    group = Examiner(Levels(), space, genuine, ("level",), PooledClassifier(1)).symmetries(
        draws, evidence, 1000, rng
    )
    if product:
        assert group is None
    else:
        np.testing.assert_allclose(group.members[1].images_of(model), image)


ECHO = {"size": Parameter(0.05, 6), "echo": Parameter(0.1, 10)}


def moving_average(shocks):
    """Return an examiner of a moving average of such shocks, and what has its spectrum."""
    middle, half = np.array([3.025, 5.05]), np.array([2.975, 4.95])

    def collect(models, rng):
        size, echo = models.T[..., None]
        shock = shocks(rng, (len(models), 61))
        return SimpleNamespace(
            counterfeit=(size * (shock[:, 1:] + echo * shock[:, :-1]))[:, None, :, None]
        )

    model, image = numbers(ECHO, [2, 0.5]), numbers(ECHO, [1, 2])
    families = candidate_symmetries(ECHO)
    (inverse,) = [
        family[0] for family in families if np.allclose(family[0].images_of(model), image)
    ]
    space = SearchSpace.between(middle - half, middle + half, limits=True, candidates=[[inverse]])
    genuine = collect(np.tile([2, 0.5], (50, 1)), np.random.default_rng(1)).counterfeit[:, 0]
    source = SimpleNamespace(collect=collect)
    return Examiner(source, space, genuine, ("level",), PooledClassifier(1)), inverse, model


@pytest.mark.parametrize(
    ("shocks", "alike"),
    [
        (lambda rng, shape: rng.standard_normal(shape), True),
        (lambda rng, shape: rng.exponential(size=shape) - 1, False),
        # of which only fourth moments know the order in time
        (lambda rng, shape: rng.laplace(size=shape), False),
    ],
)
def test_an_image_that_differs_in_the_order_of_shocks_alone_is_no_solution(shocks, alike):
    examiner, inverse, model = moving_average(shocks)
    rng = np.random.default_rng(2)
    draws = model + [0.01, 0.004] * rng.standard_normal((600, 2))
    group = SymmetryGroup.generated([inverse], model, draws.std(axis=0), np.ones(2))
    assert examiner.certain(inverse, group, draws, 3000, rng) == alike


def test_what_lies_apart_in_logarithms_lies_apart():
    examiner, inverse, model = moving_average(lambda rng, shape: rng.standard_normal(shape))
    rng = np.random.default_rng(3)
    # as 0.5 and 2, with spreads of 0.1 and 0.4
    draws = model + [0.02, 0.02] * rng.standard_normal((600, 2))
    group = SymmetryGroup.generated([inverse], model, draws.std(axis=0), np.ones(2))
    assert examiner.apart(draws, group)


def test_a_mixture_of_products_is_looked_for_where_it_is_asked_for():
    examiner, inverse, model = moving_average(lambda rng, shape: rng.standard_normal(shape))
    rng = np.random.default_rng(4)
    draws = model + [0.01, 0.004] * rng.standard_normal((600, 2))
    draws[::2] = inverse.images_of(draws[::2])
    models = rng.uniform(-1, 1, (100, 2))
    evidence = Evidence(
        examiner.space, models, rng.random((100, 5)), rng.random((50, 5)), 1, observed_anew=False
    )
    assert examiner.mixture(draws, evidence, 1000, rng) is None
    group = examiner.mixture(draws, evidence, 1000, rng, products=True)
    assert (group.folded(draws).std(axis=0) < draws.std(axis=0) / 2).all()
