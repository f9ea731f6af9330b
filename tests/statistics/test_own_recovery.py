"""Known parameters of a custom system are found again."""

import numpy as np
import pytest

import turing_learning as tl

# In 12 runs of this size, six seeds for each of the two truths, the largest errors were 0.42 (speed) and 0.34 (turns),
# both at 0.95 of the range. The bounds, 5 % and 25 % of the ranges, are twice as much.
TOLERANCE = np.array([1.0, 0.75])


def walk(parameters, rng):
    """A persistent random walk of 50 steps: speed with a noise of 10 %, and turns."""
    speed, noise = parameters.T[:, :, None]
    shape = (len(parameters), 50)
    return np.stack(
        [speed * (1 + 0.1 * rng.standard_normal(shape)), noise * rng.standard_normal(shape)],
        axis=-1,
    )


@pytest.mark.parametrize("truth", [(5.0, 0.5), (19.0, 2.85)], ids=["low", "at 0.95 of the range"])
def test_speed_and_turn_noise_of_a_walk_are_recovered(truth):
    result = tl.infer(
        genuine=walk(np.tile(truth, (100, 1)), np.random.default_rng(1)),
        simulate=walk,
        parameters={"speed": (0, 20), "turn_noise": (0, 3)},
        generations=400,
        seed=2,
        settings={
            "models.population": 80,
            "classifiers.population": 80,
            "run.threads": 1,
            "run.estimate_window": 200,
        },
    )
    error = np.abs(np.array(list(result.estimate.values())) - truth)
    assert (error <= TOLERANCE).all(), error
