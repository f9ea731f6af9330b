import shutil
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from own_models import RANGES, recorded, walk

import turing_learning as tl
from turing_learning.analysis import UNKNOWN, WHY_UNKNOWN, pooled_estimate, pooled_interval, r_hat
from turing_learning.config import ConfigurationError, with_settings
from turing_learning.report import short_number
from turing_learning.runs import RunFolderError, simulate_laboratory, start

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "run.threads": 1,
    "run.history": "thin",
}
LENGTH = 20
WINDOW = 6  # the last 0.3 of it


def own(seed, genuine=None, parameters=RANGES, settings=None, **options):
    return tl.infer(
        genuine=recorded() if genuine is None else genuine,
        simulate=walk,
        parameters=parameters,
        generations=LENGTH,
        seed=seed,
        settings=SMALL | (settings or {}),
        **options,
    )


@pytest.fixture(scope="module")
def kept(tmp_path_factory, small):
    """Folders of three runs of a scenario, that no test may change."""
    folder = tmp_path_factory.mktemp("pool")
    for seed in (1, 2, 3):
        history = "full" if seed == 2 else "thin"
        start(
            small(seed=seed, generations=LENGTH, history=history, checkpoint_every=2 + seed),
            folder / f"{seed}",
        )
    return folder


@pytest.fixture(scope="module")
def three(kept):
    return [tl.load_run(kept / f"{seed}") for seed in (1, 2, 3)]


def typical(runs):
    return np.stack([run.history["typical_model"].to_numpy()[-WINDOW:] for run in runs])


def test_the_pool_is_told_of_the_generations_that_make_the_estimates(three):
    pooled, series = tl.pool(three), typical(three)
    names = ["vl0", "vr0", "vl1", "vr1"]
    assert (
        list(pooled.estimate)
        == list(pooled.interval)
        == list(pooled.agreement)
        == list(pooled.estimates)
        == names
    )
    np.testing.assert_array_equal(list(pooled.estimate.values()), pooled_estimate(series))
    np.testing.assert_array_equal(list(pooled.interval.values()), pooled_interval(series))
    np.testing.assert_array_equal(list(pooled.agreement.values()), r_hat(series))
    for name in names:
        assert pooled.estimates[name] == [run.estimate[name] for run in three]
        assert pooled.estimate[name] == np.median(pooled.estimates[name])
    assert (pooled.scenario, pooled.seeds, pooled.generations) == ("aggregation", (1, 2, 3), LENGTH)


def test_chains_are_runs_as_arviz_takes_them(three):
    pooled = tl.pool(three)
    data = pooled.to_xarray()
    assert dict(data.sizes) == {"chain": 3, "draw": len(next(iter(pooled.chains.values())))}
    assert data["chain"].values.tolist() == list(pooled.seeds)
    for k, run in enumerate(three):
        typical = run.history["typical_model"].to_numpy()[-data.sizes["draw"] :]
        np.testing.assert_array_equal(
            np.stack([data[name].values[k] for name in pooled.estimate], axis=1), typical
        )


def test_where_there_is_a_truth_the_errors_are_those_of_the_pool(three):
    pooled = tl.pool(three)
    assert pooled.truth == three[0].truth
    errors = {name: abs(pooled.estimate[name] - true) for name, true in pooled.truth.items()}
    assert pooled.estimate_absolute_error == pytest.approx(errors)
    assert pooled.estimate_mae == pytest.approx(np.mean(list(errors.values())))


def test_runs_in_folders_and_in_memory_and_all_histories_give_the_same(three, small):
    pooled = tl.pool(three)
    memory = [tl.infer(config=small(seed=seed, generations=LENGTH)) for seed in (1, 2, 3)]
    assert tl.pool(memory) == pooled
    assert tl.pool([memory[0], *three[1:]]) == pooled


def test_a_pool_cannot_be_changed(three):
    with pytest.raises(FrozenInstanceError):
        tl.pool(three).scenario = "other"


def test_the_table_says_where_runs_disagree(three):
    text = str(
        replace(tl.pool(three), agreement={"vl0": 1.2, "vr0": 1.5, "vl1": 1.51, "vr1": np.inf})
    )
    head, columns, *lines = text.splitlines()
    assert head == f"aggregation, 3 runs, seeds 1, 2, 3, {LENGTH} generations: runs disagree"
    assert columns.split() == ["parameter", "estimate", "90", "%", "true", "error", "R-hat", "runs"]
    assert [line.split()[-2:] for line in lines[:4]] == [
        ["1.20", "agree"], ["1.50", "unclear"], ["1.51", "disagree"], ["inf", "disagree"]
    ]  # fmt: skip
    assert [line.partition(":")[0] for line in lines[4:-1]] == [
        "runs disagree on vl1",
        "runs disagree on vr1",
    ]
    assert short_number(three[1].estimate["vl1"]) in lines[4]


def test_where_no_run_has_moved_it_is_said_that_nothing_is_known(three):
    still = {"vl0": [UNKNOWN, UNKNOWN]}
    some = tl.pool(three)
    text = str(
        replace(some, interval=some.interval | still, agreement=some.agreement | {"vl0": UNKNOWN})
    )
    assert [line.split() for line in text.splitlines() if line.split()[0] == "vl0"] == [
        [
            "vl0",
            short_number(some.estimate["vl0"]),
            "-",
            "-0.700",
            short_number(some.estimate_absolute_error["vl0"]),
            "-",
            "unknown",
        ]
    ]
    assert text.splitlines()[-3:-1] == [
        f"The 90 % interval is unknown for vl0: {WHY_UNKNOWN}.",
        f"Whether runs agree is unknown for vl0: {WHY_UNKNOWN}.",
    ]
    assert "nan" not in text


def test_runs_of_one_generation_say_only_how_they_scatter():
    runs = [own(seed, settings={"run.estimate_window": 1}) for seed in (1, 2, 3)]
    assert all(np.isnan(ends).all() for run in runs for ends in run.interval.values())
    pooled = tl.pool(runs)
    assert pooled == tl.pool(runs)
    assert set(pooled.runs_agree.values()) == {"unknown"}
    assert all(low < pooled.estimate[name] < high for name, (low, high) in pooled.interval.items())


def test_a_system_of_ones_own_is_pooled_within_its_bounds_and_without_truth():
    pooled = tl.pool([own(1), own(2)])
    for name, (low, high) in RANGES.items():
        assert (
            low
            <= pooled.interval[name][0]
            <= pooled.estimate[name]
            <= pooled.interval[name][1]
            <= high
        )
    assert (pooled.truth, pooled.estimate_absolute_error, pooled.estimate_mae) == (None, None, None)
    assert str(pooled).splitlines()[1].split() == [
        "parameter",
        "estimate",
        "90",
        "%",
        "R-hat",
        "runs",
    ]


def test_a_parameter_on_a_logarithmic_scale_is_pooled_in_decades():
    parameters = {
        "speed": tl.Parameter(1e-3, 1e3, scale="log"),
        "turn_noise": tl.Parameter(0, None),
    }
    runs = [own(seed, parameters=parameters) for seed in (1, 2, 3, 4)]
    pooled, decades = tl.pool(runs), np.log10(typical(runs)[..., :1])
    assert pooled.estimate["speed"] == pytest.approx(10 ** pooled_estimate(decades)[0])
    expected = np.clip(10 ** pooled_interval(decades)[0], 1e-3, 1e3)
    np.testing.assert_allclose(pooled.interval["speed"], expected)
    assert pooled.interval["turn_noise"][0] >= 0


def test_networks_are_pooled_by_what_they_do(small):
    configured = [with_settings(small(seed=seed), {"models.hidden": 3}) for seed in (1, 2)]
    pooled = tl.pool([tl.infer(config=one) for one in configured])
    assert list(pooled.estimate) == list(pooled.truth) == ["vl0", "vr0", "vl1", "vr1"]


def test_runs_of_a_laboratory_are_pooled(small):
    runs = [
        simulate_laboratory(small(seed=seed, generations=3), repeats=1).result for seed in (1, 2)
    ]
    assert tl.pool(runs).seeds == (1, 2)


def test_fewer_than_two_runs_are_refused(three):
    for runs in ([], three[:1]):
        with pytest.raises(
            ConfigurationError, match=f"`runs` must be at least 2; got {len(runs)}. Make more runs"
        ):
            tl.pool(runs)


def test_the_same_seed_twice_is_refused(three):
    with pytest.raises(
        ConfigurationError, match=r"`runs` must have different seeds; got seed 1 twice \[.*/1\]"
    ):
        tl.pool([*three, three[0]])


def test_the_same_seed_of_other_settings_is_another_run(three, small):
    other = with_settings(small(seed=1, generations=LENGTH, history="thin"), {"models.parents": 5})
    with pytest.raises(
        ConfigurationError, match=r"got models\.parents = 4 with seed 1 and 5 with seed 1\."
    ):
        tl.pool([three[0], tl.infer(config=other)])


def test_runs_that_are_described_otherwise_are_pooled(three, small):
    told = {"scenario.title": "Mine", "scenario.description": "11 robots gather."}
    fourth = tl.infer(config=with_settings(small(seed=4, generations=LENGTH), told))
    assert tl.pool([*three, fourth]).seeds == (1, 2, 3, 4)


def test_a_run_that_is_not_complete_is_refused(three, small, tmp_path, stop_after):
    kept = start(small(seed=4, generations=LENGTH), tmp_path / "run", should_stop=stop_after(9))
    message = r"`runs` must be complete; got seed 4 stopped after 9 generations \[.*\]\. Resume it with `turing-learning resume "
    with pytest.raises(ConfigurationError, match=message):
        tl.pool([three[0], kept])
    memory = tl.infer(config=small(seed=4, generations=LENGTH), should_stop=stop_after(9))
    with pytest.raises(
        ConfigurationError, match=r"stopped after 9 generations\. Let it run to its end"
    ):
        tl.pool([three[0], memory])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"run.generations": 21}, "run.generations = 20 with seed 1 and 21 with seed 7"),
        ({"models.parents": 5}, "models.parents = 4 with seed 1 and 5 with seed 7"),
        ({"scenario.agents": 3}, "scenario.agents = 2 with seed 1 and 3 with seed 7"),
        (
            {"scenario.name": "other"},
            "scenario.name = 'aggregation' with seed 1 and 'other' with seed 7",
        ),
    ],
)
def test_other_settings_are_refused(three, small, settings, message):
    other = with_settings(small(seed=7, generations=LENGTH, history="thin"), settings)
    with pytest.raises(
        ConfigurationError,
        match=f"`runs` must be of the same system and configuration; got {message}",
    ):
        tl.pool([*three, tl.infer(config=other)])


def test_other_samples_and_other_systems_are_refused(three):
    first = own(1)
    with pytest.raises(
        ConfigurationError,
        match=r"got scenario\.digest = '.*\.\.\. with seed 1 and '.*\.\.\. with seed 2",
    ):
        tl.pool([first, own(2, genuine=recorded(seed=4))])
    with pytest.raises(
        ConfigurationError,
        match=r"got scenario\.parameters\.speed\.high = 20\.0 with seed 1 and 30\.0",
    ):
        tl.pool([first, own(2, parameters=RANGES | {"speed": (0, 30)})])
    with pytest.raises(ConfigurationError, match="must be of the same system and configuration"):
        tl.pool([first, three[1]])


def test_a_run_that_has_lost_its_history_is_refused(kept, three, tmp_path):
    for seed, lost in ((2, "history.zarr"), (3, "checkpoints")):
        folder = shutil.copytree(kept / f"{seed}", tmp_path / f"{seed}")
        shutil.rmtree(folder / lost)
        with pytest.raises(RunFolderError, match=str(folder)):
            tl.pool([three[0], tl.load_run(folder)])


def test_a_result_alone_is_refused(three):
    with pytest.raises(RuntimeError, match="must belong to a run; got a result alone"):
        tl.pool([three[0], replace(three[1], record=None)])
