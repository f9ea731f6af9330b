"""The report of a run on recorded motion shows the individuals beside replicas."""

import numpy as np

import turing_learning as tl
from turing_learning.families import BurstAndCoast
from turing_learning.runs import RunFolder
from turing_learning.runs._plots import recorded_replay
from turing_learning.systems import Source

TANK = BurstAndCoast(individuals=3, steps=400, interval_s=0.2, tank_cm=(30.0, 20.0))
PLACES = TANK.simulate(np.array([[12.0, 0.5, 0.8, 0.3]]), np.random.default_rng(0))[0]
THERE = np.ones(PLACES.shape[:2], dtype=bool)
THERE[5:9, 1] = False
RECORDING = tl.Trajectories(
    PLACES + np.array([7.0, -3.0]), THERE, fps=5.0, individuals=("a", "b", "c")
)
WALK = BurstAndCoast(individuals=3, steps=20, interval_s=0.2, tank_cm=(30.0, 20.0))


def infer(simulate=WALK, **more):
    settings = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}
    windows = RECORDING.windows(length_s=4.0)
    return tl.infer(
        genuine=windows,
        simulate=simulate,
        parameters=WALK.parameters,
        generations=2,
        settings=settings,
        **more,
    )


def test_the_report_of_a_run_in_a_folder_and_in_memory_shows_the_same_replay(tmp_path):
    result = infer(out=tmp_path / "run")
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Recorded individuals beside replicas" in page
    assert '<span class="key agent">3 individuals</span>' in page
    assert "<label hidden>" in page  # of lines of sight
    again = tl.load_run(tmp_path / "run").report(tmp_path / "again.html").read_text()
    in_memory = infer().report(tmp_path / "memory.html").read_text()
    data = [
        text.split('id="replay-data">')[1].split("</script>")[0]
        for text in (page, again, in_memory)
    ]
    assert data[0] == data[1] == data[2]
    motion = RunFolder(tmp_path / "run").read("motion.npz")
    assert len(motion["recorded"]) == len(motion["replicas"]) == 301  # 60 s at 5 frames per second
    np.testing.assert_array_equal(np.isnan(motion["recorded"]).any(axis=2), ~THERE[:301])
    moved = recorded_replay(motion)
    recorded, replicas = moved.swarms
    seen = RECORDING.positions[:301][THERE[:301]]
    np.testing.assert_allclose(recorded.poses[THERE[:301]][:, :2], seen - seen.min(axis=0))
    assert moved.walls_cm == (0.0, 0.0, 30.0, 20.0)
    assert (replicas.poses[..., :2] >= 0).all()
    assert (replicas.poses[..., :2] <= (30.0, 20.0)).all()
    assert np.isfinite(recorded.poses).all()
    model = np.array([list(result.estimate.values())])
    rng = np.random.default_rng((4, 1))  # as a replay of simulated robots
    expected = BurstAndCoast(
        individuals=3, steps=299, interval_s=0.2, tank_cm=(30.0, 20.0)
    ).simulate(model, rng)[0]
    np.testing.assert_array_equal(motion["replicas"], expected)


def test_a_simulator_that_does_not_know_positions_has_a_report_without_a_replay(tmp_path):
    page = (
        infer(lambda parameters, rng: WALK(parameters, rng))
        .report(tmp_path / "page.html")
        .read_text()
    )
    assert "beside replicas" not in page
    assert recorded_replay(Source().positions(np.zeros(1), np.random.default_rng(0))) is None
