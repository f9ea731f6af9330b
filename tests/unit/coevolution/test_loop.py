"""The loop, on a system of one parameter that runs in milliseconds.

The system yields series of normal numbers with mean 3 and standard deviation 1; a model is a mean. A classifier has a
center and a width and accepts a series whose mean lies within the width around the center.
"""

import numpy as np
import pytest

from turing_learning.analysis import estimate
from turing_learning.coevolution import Coevolution, Judgments, PassiveInterrogation, Samples
from turing_learning.evolution import CMAEvolutionStrategy, EvolutionStrategy

TRUTH = 3.0
STEPS = 10
GENUINE = 200


class NormalSource:
    def collect(self, models, rng):
        return Samples(
            TRUTH + rng.standard_normal((GENUINE, STEPS, 1)),
            models[:, None, None, :] + rng.standard_normal((len(models), 1, STEPS, 1)),
        )


class BandClassifier:
    parameters = 2

    def judge(self, genomes, samples):
        distance = samples.mean(axis=(1, 2)) - genomes[:, :1]
        return 1 / (1 + np.exp(np.clip(distance**2 - genomes[:, 1:] ** 2, -50, 50)))


def strategy(dimension, seed):
    return EvolutionStrategy(dimension, parents=15, offspring=15, seed=seed)


def coevolution(seed=0, interrogation=None, **rewards):
    interrogation = interrogation or PassiveInterrogation(NormalSource(), BandClassifier())
    return Coevolution(
        interrogation, strategy(1, [seed, 1]), strategy(2, [seed, 2]), seed=seed, **rewards
    )


class Script:
    """An interrogation that returns what it is given, and remembers what it was asked."""

    def __init__(self, judgments):
        self.judgments = judgments
        self.models, self.classifiers, self.draws = [], [], []

    def __call__(self, models, classifiers, rng):
        self.models.append(models)
        self.classifiers.append(classifiers)
        self.draws.append(rng.random())
        return self.judgments


class Recorder(EvolutionStrategy):
    """A strategy that remembers what it was told."""

    def __init__(self, dimension, seed):
        super().__init__(dimension, parents=2, offspring=2, seed=seed)
        self.told = []

    def tell(self, fitness):
        self.told.append(fitness)
        super().tell(fitness)


def judgments(models=4, classifiers=4, seed=0):
    rng = np.random.default_rng(seed)
    return Judgments(rng.random((classifiers, 6)), rng.random((classifiers, models, 1)))


def assert_equal_runs(first, second, generations=3):
    for _ in range(generations):
        one, other = first.step(), second.step()
        assert one.number == other.number
        for name in (
            "models",
            "model_step_sizes",
            "model_fitness",
            "classifiers",
            "classifier_fitness",
        ):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("seed", range(8))
def test_models_become_indistinguishable_from_the_system(seed):
    run = coevolution(seed)
    typical = np.array([run.step().typical_model for _ in range(150)])
    # The genuine samples of one generation fix the mean to 1 / sqrt(200 * 10) = 0.022 only; five standard errors.
    assert abs(estimate(typical)[0] - TRUTH) < 0.11


def test_any_optimizer_fits():
    models = EvolutionStrategy(1, parents=15, offspring=15, seed=1)
    classifiers = CMAEvolutionStrategy(2, size=30, seed=2, initial_low=0.0, initial_high=4.0)
    run = Coevolution(
        PassiveInterrogation(NormalSource(), BandClassifier()), models, classifiers, seed=3
    )
    typical = np.array([run.step().typical_model for _ in range(150)])
    assert (
        abs(estimate(typical)[0] - TRUTH) < 0.5
    )  # without selection models stay within their initial -1 to 1


def test_a_step_is_one_generation():
    run = coevolution()
    assert [run.step().number for _ in range(3)] == [0, 1, 2]
    assert run.generation == 3


def test_the_record_holds_both_populations_as_they_were_judged():
    script = Script(judgments())
    models, classifiers = Recorder(2, 0), Recorder(3, 1)
    expected_steps = models.step_sizes
    generation = Coevolution(script, models, classifiers, seed=0).step()
    assert generation.models is script.models[0]
    assert generation.classifiers is script.classifiers[0]
    np.testing.assert_array_equal(generation.model_step_sizes, expected_steps)
    assert generation.classifier_step_sizes.shape == (4, 3)


def test_both_optimizers_are_told_the_rewards_of_the_paper():
    given = judgments()
    models, classifiers = Recorder(2, 0), Recorder(3, 1)
    generation = Coevolution(Script(given), models, classifiers, seed=0).step()
    accepted, right = given.counterfeit_outputs[..., 0] >= 0.5, given.genuine_outputs >= 0.5
    np.testing.assert_array_equal(models.told[0], accepted.mean(axis=0))
    np.testing.assert_allclose(
        classifiers.told[0], (right.mean(axis=1) + (~accepted).mean(axis=1)) / 2
    )
    np.testing.assert_array_equal(generation.model_fitness, models.told[0])
    np.testing.assert_array_equal(generation.classifier_fitness, classifiers.told[0])


def test_other_rewards_are_told_and_the_record_keeps_those_of_the_paper():
    given = judgments()
    models, classifiers = Recorder(2, 0), Recorder(3, 1)
    run = Coevolution(
        Script(given),
        models,
        classifiers,
        seed=0,
        reward_models=lambda j: j.counterfeit_outputs.mean(axis=(0, 2)),
        reward_classifiers=lambda j: [5, 6, 7, 8],
    )
    generation = run.step()
    np.testing.assert_array_equal(models.told[0], given.counterfeit_outputs.mean(axis=(0, 2)))
    np.testing.assert_array_equal(classifiers.told[0], [5, 6, 7, 8])
    np.testing.assert_array_equal(generation.model_fitness, given.counterfeit.mean(axis=(0, 2)))
    assert generation.classifier_fitness.max() <= 1


@pytest.mark.parametrize(("output", "selection"), [(0.9, "all accepted"), (0.1, "all rejected")])
def test_the_record_tells_when_selection_stops(output, selection):
    given = Judgments(np.full((4, 2), output), np.full((4, 4, 1), output))
    assert (
        Coevolution(Script(given), Recorder(2, 0), Recorder(3, 1), seed=0).step().selection
        == selection
    )


def test_each_generation_draws_from_its_own_generator():
    script = Script(judgments())
    run = Coevolution(script, Recorder(2, 0), Recorder(3, 1), seed=[7, 8])
    for _ in range(2):
        run.step()
    expected = [
        np.random.default_rng(np.random.SeedSequence([7, 8], spawn_key=(g,))).random()
        for g in range(2)
    ]
    assert script.draws == expected


def test_the_same_seed_gives_the_same_run():
    assert_equal_runs(coevolution(5), coevolution(5))


def test_another_seed_of_the_loop_gives_other_samples():
    scripts = [Script(judgments()) for _ in range(2)]
    for seed, script in enumerate(scripts):
        Coevolution(script, Recorder(2, 0), Recorder(3, 1), seed=seed).step()
    assert scripts[0].draws != scripts[1].draws


@pytest.mark.parametrize("generations", [0, 4])
def test_a_restored_coevolution_goes_on_bit_identically(generations):
    run = coevolution(2)
    for _ in range(generations):
        run.step()
    restored = coevolution(2)
    restored.step()
    restored.restore(run.state())
    assert restored.generation == generations
    assert_equal_runs(restored, run)


def test_the_state_holds_the_states_of_both_optimizers_as_arrays():
    state = coevolution().state()
    assert {"generation", "models/population", "classifiers/population"} <= set(state)
    assert all(isinstance(array, np.ndarray) and array.dtype != object for array in state.values())


def test_after_an_interrogation_that_failed_the_last_state_can_be_restored():
    broken = PassiveInterrogation(NormalSource(), BandClassifier())
    run, twin = coevolution(interrogation=broken), coevolution()
    run.step(), twin.step()
    state = run.state()
    broken.source = None
    with pytest.raises(AttributeError):
        run.step()
    broken.source = NormalSource()
    run.restore(state)
    assert_equal_runs(run, twin)


def test_after_a_step_that_failed_neither_step_nor_state_is_possible():
    run = coevolution(reward_models=lambda j: np.zeros(3))
    with pytest.raises(ValueError, match="must return an array"):
        run.step()
    assert run.generation == 0
    with pytest.raises(RuntimeError, match="`ask` must be called after `tell`"):
        run.step()
    with pytest.raises(RuntimeError, match="`state` must be called after `tell`"):
        run.state()


@pytest.mark.parametrize("name", ["reward_models", "reward_classifiers"])
@pytest.mark.parametrize("rewards", [np.zeros(29), np.zeros((30, 1)), 1.0])
def test_rewards_of_another_shape_are_refused(name, rewards):
    with pytest.raises(ValueError, match=rf"`{name}` must return an array of shape \(30,\); got"):
        coevolution(**{name: lambda j: rewards}).step()


@pytest.mark.parametrize("name", ["reward_models", "reward_classifiers"])
def test_rewards_that_are_not_finite_are_refused(name):
    rewards = np.zeros(30)
    rewards[4] = np.nan
    with pytest.raises(ValueError, match=f"`{name}` must return finite numbers; got nan at 4"):
        coevolution(**{name: lambda j: rewards}).step()


@pytest.mark.parametrize("sizes", [(5, 4), (4, 5)])
def test_judgments_of_other_populations_are_refused(sizes):
    run = Coevolution(Script(judgments(*sizes)), Recorder(2, 0), Recorder(3, 1), seed=0)
    with pytest.raises(
        ValueError, match=r"must return judgments of N = 4 classifiers on M = 4 models; got"
    ):
        run.step()


@pytest.mark.parametrize("seed", [-1, 0.5, [1, -1]])
def test_a_seed_that_is_no_natural_number_is_refused(seed):
    with pytest.raises(
        ValueError, match="`seed` must be a non-negative integer or a sequence of them; got"
    ):
        Coevolution(Script(None), Recorder(2, 0), Recorder(3, 1), seed=seed)


@pytest.mark.parametrize(
    ("generation", "rule"),
    [
        (-1, "be a non-negative integer; got -1.0"),
        (0.5, "be a non-negative integer; got 0.5"),
        ([1, 2], r"be of shape \(\); got \(2,\)"),
        (np.nan, "be finite; got nan"),
    ],
)
def test_a_state_without_a_valid_generation_is_refused(generation, rule):
    run = coevolution()
    with pytest.raises(ValueError, match=rf"`state\['generation'\]` must {rule}"):
        run.restore({**run.state(), "generation": np.array(generation)})


def test_an_empty_state_is_refused():
    with pytest.raises(ValueError, match=r"`state` must hold an array 'generation'; got \[\]"):
        coevolution().restore({})


def test_a_state_of_other_populations_is_refused():
    run = Coevolution(Script(None), Recorder(2, 0), Recorder(3, 1), seed=0)
    with pytest.raises(
        ValueError,
        match=r"`state\['population'\]` must be of shape \(N, P\) = \(4, 2\); got \(30, 1\)",
    ):
        run.restore(coevolution().state())
