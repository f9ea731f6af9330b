import logging
import re

import numpy as np
import pytest
from simulators import (
    SIGNALS,
    STEPS,
    CannotBeLoaded,
    die_above_half,
    failing,
    hang_above_half,
    noise,
    noise_of_one,
    spawning,
)

from turing_learning import Parameter
from turing_learning.coevolution import Judgments, SampleSource
from turing_learning.systems import (
    CustomSource,
    CustomSystem,
    CustomSystemError,
    FailureLog,
    Genuine,
    GuardedInterrogation,
)
from turing_learning.systems._genuine import read_genuine

DATA = np.random.default_rng(5).normal(3, 1, size=(12, STEPS, SIGNALS))
MODELS = np.linspace(-1, 1, 8)[:, None] * np.ones(
    (1, 2)
)  # three of them above 0.5 in the first parameter's units


def own_system(**changes):
    fields = {
        "name": "noise",
        "title": "Noise",
        "parameters": {"a": Parameter(-1, 1, unit="cm"), "b": Parameter(-1, 1)},
        "signals": ("x", "y"),
        "steps": STEPS,
        "center": (3.0, 2.0),
        "input_scale": (1.0, 1.0),
        "samples": len(DATA),
        "samples_per_generation": 0,
    }
    return CustomSystem(**(fields | changes))


def source(simulate=noise, genuine=DATA, workers=None, timeout_s=None, **changes):
    data = read_genuine(
        genuine, held_out=None if callable(genuine) else 0.25, rng=np.random.default_rng(0)
    )
    return CustomSource(own_system(**changes), data, simulate, workers=workers, timeout_s=timeout_s)


def collect(one, generation=0, seed=1):
    one.generation = generation
    return one.collect(MODELS, np.random.default_rng(seed))


def refused(one, generation=0):
    with pytest.raises(CustomSystemError) as caught:
        collect(one, generation)
    return str(caught.value)


def test_an_own_source_is_a_sample_source():
    assert isinstance(source(), SampleSource)


def test_samples_have_the_shapes_of_the_protocol():
    samples = collect(source())
    assert (samples.genuine.shape, samples.counterfeit.shape) == (
        (8, STEPS, SIGNALS),
        (8, 1, STEPS, SIGNALS),
    )


def test_models_reach_the_simulator_in_the_units_of_the_parameters():
    seen = []

    def simulate(parameters, rng):
        seen.append(parameters)
        return noise(parameters, rng)

    collect(
        source(simulate, parameters={"a": Parameter(0, 20), "b": Parameter(0.01, 100, scale="log")})
    )
    np.testing.assert_allclose(seen[0][:, 0], np.linspace(0, 20, 8))
    np.testing.assert_allclose(seen[0][:, 1], np.geomspace(0.01, 100, 8))


def test_the_same_models_and_random_numbers_give_the_same_samples():
    first, second = collect(source()), collect(source())
    np.testing.assert_array_equal(first.genuine, second.genuine)
    np.testing.assert_array_equal(first.counterfeit, second.counterfeit)


def test_both_kinds_of_samples_are_centered_alike():
    samples = collect(
        source(lambda parameters, rng: np.full((len(parameters), STEPS, SIGNALS), 5.0))
    )
    np.testing.assert_array_equal(samples.counterfeit[0, 0, 0], [2.0, 3.0])
    assert {tuple(row) for row in samples.genuine[:, 0]} <= {
        tuple(row) for row in DATA[:, 0] - [3.0, 2.0]
    }


def test_held_out_samples_are_never_shown():
    one = source(samples_per_generation=9)
    testing = read_genuine(DATA, held_out=0.25, rng=np.random.default_rng(0)).testing - [3.0, 2.0]
    shown = np.concatenate([collect(one, seed=seed).genuine for seed in range(5)])
    assert not {sample.tobytes() for sample in testing} & {sample.tobytes() for sample in shown}


def test_another_part_of_the_genuine_samples_is_drawn_in_each_generation():
    one = source(samples_per_generation=4)
    first, second = collect(one, seed=1).genuine, collect(one, seed=2).genuine
    assert len(first) == len(second) == 4
    assert len({sample.tobytes() for sample in first}) == 4
    assert not np.array_equal(first, second)


def test_a_live_source_is_observed_in_every_generation():
    one = source(genuine=lambda rng: rng.normal(size=(4, STEPS, SIGNALS)), samples=0)
    assert not np.array_equal(collect(one, seed=1).genuine, collect(one, seed=2).genuine)


@pytest.mark.parametrize(
    ("live", "message"),
    [
        (
            lambda rng: np.full((2, STEPS, SIGNALS), np.nan),
            "got nan (or masked) [sample 0, step 0, signal 0]",
        ),
        (
            lambda rng: np.ones((2, STEPS, 1)),
            "`genuine` must yield 2 signals as in the beginning; got 1",
        ),
        (lambda rng: 1 / 0, "division by zero"),
    ],
)
def test_a_live_source_that_fails_ends_the_run(live, message):
    data = Genuine(DATA, np.empty(0, dtype=int), live)
    text = refused(CustomSource(own_system(samples=0), data, noise), generation=3)
    assert message in text
    assert "[live source, generation 3]" in text


def test_several_samples_of_each_model_are_kept_apart():
    def simulate(parameters, rng):
        return np.stack([noise(parameters, rng) for _ in range(3)], axis=1)

    assert collect(source(simulate)).counterfeit.shape == (8, 3, STEPS, SIGNALS)


def test_a_simulator_of_one_model_is_called_for_each_with_random_numbers_of_its_own():
    counterfeit = collect(source(noise_of_one, batches=0)).counterfeit
    assert len({(sample - sample.mean()).tobytes() for sample in counterfeit}) == 8


def test_batches_split_the_models_of_a_generation():
    sizes = []

    def simulate(parameters, rng):
        sizes.append(len(parameters))
        return noise(parameters, rng)

    collect(source(simulate, batches=3))
    assert sizes == [3, 3, 2]


def test_a_simulator_cannot_spoil_its_parameters():
    def simulate(parameters, rng):
        parameters[:] = 0
        raise ArithmeticError("too late")

    assert "a = -1 cm, b = -1" in refused(source(simulate))


@pytest.mark.parametrize(("simulate", "batches"), [(noise, 3), (noise_of_one, 0)])
@pytest.mark.parametrize("workers", [1, 3])
def test_workers_yield_what_this_process_yields(simulate, batches, workers):
    here = collect(source(simulate, batches=batches)).counterfeit
    with source(simulate, batches=batches, workers=workers) as one:
        np.testing.assert_array_equal(collect(one).counterfeit, here)


def test_workers_yield_what_this_process_yields_also_of_a_group_that_failed_after_it_spawned_generators():
    here = collect(source(spawning, batches=1), generation=1).counterfeit
    with source(spawning, batches=1, workers=1) as one:
        np.testing.assert_array_equal(collect(one, generation=1).counterfeit, here)


@pytest.mark.parametrize(
    ("simulate", "reason"),
    [(hang_above_half, "it took longer than 0.5 s"), (die_above_half, "its worker process died")],
)
def test_a_call_that_hangs_or_kills_its_worker_costs_only_its_model(simulate, reason):
    with source(simulate, batches=0, workers=2, timeout_s=0.5) as one:
        samples = collect(one, generation=4)
        assert one.failed.tolist() == [False] * 6 + [True] * 2
        assert {entry["reason"] for entry in one.failures.summary()["listed"]} == {reason}
        np.testing.assert_array_equal(
            samples.counterfeit[:6], collect(source(noise_of_one, batches=0), 4).counterfeit[:6]
        )


def test_a_simulator_that_cannot_be_sent_is_refused():
    with pytest.raises(
        ValueError,
        match=r"`simulate` must be a function that another process can import; got <function",
    ):
        source(lambda parameters, rng: None, workers=2)


def test_a_simulator_that_a_worker_cannot_load_ends_the_run():
    with source(CannotBeLoaded(), workers=1) as one:
        assert refused(one).startswith(
            "`simulate` must be importable by a worker process; got ImportError: no such model. Define it at the top level"
        )


@pytest.mark.parametrize(
    ("reason", "told"),
    [
        ("raise", "it raised ArithmeticError: too fast ["),
        ("nan", "it returned nan (or masked) [step 3, signal y]"),
        ("masked", "it returned nan (or masked) [step 3, signal y]"),
        ("shape", "it returned shape (4, 2) instead of (T, D) = (5, 2) or (C, T, D)"),
        ("nothing", "it returned None"),
        ("complex", "it returned complex numbers"),
    ],
)
def test_a_model_that_fails_later_is_marked_and_noted(reason, told):
    one = source(failing(noise_of_one, reason), batches=0)
    samples = collect(one, generation=2)
    assert one.failed.tolist() == [False] * 6 + [True] * 2
    np.testing.assert_array_equal(samples.counterfeit[7, 0], np.tile([-3.0, -2.0], (STEPS, 1)))
    summary = one.failures.summary()
    assert summary["count"] == 2
    assert summary["listed"][0]["generation"] == 2
    assert summary["listed"][0]["parameters"]["a"] == pytest.approx(5 / 7)
    assert summary["listed"][0]["reason"].startswith(told)


def test_the_first_failure_of_a_run_is_logged(caplog):
    one = source(failing(noise_of_one, "nan"), batches=0)
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        collect(one, 2)
        collect(one, 3)
    assert caplog.messages == [
        "2 of 8 simulations failed in generation 2, the first with a = 0.714286 cm, b = 0.714286: "
        "it returned nan (or masked) [step 3, signal y]."
    ]


def test_numbers_that_are_not_finite_do_not_end_the_first_generation():
    one = source(failing(noise_of_one, "nan"), batches=0)
    collect(one, generation=0)
    assert one.failed.sum() == 2


@pytest.mark.parametrize("reason", ["raise", "shape", "nothing"])
def test_an_exception_or_a_wrong_shape_in_the_first_generation_names_the_parameters(reason):
    text = refused(source(failing(noise_of_one, reason), batches=0))
    assert text.startswith("`simulate` must return samples of every model; it r")
    assert "[generation 0, a = 0.714286 cm, b = 0.714286]. Repair it" in text


def test_the_line_that_raised_is_named():
    assert re.search(
        r"too fast \[.*simulators.py:\d+\]",
        refused(source(failing(noise_of_one, "raise"), batches=0)),
    )


def together(simulate):
    """Return a simulator of all models that fails as a whole where one of them fails."""
    return lambda parameters, rng: np.stack([simulate(one, rng) for one in parameters])


def test_a_group_that_fails_is_simulated_again_model_by_model():
    one = source(together(failing(noise_of_one, "raise")))
    collect(one, generation=1)
    assert one.failed.tolist() == [False] * 6 + [True] * 2


def test_the_model_that_makes_a_group_fail_in_the_first_generation_is_named():
    assert "[generation 0, a = 0.714286 cm, b = 0.714286]" in refused(
        source(together(failing(noise_of_one, "raise")))
    )


def test_a_simulator_that_fails_for_groups_only_is_told():
    def alone(parameters, rng):
        if len(parameters) > 1:
            raise IndexError("one at a time")
        return noise(parameters, rng)

    assert refused(source(alone)).startswith(
        "`simulate` must return samples of several models at once; it failed for a group"
    )


def test_a_group_of_the_wrong_shape_in_the_first_generation_is_told_as_such():
    text = refused(source(lambda parameters, rng: np.zeros((STEPS, SIGNALS))))
    assert (
        "it returned shape (5, 2) instead of (M, T, D) = (8, 5, 2) or (M, C, T, D) [generation 0, a = -1 cm"
        in text
    )
    assert "set vectorized=False" in text


def test_a_simulator_of_one_model_is_not_advised_to_be_one():
    text = refused(source(lambda parameters, rng: np.zeros((STEPS, 1)), batches=0))
    assert text.endswith(
        "Repair it, return NaN for a model that has none, or narrow the bounds of the parameters."
    )


def test_models_with_another_number_of_samples_fail():
    def simulate(parameters, rng):
        return np.stack([noise_of_one(parameters, rng)] * (2 if parameters[0] > 0.5 else 1))

    one = source(simulate, batches=0)
    collect(one, generation=1)
    assert (
        one.failures.summary()["listed"][0]["reason"]
        == "it returned 2 samples of a model, and 1 of others"
    )


def test_a_generation_in_which_more_than_half_fail_ends_the_run():
    text = refused(source(failing(noise_of_one, "nan", above=-0.3), batches=0), generation=6)
    assert text.startswith(
        "`simulate` must not fail for more than half of the 8 models of a generation; got 5 failures or more"
    )
    assert "[generation 6], the first with a = -0.142857 cm" in text


def test_after_a_run_no_generation_is_named(caplog):
    one = source(failing(noise_of_one, "raise"), batches=0)
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        collect(one, generation=None)
    assert one.failed.sum() == 2
    assert caplog.messages[0].startswith(
        "2 of 8 simulations failed, the first with a = 0.714286 cm, b = 0.714286: it raised"
    )
    assert one.failures.summary() == {"count": 2, "listed": []}
    text = refused(source(failing(noise_of_one, "nan", above=-0.3), batches=0), generation=None)
    assert text.startswith(
        "`simulate` must not fail for more than half of the 8 models; got 5 failures or more, the first"
    )
    assert text.endswith("[step 3, signal y]. Repair the simulator.")


def test_models_that_nobody_has_inferred_may_fail_without_a_word():
    one = source(failing(noise_of_one, "nan", above=-0.3), batches=0)
    with one.probing():
        collect(one, generation=6)
    assert one.failed.sum() == 5
    none = source(failing(noise_of_one, "nan", above=-10), batches=0)
    with none.probing():
        collect(none, generation=6)
    assert none.failed.all()
    assert one.failures.count == none.failures.count == 0


def test_failed_models_are_rejected_by_every_classifier_and_archived_one():
    class Believer:
        parameters = 1

        def judge(self, genomes, samples):
            return np.full((len(genomes), len(samples)), 0.9)

    one = source(failing(noise_of_one, "nan"), batches=0)
    one.generation = 1
    judgments = GuardedInterrogation(one, Believer())(
        MODELS, np.zeros((3, 1)), np.random.default_rng(1), referees=np.zeros((2, 1))
    )
    assert isinstance(judgments, Judgments)
    for outputs in (judgments.counterfeit, judgments.refereed):
        np.testing.assert_array_equal(
            outputs[:, :, 0], np.broadcast_to(~one.failed, outputs.shape[:2])
        )


def test_judgments_are_left_alone_where_nothing_failed():
    class Believer:
        parameters = 1

        def judge(self, genomes, samples):
            return np.full((len(genomes), len(samples)), 0.9)

    judgments = GuardedInterrogation(source(), Believer())(
        MODELS, np.zeros((3, 1)), np.random.default_rng(1)
    )
    assert judgments.counterfeit.all()
    assert judgments.referee_outputs is None


def test_a_log_of_failures_goes_on_from_its_state():
    log = FailureLog(("a", "b"))
    for k in range(103):
        log.add(k, np.array([k, 0.5]), "x" * 400)
    again = FailureLog(("a", "b"))
    again.restore(log.state())
    assert again.summary() == log.summary()
    assert (
        log.summary()["count"],
        len(log.summary()["listed"]),
        len(log.summary()["listed"][0]["reason"]),
    ) == (103, 100, 300)


def test_an_empty_log_has_a_state():
    log = FailureLog(("a",))
    log.restore(log.state())
    assert log.summary() == {"count": 0, "listed": []}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"simulate": 3}, "`simulate` must be a function of (parameters, rng); got int."),
        (
            {"timeout_s": 1.0},
            "`timeout_s` must be given together with `workers`, as only a process can be ended; got 1.0.",
        ),
        ({"workers": 0}, "`workers` must be an integer of at least 1; got 0."),
        ({"workers": 1, "timeout_s": 0}, "`timeout_s` must be a finite number above 0; got 0."),
    ],
)
def test_a_setting_that_breaks_its_rule_is_refused(options, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        source(**options)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"name": "my fish"},
            "`name` must be of 1 to 60 letters, digits, _, + and -; got 'my fish'.",
        ),
        ({"parameters": {}}, "`parameters` must name one parameter or more; got {}."),
        (
            {"parameters": {"v (cm)": Parameter(0, 1)}},
            "got 'v (cm)'. Give the unit to `Parameter`.",
        ),
        ({"signals": ("x", "x")}, "`signals` must have different names; got x, x."),
        (
            {"signals": ("x",)},
            "`signals` must be as many names as the data has signals, one or more; got 1 names of 2 signals.",
        ),
        ({"steps": 0}, "`steps` must be an integer of at least 1; got 0."),
        ({"batches": -1}, "`batches` must be an integer of at least 0; got -1."),
    ],
)
def test_a_system_that_breaks_a_rule_is_refused(changes, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        own_system(**changes)
