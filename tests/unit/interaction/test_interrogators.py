"""Interrogators against a network written out; the built-in systems against cases worked by hand."""

import numpy as np
import pytest

from turing_learning.classifiers import ElmanClassifier
from turing_learning.coevolution import (
    Judgments,
    classifier_reward,
    jury_reward,
    model_reward,
    sensitivity,
)
from turing_learning.errors import RefusedError
from turing_learning.interaction import Stimulus, _examples
from turing_learning.interaction._stimulus import Dialogue, Interrogator

LIGHTS = Stimulus({"light": (0.0, 1.0), "warmth": (-5.0, 15.0)})


def logistic(x):
    return 1 / (1 + np.exp(-np.asarray(x)))


def spoken(network, genome, stimulus, answers):
    """Talk as an interrogator does, one number after the other; return the stimuli (T + 1, S) and the judgment."""
    d, h, o = network.inputs, network.hidden, stimulus.outputs
    w, u, b, v, c, choosing, thresholds = np.split(
        genome, np.cumsum([h * d, h * h, h, h, 1, o * h])
    )
    scale, hidden, stimuli = np.array(network.scale), np.zeros(h), []
    for answer in [*answers, None]:
        stimuli.append(stimulus.of(logistic(choosing.reshape(o, h) @ hidden + thresholds)))
        if answer is not None:
            seen = np.append(answer, stimuli[-1] - stimulus.center) / scale
            hidden = logistic(w.reshape(h, d) @ seen + u.reshape(h, h) @ hidden + b)
    return np.array(stimuli), logistic(v @ hidden + c[0])


@pytest.mark.parametrize(
    "stimulus", [LIGHTS, Stimulus({"light": (0.0, 1.0), "warmth": (-5.0, 15.0)}, levels=3)]
)
def test_a_dialogue_is_that_of_a_network_written_out_and_its_judgment_that_of_the_classifier(
    stimulus,
):
    rng, steps = np.random.default_rng(3), 12
    network = ElmanClassifier(inputs=3, hidden=4, scale=(2.0, 0.5, 10.0), threads=1)
    interrogator = Interrogator(network, stimulus)
    genomes, answers = (
        rng.normal(0, 2, (3, interrogator.parameters)),
        rng.normal(0, 2, (3, 5, steps, 1)),
    )
    talk, seen = Dialogue(interrogator, genomes, 5), np.empty((3, 5, steps, 3))
    for t in range(steps):
        seen[:, :, t] = np.concatenate((answers[:, :, t], talk.stimuli - stimulus.center), axis=-1)
        talk.observe(answers[:, :, t])
    for n in range(3):
        for k in range(5):
            stimuli, judgment = spoken(network, genomes[n], stimulus, answers[n, k])
            np.testing.assert_allclose(seen[n, k, :, 1:], stimuli[:-1] - stimulus.center, atol=2e-4)
            np.testing.assert_allclose(talk.outputs[n, k], judgment, atol=1e-4)
        judged = interrogator.judge(genomes[n : n + 1], seen[n])
        np.testing.assert_allclose(judged[0], talk.outputs[n], atol=1e-4)


def test_passive_stimuli_are_those_that_are_asked_for():
    rng = np.random.default_rng(1)
    anew = Stimulus({"light": (2.0, 4.0)}, passive="random").drawn(50, 40, rng)
    assert anew.min() >= 2
    assert anew.max() <= 4
    assert np.ptp(anew, axis=1).min() > 1.5
    held = Stimulus({"light": (2.0, 4.0)}, levels=3, passive="constant").drawn(50, 40, rng)
    np.testing.assert_array_equal(np.ptp(held, axis=1), 0)
    assert set(held.ravel()) == {2.0, 3.0, 4.0}
    series = (((1.0,), (0.5,)), ((0.0,), (0.25,)))
    taken = Stimulus({"light": (0.0, 1.0)}, passive="recorded", recorded=series).drawn(20, 2, rng)
    assert {tuple(one.ravel()) for one in taken} == {(1.0, 0.5), (0.0, 0.25)}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"ranges": {"light": (1.0, 1.0)}}, r"`stimulus` must have a low end below the high one; got \(1.0, 1.0\) \['light'\]"),
        ({"ranges": {}}, "`stimulus` must name one stimulus or more"),
        ({"ranges": {"light": (0.0, 1.0)}, "levels": 1}, "`levels` must be 0, or 2 or more; got 1"),
        ({"ranges": {"light": (0.0, 1.0)}, "passive": "sometimes"}, "`passive` must be one of random, constant, own, recorded"),
        ({"ranges": {"light": (0.0, 1.0)}, "passive": "recorded"}, "`recorded` must be given with passive"),
        (
            {"ranges": {"light": (0.0, 1.0)}, "passive": "recorded", "recorded": (((0.5,), (1.5,)),)},
            r"`recorded` must be from 0 to 1; got 1.5 \[series 0, step 1, light\]",
        ),
    ],
)  # fmt: skip
def test_wrong_stimuli_are_refused(given, message):
    with pytest.raises(RefusedError, match=message):
        Stimulus(**given)


def test_an_agent_climbs_where_darkness_and_light_alternate_in_time(monkeypatch):
    monkeypatch.setattr(_examples, "NOISE_CM_S", 0.0)
    agent, rng = _examples.LightResponse(), np.random.default_rng(1)
    parameters = np.tile([[2.0, 6.0, 1.0, 8.0, 0.3]], (2, 1))
    state, speeds = agent.initial(2, rng), []
    # four steps of 0.3 reach the next state; the second agent sees darkness for one step too long
    for light in zip([0] * 4 + [1] * 4 + [0] * 4 + [1] * 2, [0] * 5 + [1] * 9, strict=True):
        state, seen = agent(state, parameters, np.array(light, dtype=float)[:, None], rng)
        speeds.append(seen[:, 0])
    first, second = np.array(speeds).T
    np.testing.assert_array_equal(first, [2, 2, 2, 6, 6, 6, 6, 1, 1, 1, 1, 8, 8, 8])
    np.testing.assert_array_equal(second, [2, 2, 2, 6] + [2] * 10)


def test_a_stochastic_agent_climbs_with_its_readiness():
    agent, rng = _examples.LightResponse(stochastic=True), np.random.default_rng(2)
    parameters = np.tile([[2.0, 6.0, 1.0, 8.0, 0.3]], (4000, 1))
    state, _ = agent(agent.initial(4000, rng), parameters, np.zeros((4000, 1)), rng)
    assert abs(np.mean(state[0] == 1) - 0.3) < 0.03
    state, _ = agent(state, parameters, np.full((4000, 1), 0.5), rng)
    assert not state[0].any()


def test_sensors_see_walls_and_obstacles_up_to_their_range(monkeypatch):
    monkeypatch.setattr(_examples, "NOISE_CM", 0.0)
    robot, rng = _examples.SensorConfiguration(), np.random.default_rng(1)
    # at (60, 15), heading along x: the wall is 40 cm ahead, and 15 cm to the right; the obstacle at (70, 40), 25 cm up
    state = np.array([[60.0, 60.0], [15.0, 15.0], [0.0, 0.0]])
    up = np.arctan2(25.0, 10.0)
    sensors = np.array(
        [[0.0, 50.0, -np.pi / 2, 50.0, up, 50.0], [0.0, 30.0, -np.pi / 2, 10.0, up, 50.0]]
    )
    _, readings = robot(state, sensors, np.zeros((2, 2)), rng)
    np.testing.assert_allclose(
        readings, [[40, 15, np.hypot(10, 25) - 6], [30, 10, np.hypot(10, 25) - 6]]
    )


def test_a_robot_drives_as_its_wheels_turn_and_stops_at_walls_and_obstacles():
    robot, rng = _examples.SensorConfiguration(), np.random.default_rng(1)
    state, sensors = (
        np.array([[50.0, 95.0, 15.0], [50.0, 50.0, 30.0], [0.0, 0.0, 0.0]]),
        np.ones((3, 6)),
    )
    turned, _ = robot(state, sensors, np.array([[-1.0, 1.0]] * 3), rng)
    np.testing.assert_allclose(turned[:2], state[:2])
    np.testing.assert_allclose(turned[2], 2 * 12.8 / 5.1 * 0.1)
    for _ in range(20):
        state, _ = robot(state, sensors, np.ones((3, 2)), rng)
    np.testing.assert_allclose(state[0], [50 + 2 * 12.8, 100 - 3.5, 30 - 8 - 3.5])
    starts = robot.initial(500, rng)
    away = np.hypot(
        starts[0, :, None] - _examples.OBSTACLES[:, 0],
        starts[1, :, None] - _examples.OBSTACLES[:, 1],
    )
    assert (away >= _examples.OBSTACLES[:, 2] + 3.5 - 1e-9).all()


MET = np.array([[True, True, False], [False, True, True]])
JUDGED = Judgments(
    np.array([[1.0, 1.0], [1.0, 0.0]]),
    np.array([[[1.0], [0.0], [0.0]], [[0.0], [1.0], [0.0]]]),
    met=MET,
)


def test_rewards_count_those_who_have_met():
    np.testing.assert_array_equal(model_reward(JUDGED), [1 / 1, 1 / 2, 0 / 1])
    np.testing.assert_array_equal(sensitivity(JUDGED), [1 / 2, 1 / 2])
    np.testing.assert_array_equal(classifier_reward(JUDGED), [(1 + 1 / 2) / 2, (1 / 2 + 1 / 2) / 2])
    # the second classifier guesses and has no vote: the third model, which it alone has met, gets the plain share
    np.testing.assert_array_equal(jury_reward(JUDGED), [1, 0, 0])
    assert JUDGED.selection == "active"


def test_a_model_that_nobody_has_met_is_refused():
    with pytest.raises(ValueError, match="`met` must hold a classifier for each model"):
        Judgments(
            JUDGED.genuine_outputs,
            JUDGED.counterfeit_outputs,
            met=np.array([[True, True, False]] * 2),
        )
