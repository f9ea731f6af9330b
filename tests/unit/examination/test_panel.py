import numpy as np
import pytest

from turing_learning.examination import PANEL, QUICK, Kernel, Ridge, examine, telling_statistics
from turing_learning.examination._panel import Views, group_labellings
from turing_learning.examination._statistics import named_statistics

RNG = np.random.default_rng(4)


def walks(count, shift=0.0):
    """Return samples (K, 30, 2) of noise, with the mean of the first signal shifted."""
    windows = RNG.standard_normal((count, 30, 2))
    windows[..., 0] += shift
    return windows


def test_a_clear_difference_is_told():
    found = examine(walks(40), walks(40, 1.0), examiners=QUICK)
    assert found.accuracy > 0.9
    assert found.p_value == 0.01
    assert found.told_apart
    assert found.interval[0] < found.accuracy <= found.interval[1]
    assert found.auc > 0.95
    assert found.power_accuracy < 0.85


def test_of_alike_samples_the_p_value_is_even():
    p_values = [
        examine(walks(15), walks(15), examiners=(Ridge(),), seed=seed).p_value for seed in range(40)
    ]
    # 40 even numbers: their mean has a standard error of 0.046
    assert 0.3 < np.mean(p_values) < 0.7
    assert np.mean(np.array(p_values) <= 0.1) < 0.3


def test_lasting_differences_of_groups_are_no_difference_of_the_sides():
    p_values = []
    for seed in range(30):
        sides, owners = [], []
        for _ in range(2):
            groups = np.repeat(np.arange(5), 12)
            sides.append(walks(60) + RNG.normal(size=5)[groups, None, None])
            owners.append(groups)
        p_values.append(
            examine(*sides, groups=tuple(owners), examiners=(Ridge(),), seed=seed).p_value
        )
    # at 0.05 more than 6 of 30 come up in less than 1 of 1000 cases
    assert np.mean(np.array(p_values) <= 0.05) <= 0.2


def test_as_single_samples_the_same_differences_would_be_told():
    sides = [
        walks(60) + RNG.normal(size=5)[np.repeat(np.arange(5), 12), None, None] for _ in range(2)
    ]
    assert examine(*sides, examiners=(Kernel(),)).told_apart


def test_too_few_groups_could_not_have_noticed_anything():
    found = examine(
        walks(20),
        walks(20, 3.0),
        groups=(np.arange(20) % 2, np.arange(20) % 2),
        examiners=(Ridge(),),
    )
    assert found.accuracy > 0.95
    assert found.p_value > 0.3  # there are three ways to divide four groups
    assert found.power_accuracy is None
    assert found.power < 0.05


def test_true_labels_come_first_and_few_arrangements_are_all_tried():
    labels = group_labellings((2, 3), 99, RNG)
    assert labels.shape == (5, 10)
    np.testing.assert_array_equal(labels[:, 0], [1, 1, 0, 0, 0])
    assert len({tuple(column) for column in labels.T}) == 10
    drawn = group_labellings((6, 6), 50, RNG)
    assert drawn.shape == (12, 51)
    np.testing.assert_array_equal(drawn.sum(axis=0), 6)


class Fixed:
    """An examiner that learns the sign of the difference of the means of everything."""

    name = "mean"
    sees = "windows"

    def fit(self, samples, labels):
        means = samples[labels].mean(), samples[~labels].mean()
        self.middle, self.sign = sum(means) / 2, np.sign(means[0] - means[1])

    def score(self, samples):
        return self.sign * (samples.mean(axis=(1, 2)) - self.middle)


def test_an_examiner_of_ones_own_joins_the_panel():
    found = examine(walks(30), walks(30, 2.0), examiners=(Fixed(),))
    assert [member.name for member in found.examiners] == ["mean"]
    assert found.accuracy > 0.9
    assert found.told_apart


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        (
            (np.zeros(4), np.arange(5)),
            "`groups` must tell at least 2 groups of real samples apart; got 1",
        ),
        (
            (np.arange(3), np.arange(5)),
            "`groups` must be one label for each of the 4 real samples; got 3",
        ),
    ],
)
def test_groups_that_do_not_fit_are_rejected(groups, message):
    with pytest.raises(ValueError, match=message):
        examine(walks(4), walks(5), groups=groups)


def test_few_permutations_are_rejected():
    with pytest.raises(ValueError, match=r"`permutations` must be .* 19"):
        examine(walks(4), walks(5), permutations=5)


def test_last_digits_tell_nobody():
    # a constant speed differs in its last digits by where somebody moved: no difference of motion
    rng = np.random.default_rng(5)
    near_the_origin = 5 + 1e-15 * rng.normal(size=(40, 30, 1))
    far_away = 5 + 1e-12 * rng.normal(size=(40, 30, 1))
    assert examine(near_the_origin, far_away, examiners=QUICK).accuracy == 0.5

    # what a camera could measure is seen
    shaken = 5 + 1e-4 * rng.normal(size=(40, 30, 1))
    assert examine(near_the_origin, shaken, examiners=QUICK).accuracy > 0.95


def test_of_samples_that_are_all_the_same_nothing_would_be_noticed():
    found = examine(np.full((20, 30, 2), 5.0), np.full((20, 30, 2), 5.0), examiners=QUICK)
    assert found.accuracy == 0.5
    assert found.power_accuracy is None
    assert found.power == 0


def test_a_constant_has_no_rhythm():
    rng = np.random.default_rng(9)
    windows = rng.standard_normal((40, 30, 2))
    windows[..., 1] = 0.1
    labels, values = named_statistics(windows, ["speed", "turn"], 0.1)
    together = [k for k, label in enumerate(labels) if "speed" in label and "turn" in label]
    assert together
    assert (values[:, together] == 0).all()


def limited(limit, rng):
    """Turns that are rarely as large as a limit: 40 samples of 60 steps."""
    return np.clip(rng.standard_normal((40, 60, 1)), -limit, limit)


def test_trees_and_words_know_limits():
    rng = np.random.default_rng(17)
    real, simulated = limited(2.0, rng), limited(2.1, rng)
    found = examine(real, simulated, names=["turn"], permutations=19)
    members = {member.name: member.accuracy for member in found.examiners}
    assert members.pop("boosted trees on window statistics") > 0.9
    assert max(members.values()) < 0.8
    units = {"turn": "rad/s"}
    named = telling_statistics(real, simulated, np.arange(40), names=["turn"], units=units)[0]
    assert named.what in ("least turn", "largest turn")
    assert named.unit == "rad/s"


def test_least_and_largest_values_are_for_trees_alone():
    """One jump of a tracker would be all that a regression sees."""
    views = Views.of(RNG.standard_normal((80, 30, 2)), ("speed", "turn"), 0.1, PANEL, 0)
    statistics, ranks = views.standardized["statistics"], views.standardized["ranks"]
    assert ranks.shape[1] == statistics.shape[1] + 4


def test_times_are_steps_where_nobody_says_how_long_a_step_is():
    windows = RNG.standard_normal((4, 20, 2))
    unknown, _ = named_statistics(windows, ["a", "b"], 0.0)
    known, _ = named_statistics(windows, ["a", "b"], 0.5)
    assert "persistence of a over 4 steps" in unknown
    assert "persistence of a over 2 s" in known
    assert "rhythm of a, 20 steps" in unknown
    assert "rhythm of a, 10 s" in known
    assert len([name for name in unknown if name.endswith(" 2 steps later")]) > 0
    assert not [name for name in unknown if name.endswith(" s") or " s later" in name]


def test_long_times_are_whole_numbers():
    labels, _ = named_statistics(RNG.standard_normal((4, 300, 1)), ["a"], 0.0)
    assert "rhythm of a, 300 steps" in labels
    assert not [label for label in labels if "e+0" in label]
