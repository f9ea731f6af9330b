"""Where the first individuals are: `models.start`."""

import numpy as np

import turing_learning as tl


def run(start):
    settings = {
        "models.population": 8,
        "classifiers.population": 8,
        "models.start": start,
        "models.initial_low": 0.2,
    }
    return tl.infer("aggregation", generations=2, seed=1, settings=settings, progress=False)


def test_models_that_start_in_the_middle_of_the_range_are_there_at_first():
    spread, middle = (run(start).history for start in ("range", "middle"))
    np.testing.assert_allclose(middle["best_model"][0], 0.6, atol=1e-8)
    assert np.abs(spread["best_model"][0] - 0.6).max() > 0.01


def test_such_a_run_is_not_called_converged_because_its_first_models_were_alike():
    assert run("middle").verdict == "still moving"
