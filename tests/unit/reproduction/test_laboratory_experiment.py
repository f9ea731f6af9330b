"""Section 5: what is taken from the runs, the rules, and pieces that are done side by side."""

import numpy as np
import pandas as pd
import pytest

from turing_learning.reproduction import Stopped
from turing_learning.reproduction._experiment import Work
from turing_learning.reproduction._laboratory_trials import (
    Gathering,
    LaboratoryRuns,
    emulated_runs,
    places_apart,
)
from turing_learning.reproduction.experiments import EXPERIMENTS
from turing_learning.reproduction.experiments.classifiers import BestAccuracies
from turing_learning.reproduction.experiments.laboratory import (
    NAMES,
    classifiers_verdict,
    distances,
    does_not_drop,
    dynamics_verdict,
    error_dynamics,
    medians,
    runs_verdict,
    share_between,
    validation_verdict,
)
from turing_learning.robots import LABORATORY

TRUTH = np.array([-0.7, -1.0, 1.0, -1.0])


def runs_of(models, fitness, again=None):
    """Runs with models (R, G, M, P) and their fitness (R, G, M); classifiers do not matter."""
    models, fitness = np.asarray(models, float), np.asarray(fitness, float)
    again = fitness[:, -1:] if again is None else np.asarray(again, float)
    nothing = np.zeros((len(models), 1, 1, 1))
    return LaboratoryRuns(models, fitness, again, nothing, nothing[..., 0])


def offsets(values, parameters=4):
    """Models (R, G, M, P) whose MAE is |value|, from values (R, G, M)."""
    return TRUTH + np.repeat(np.asarray(values, float)[..., None], parameters, axis=-1)


def test_the_best_model_is_that_of_the_highest_mean_fitness_when_observed_again():
    runs = runs_of(
        offsets([[[0.1, 0.2, 0.3]]]),
        [[[9.0, 0.0, 0.0]]],
        again=[[[0.9, 0.5, 0.1], [0.0, 0.6, 0.1]]],
    )
    np.testing.assert_allclose(runs.best, [TRUTH + 0.2])


def test_the_subjectively_best_model_of_each_generation_has_the_highest_fitness():
    runs = runs_of(offsets([[[0.1, 0.2], [0.3, 0.4]]]), [[[0.0, 1.0], [1.0, 0.0]]])
    np.testing.assert_allclose(runs.fittest, [[TRUTH + 0.2, TRUTH + 0.3]])


def test_error_dynamics_are_medians_over_runs_of_average_chosen_and_lowest_errors():
    maes = [[[0.1, 0.3]], [[0.2, 0.6]], [[0.3, 0.9]]]
    fitness = [[[1.0, 0.0]], [[0.0, 1.0]], [[1.0, 0.0]]]
    found = error_dynamics(runs_of(offsets(maes), fitness), TRUTH)
    np.testing.assert_allclose(found["average"], [0.4])  # of 0.2, 0.4, 0.6
    np.testing.assert_allclose(found["subjective"], [0.3])  # of 0.1, 0.6, 0.3
    np.testing.assert_allclose(found["objective"], [0.2])


def test_the_share_between_counts_generations():
    dynamics = pd.DataFrame(
        {"average": [0.4] * 3, "subjective": [0.3, 0.5, 0.1], "objective": [0.1] * 3}
    )
    assert share_between(dynamics) == pytest.approx(2 / 3)


def test_medians_are_compared_over_the_last_fifth_of_the_generations():
    near, far = np.zeros((1, 10, 1)), np.zeros((1, 10, 1))
    far[0, :8], far[0, 8:] = 5.0, 0.3
    one, other = (runs_of(offsets(values), np.ones((1, 10, 1))) for values in (near, far))
    assert medians(one).shape == (10, 4)
    late, overall = distances(one, other)
    np.testing.assert_allclose(late, [0.3] * 4)
    np.testing.assert_allclose(overall, [0.8 * 5.0 + 0.2 * 0.3] * 4)


def test_the_parameters_are_those_of_the_laboratory():
    assert tuple(LABORATORY.parameter_names) == NAMES


def test_errors_at_the_printed_ones_agree_and_large_ones_differ():
    printed = np.array([0.08, 0.01, 0.05, 0.02])
    fitness = np.ones((10, 1, 1))
    models = TRUTH + np.broadcast_to(printed * [1, 1, -1, 1], (10, 1, 1, 4))
    verdict = runs_verdict(runs_of(models, fitness), TRUTH)
    assert (verdict.agrees, verdict.rule) == (True, "absolute errors")
    assert "median model -0.62, -0.99, 0.95, -0.98" in verdict.observed
    assert not runs_verdict(runs_of(models - [0, 0, 0.2, 0], fitness), TRUTH).agrees


def test_dynamics_agree_if_both_kinds_are_between_and_end_together():
    maes = np.tile([0.1, 0.3], (2, 10, 1))
    fitness = np.tile([1.0, 0.0], (2, 10, 1))
    good = runs_of(offsets(maes), fitness)
    worst = runs_of(offsets(maes), 1 - fitness)
    assert dynamics_verdict(good, good, TRUTH).agrees
    verdict = dynamics_verdict(good, worst, TRUTH)
    assert not verdict.agrees
    assert "100% of the generations of emulated and 0% of simulated runs" in verdict.observed
    assert "vl0 0.20" in verdict.observed


def gathering(rng, spread_cm, trials=10):
    seen = rng.normal(100, spread_cm, (trials, 3, 12, 2))
    return Gathering(seen, np.ones((trials, 3), bool), np.zeros((trials, 3, 12, 3)), 3.5)


def test_swarms_of_one_kind_agree_and_dispersed_ones_differ():
    rng = np.random.default_rng(1)
    agents, alike, apart = (gathering(rng, spread) for spread in (10, 10, 60))
    assert agents.proportion.shape == (10, 3)
    assert validation_verdict(agents, alike, 4.0).agrees
    verdict = validation_verdict(agents, apart, 4.0)
    assert not verdict.agrees
    assert verdict.observed.startswith("12 robots after 4 s: largest cluster")


def test_robots_begin_apart_and_inside():
    poses = places_apart(40, (200.0, 225.0), 3.5, np.random.default_rng(2))
    distances_cm = np.linalg.norm(poses[:, None, :2] - poses[None, :, :2], axis=-1) + 100 * np.eye(
        40
    )
    assert distances_cm.min() > 7.0
    assert (poses[:, :2] >= 3.5).all()
    assert (poses[:, :2] <= [196.5, 221.5]).all()


def test_an_accuracy_that_only_wavers_does_not_drop():
    rng = np.random.default_rng(4)
    level = 0.7 + 0.05 * rng.standard_normal((10, 5))
    assert does_not_drop(level + np.array([0, 0.05, 0.06, 0.05, 0.06]))
    assert not does_not_drop(level + np.array([0, 0.2, 0.2, 0.2, 0.0]))


def test_classifiers_agree_if_the_best_is_high_and_the_chosen_does_not_drop():
    chosen, high = np.tile([0.6, 0.8], (3, 1)), np.tile([0.7, 0.95], (3, 1))
    generations = np.array([0, 99])
    assert classifiers_verdict(BestAccuracies("", generations, chosen, high, high)).agrees
    assert not classifiers_verdict(
        BestAccuracies("", generations, chosen[:, ::-1], high, high)
    ).agrees
    assert not classifiers_verdict(BestAccuracies("", generations, chosen, chosen, chosen)).agrees


def doubled(should_stop, value):
    """A piece of work for worker processes."""
    return None if should_stop() else {"twice": np.array([2 * value])}


def test_pieces_are_done_side_by_side_and_once(tmp_path):
    said = []
    for _ in range(2):
        work = Work(tmp_path, None, workers=2, say=said.append)
        found = work.all_arrays(doubled, {"one": (1,), "two": (2,)})
        assert {name: int(each["twice"][0]) for name, each in found.items()} == {"one": 2, "two": 4}
    assert sorted(line.partition(":")[0] for line in said) == ["one", "two"]


def test_pieces_that_were_stopped_are_told(tmp_path):
    with pytest.raises(Stopped, match="one"):
        Work(tmp_path, None, workers=2, should_stop=lambda: True).all_arrays(
            doubled, {"one": (1,), "two": (2,)}
        )
    assert not list(tmp_path.iterdir())


def test_a_run_that_was_stopped_is_gone_on_with(tmp_path, monkeypatch):
    pytest.importorskip("cv2")
    settings = {"models.population": 2, "classifiers.population": 4, "run.history": "full"}
    sizes = EXPERIMENTS["5"].fast["runs"] | {"kept": [1], "settings": settings}
    asked = []

    def once_complete():
        asked.append(None)
        return (
            len(asked) == 2
        )  # the first question comes before the piece, the second after a generation

    work = Work(tmp_path, {"runs": sizes}, fast=True, should_stop=once_complete)
    with pytest.raises(Stopped):
        emulated_runs(work)
    assert (tmp_path / "emulated-run-seed5001" / "checkpoints").is_dir()
    found = emulated_runs(Work(tmp_path, {"runs": sizes}, fast=True))
    assert (found.models.shape, found.again.shape) == ((1, 2, 2, 4), (1, 1, 2))
    assert found.classifiers.shape[:3] == (1, 1, 4)


def test_the_fast_form_takes_its_numbers_from_the_run(conducted, rows):
    if not (conducted / "5").exists():
        pytest.skip("the packages of section 5 are not installed")
    with np.load(conducted / "5" / "pieces" / "emulated-seed5001.npz") as piece:
        best = piece["found/models"][-1, piece["found/again"].mean(axis=0).argmax()]
    (row,) = (row for row in rows("5", "models") if row["runs"] == "emulated laboratory")
    np.testing.assert_allclose([float(row[name]) for name in NAMES], best, rtol=1e-5)
