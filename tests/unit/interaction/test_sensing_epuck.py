"""An e-puck among posts: its motion and infrared sensors beside Enki's, mirrored worlds, and runs on it."""

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.errors import RefusedError
from turing_learning.interaction import STIMULATED
from turing_learning.interaction import _epuck as epuck
from turing_learning.kernels.court import LEFT, read
from turing_learning.systems import Arguments, SystemFailedError

INFRARED = STIMULATED["infrared-sensors"]
NO_POSTS = np.zeros((1, 0, 4))


class Silent:
    """A generator without noise: wheels do as commanded, sensors measure exactly."""

    def uniform(self, low, high, shape):
        return np.full(shape, (low + high) / 2)

    def standard_normal(self, shape):
        return np.zeros(shape)


def reading(distance, posts=NO_POSTS):
    """Return the reading of a sensor in the robot's center, so far from the right wall."""
    readings = np.empty((1, 1))
    robots = np.array([[50.0 - distance, 25.0, 0.0, 0.0, 0.0, 0.0]])
    mounts = np.array([[[0.0, 0.0, 1.0, 0.0]]])
    read(robots, posts, mounts, np.zeros((1, 1)), readings, epuck.FIELD, epuck.INFRARED)
    return readings[0, 0]


@pytest.mark.parametrize(
    ("distance", "value"),
    [
        # 3731 x 0.61 / (x^2 - 0.6 x + 0.7): the outer rays take away what the middle one has twice.
        (1.0, 2275.91 / 1.1),
        (3.0, 2275.91 / 7.9),
        (8.0, 2275.91 / 59.9),
        (0.2, 3000.0),
    ],
)
def test_a_wall_across_is_read_as_the_response_says(distance, value):
    assert reading(distance) == pytest.approx(value / 3000, rel=1e-12)


def test_a_post_that_only_the_middle_ray_meets_weakens_it():
    near = np.array([[[40.0, 25.0, 0.0, 0.0]]])
    # The robot is 25 from the wall; the post's edge is 5 ahead, and its middle ray 5 / cos 15.
    near[0, 0, 0] = 25.0 + 5.0 + 1.85
    slanted = 5.0 / np.cos(np.pi / 12)
    middle = 2275.91 / 22.7 - 2 * 2275.91 / (slanted**2 - 0.6 * slanted + 0.7)
    outer = (5.0 + 1.85) * np.cos(np.pi / 12)
    outer -= np.sqrt(1.85**2 - ((5.0 + 1.85) * np.sin(np.pi / 12)) ** 2)
    value = middle + 2 * 2275.91 / (outer**2 - 0.6 * outer + 0.7)
    assert reading(25.0, near) == pytest.approx(value / 3000, rel=1e-12)
    # Farther away the outer rays miss it, and what is left is below 0.
    near[0, 0, 0] = 25.0 + 6.0 + 1.85
    assert reading(25.0, near) == 0.0


def driven(start, parameters, commands):
    """Return a robot after control cycles without noise, and its readings."""
    step = epuck.InfraredSensors()
    state = step.initial(1, np.random.default_rng(1))
    state.robots[0, :3] = start
    for command in commands:
        state, readings = step(state, parameters[None], np.array([command]), Silent())
    return state, readings[0]


def test_a_robot_pushes_posts_and_reads_as_in_enki():
    # Run in Enki (commit bb486bf) with the same sensors, at rest in the first two cycles.
    commands = [(9.6 / 12.8, 1.0)] * 30
    state, readings = driven((18.0, 20.0, 0.6), np.array(epuck.INFRARED_TRUTH), commands)
    pose = [20.3876436129818, 46.0033296358801, 2.35686274509805]
    np.testing.assert_allclose(state.robots[0, :3], pose, rtol=1e-10)
    pushed = [41.6165905086439, 35.0952015460219]
    np.testing.assert_allclose(state.posts[0, 4, :2], pushed, rtol=1e-10)
    expected = [0.697109246, 1.0, 0.176378866, 0.023927142, 0.0, 0.0, 0.0, 0.046520243]
    np.testing.assert_allclose(readings, expected, atol=1e-8)


def test_a_mirrored_robot_reads_the_same():
    rng = np.random.default_rng(2)
    parameters = np.concatenate((rng.uniform(-3, 3, 8), rng.uniform(0.5, 3.7, 8)))
    commands = rng.uniform(-0.2, 1, (40, 2))
    state, readings = driven((17.0, 30.0, 0.4), parameters, commands)
    parameters[:8] *= -1
    mirrored, same = driven((17.0, 20.0, -0.4), parameters, commands[:, ::-1])
    np.testing.assert_allclose(same, readings, atol=1e-9)
    assert mirrored.robots[0, 1] == pytest.approx(50 - state.robots[0, 1])
    assert readings.max() > 0.01


def test_models_with_the_true_parameters_are_the_system():
    system = tl.config.load_configuration(
        scenario="infrared-sensors", overrides={"scenario.stimulus.passive": "random"}
    ).system
    source = system.open(Arguments())
    genuine = source.genuine_samples(600, np.random.default_rng(3)).mean(axis=1)
    models = np.tile(system.true, (600, 1))
    copies = source.simulate(models, np.random.default_rng(4))[:, 0].mean(axis=1)
    errors = np.sqrt((genuine.var(axis=0) + copies.var(axis=0)) / 600)
    assert (abs(genuine.mean(axis=0) - copies.mean(axis=0)) < 4 * errors).all()
    # A sensor that looks elsewhere is told.
    models[:, 0] += np.pi / 2
    others = source.simulate(models, np.random.default_rng(4))
    assert not np.allclose(others[:, 0].mean(axis=1)[:, 0], copies[:, 0])


def test_commands_act_after_a_cycle_and_never_above_full_speed():
    step = epuck.RangefinderResponse()
    state = step.initial(50, np.random.default_rng(5))
    start = state.robots.copy()
    rng = np.random.default_rng(6)
    models = np.tile((2.0, 1.0), (50, 1))
    for _ in range(2):
        state, answers = step(state, models, np.ones((50, 2)), rng)
        np.testing.assert_array_equal(state.robots[:, :3], start[:, :3])
    assert state.robots[:, LEFT:].max() == 12.8
    assert state.robots[:, LEFT:].min() > 12.8 * 0.95
    # As far from a wall as the arena allows: 2 x / 200 + 1.
    assert ((answers >= 1) & (answers < 2 * 63.4 / 200 + 1)).all()


@pytest.mark.parametrize("passive", ["", "own"])
def test_two_generations_and_their_report(passive, tmp_path):
    name = "rangefinder-response"
    settings = {"models.population": 6, "classifiers.population": 6, "scenario.opponents": 2}
    settings["scenario.stimulus.passive"] = passive
    out = tmp_path / "run"
    result = tl.infer(name, generations=2, preset="authors", settings=settings, seed=1, out=out)
    assert tuple(result.truth) == tuple(STIMULATED[name].parameters)
    report = (out / "report.html").read_text()
    assert "Stimulus and answer" in report
    # Each moves as its own sensor says.
    assert "under the same stimulus" not in report


def test_only_what_acts_by_itself_is_watched_at_that():
    with pytest.raises(RefusedError, match="`simulate` must have a method `own`"):
        tl.infer("light-response", generations=1, settings={"scenario.stimulus.passive": "own"})


def test_an_own_controller_that_fails_is_named_with_its_error():
    class Broken:
        def __call__(self, state, parameters, stimulus, rng):
            return state, stimulus[:, :1]

        def own(self, state, parameters):
            raise ZeroDivisionError("no wheels")

    with pytest.raises(
        SystemFailedError, match=r"`simulate.own` must return .* no wheels \[step 0"
    ):
        tl.infer(
            genuine={"gain": 1.0},
            simulate=Broken(),
            parameters={"gain": (0.0, 2.0)},
            signals=("speed",),
            stimulus={"light": (0.0, 1.0)},
            passive="own",
            steps=5,
            generations=1,
        )
