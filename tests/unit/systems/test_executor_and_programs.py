"""Who calls a simulator, and simulators from functions and programs that run one model."""

import sys
import time
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor

import numpy as np
import pandas as pd
import pytest
from simulators import noise, noise_of_one
from test_custom_source import DATA, collect, own_system, source

import turing_learning as tl
from turing_learning.systems import (
    Arguments,
    Command,
    CustomSource,
    CustomSystemError,
    describe,
    per_model,
    read_table,
    table_values,
)
from turing_learning.systems._genuine import read_genuine

PARAMETERS = {"mean": (0.0, 10.0), "sd": (0.1, 3.0)}


def by(executor, simulate=noise, **changes):
    data = read_genuine(DATA, held_out=0.25, rng=np.random.default_rng(0))
    return CustomSource(own_system(**changes), data, simulate, executor=executor)


# ---------------------------------------------------------------- executors


@pytest.mark.parametrize(("simulate", "batches"), [(noise, 3), (noise_of_one, 0)])
@pytest.mark.parametrize("workers", [1, 4])
def test_an_executor_yields_what_this_process_yields(simulate, batches, workers):
    with source(simulate, batches=batches) as here, ThreadPoolExecutor(workers) as threads:
        there = by(threads, simulate, batches=batches)
        np.testing.assert_array_equal(collect(here).counterfeit, collect(there).counterfeit)


def test_calls_are_made_together_and_come_in_order():
    """Eight calls of which the first ones take longest, on eight threads, take as long as one."""
    began = []

    def slow(parameters, rng):
        began.append(time.perf_counter())
        time.sleep(0.3 if parameters[0] < 0 else 0.05)
        return noise_of_one(parameters, rng)

    with ThreadPoolExecutor(8) as threads, source(noise_of_one, batches=0) as here:
        found = collect(by(threads, slow, batches=0))
        np.testing.assert_array_equal(found.counterfeit, collect(here).counterfeit)
    assert max(began) - min(began) < 0.25


class Lossy(ThreadPoolExecutor):
    """An executor whose first call never comes back, nor those of some other numbers."""

    def __init__(self, error, lost=(1,)):
        super().__init__(2)
        self.error = error
        self.lost = lost
        self.calls = 0

    def submit(self, *call, **more):
        self.calls += 1
        if self.calls not in self.lost:
            return super().submit(*call, **more)
        future = Future()
        future.set_exception(self.error)
        return future


class KilledWorker(Exception):
    """As Dask names it."""


def test_a_call_whose_workers_died_costs_its_model_alone():
    with Lossy(KilledWorker("a call")) as lossy:
        one = by(lossy, noise_of_one, batches=0)
        samples = collect(one, generation=1)
    assert one.failed.tolist() == [True] + [False] * 7
    assert one.failures.summary()["listed"][0]["reason"] == "its workers died"
    assert samples.counterfeit[1:].any()


def test_an_answer_that_is_lost_on_its_way_is_asked_for_again():
    with (
        Lossy(ValueError("not enough values to unpack")) as lossy,
        source(noise_of_one, batches=0) as here,
    ):
        found = collect(by(lossy, noise_of_one, batches=0))
        np.testing.assert_array_equal(found.counterfeit, collect(here).counterfeit)
    assert lossy.calls == 9


def test_one_call_of_a_batch_is_said_to_be_one(caplog):
    with ThreadPoolExecutor(8) as threads:
        tl.infer(
            genuine=DATA,
            simulate=noise,
            parameters=PARAMETERS,
            batches=1,
            executor=threads,
            trials=300,
            progress=False,
            should_stop=lambda: True,
        )
    assert "8 workers make the 1 call of a batch in 1 round, busy for 12% of" in caplog.text


@pytest.mark.parametrize(
    ("workers", "trials", "said"),
    [
        (
            64,
            3000,
            '73 calls of a batch in 2 rounds, busy for 57% of the time; settings={"run.batch": 64}, or --set run.batch=64',
        ),
        (200, 3000, 'in 1 round, busy for 36% of the time; settings={"run.batch": 200}'),
        (400, 3000, "more are of use in a run of more trials"),
        (16, 3000, ""),
        (2, 300, ""),
    ],
)
def test_workers_that_would_be_idle_are_named_before_a_run_begins(workers, trials, said, caplog):
    with ThreadPoolExecutor(workers) as threads:
        tl.infer(
            genuine=DATA,
            simulate=noise_of_one,
            parameters=PARAMETERS,
            vectorized=False,
            executor=threads,
            trials=trials,
            progress=False,
            should_stop=lambda: True,
        )
    assert said in caplog.text
    assert ("busy for" in caplog.text) == bool(said)


@pytest.mark.parametrize("error", [RuntimeError("no route"), None])
def test_a_broken_executor_stops_the_run_with_a_remedy(error):
    # the first of eight calls, and once more
    with Lossy(error or BrokenExecutor("the scheduler is gone"), lost=(1, 9)) as lossy:
        one = by(lossy, noise_of_one, batches=0)
        message = (
            "`executor` must stay; it broke: BrokenExecutor"
            if error is None
            else "RuntimeError: no route"
        )
        with pytest.raises(
            CustomSystemError, match=f"{message}.*can be resumed, with another executor"
        ):
            collect(one, generation=1)


def test_a_closed_executor_is_told():
    threads = ThreadPoolExecutor(1)
    threads.shutdown()
    with pytest.raises(
        CustomSystemError, match="`executor` must take calls; got RuntimeError: cannot schedule"
    ):
        collect(by(threads))


def test_an_executor_stands_alone():
    data = read_genuine(DATA, held_out=0.25, rng=np.random.default_rng(0))
    with (
        ThreadPoolExecutor(1) as threads,
        pytest.raises(ValueError, match="`workers` must be left out beside"),
    ):
        CustomSource(own_system(), data, noise, workers=2, executor=threads)


def test_a_run_with_an_executor_is_stopped_and_resumed_to_the_same_bits(tmp_path):
    genuine = 5 + np.random.default_rng(1).standard_normal((20, 10, 1))
    system = {"genuine": genuine, "simulate": draw_walk}
    options = {
        "parameters": PARAMETERS,
        "vectorized": False,
        "seed": 1,
        "trials": 60,
        "progress": False,
    }
    whole = tl.infer(**system, **options)
    with ThreadPoolExecutor(3) as threads:
        stops = iter([False, False, True])
        tl.infer(
            **system,
            **options,
            executor=threads,
            out=tmp_path / "run",
            should_stop=lambda: next(stops, True),
        )
        again = tl.resume(tmp_path / "run", **system, executor=threads)
    assert again.estimate == whole.estimate


def draw_walk(parameters, rng):
    mean, sd = parameters
    return mean + sd * rng.standard_normal((10, 1))


def test_a_function_of_a_notebook_is_refused_for_processes_in_one_line(monkeypatch):
    def here(parameters, rng):
        return noise(parameters, rng)

    here.__module__ = "__main__"
    monkeypatch.setattr(sys, "modules", {**sys.modules, "__main__": type(sys)("__main__")})
    message = r"`simulate` must be a function that another process can import; got here of a notebook\. Write it to a file"
    with pytest.raises(ValueError, match=message):
        source(here, workers=2)


# ---------------------------------------------------------------- failures of the first batch


def failing_for_some(parameters, rng, how):
    mean, sd = parameters
    if mean > 8:
        if how == "raise":
            raise ArithmeticError("too fast")
        return np.full((10, 1), np.nan)
    return mean + sd * rng.standard_normal((10, 1))


@pytest.mark.parametrize("length", [{"trials": 60}, {"generations": 2}])
def test_in_the_first_batch_an_exception_ends_the_run_and_nan_does_not(length):
    """As own-system.md says, by trials and by generations."""
    genuine = 5 + np.random.default_rng(1).standard_normal((20, 10, 1))
    options = {
        "genuine": genuine,
        "parameters": PARAMETERS,
        "vectorized": False,
        "seed": 1,
        "progress": False,
    }
    with pytest.raises(
        CustomSystemError, match=r"it raised ArithmeticError: too fast .* \[generation 0, mean = "
    ):
        tl.infer(simulate=lambda p, rng: failing_for_some(p, rng, "raise"), **options, **length)
    result = tl.infer(simulate=lambda p, rng: failing_for_some(p, rng, "nan"), **options, **length)
    failures = result.failed_simulations
    assert failures["count"] > 0
    assert failures["listed"][0]["generation"] == 0
    with pytest.raises(CustomSystemError, match="must not fail for more than half of the"):
        tl.infer(simulate=lambda p, rng: np.full((10, 1), np.nan), **options, **length)


# ---------------------------------------------------------------- functions and programs that run one model


def run_model(mean, sd, seed):
    rng = np.random.default_rng(seed)
    return pd.DataFrame({"step": np.arange(10), "value": mean + sd * rng.standard_normal(10)})


def test_a_function_of_named_parameters_is_a_simulator():
    simulate = per_model(run_model, PARAMETERS, columns=["value"])
    sample = simulate(np.array([5.0, 1.0]), np.random.default_rng(3))
    seed = int(np.random.default_rng(3).integers(2**31 - 1))
    np.testing.assert_array_equal(sample[:, 0], run_model(5.0, 1.0, seed).value)
    genuine = [run_model(5.0, 1.0, seed) for seed in range(20)]
    result = tl.infer(
        genuine=genuine,
        simulate=simulate,
        parameters=PARAMETERS,
        trials=200,
        seed=1,
        progress=False,
    )
    assert result.configuration.system.signals == ("value",)
    assert result.estimate["mean"] == pytest.approx(5, abs=0.5)


def test_a_table_of_agents_and_steps_is_refused():
    index = pd.MultiIndex.from_product([range(3), range(2)], names=["Step", "AgentID"])
    message = 'have one row for each step; got an index of 2 levels.*groupby\\("Step"\\)'
    with pytest.raises(ValueError, match=message):
        table_values(pd.DataFrame({"wealth": np.ones(6)}, index))


def test_a_function_may_take_no_seed():
    simulate = per_model(lambda mean, sd: {"x": [mean, sd]}, ["mean", "sd"], seeded=False)
    assert simulate(np.array([1.0, 2.0]), np.random.default_rng(1)).tolist() == [[1.0], [2.0]]


def test_a_simulator_with_parameters_of_other_names_is_refused():
    simulate = per_model(
        lambda mean, spread: {"x": [mean, spread]}, ["mean", "spread"], seeded=False
    )
    message = (
        "`simulate` must have the parameters of the run, mean, sd, in this order; got mean, spread"
    )
    with pytest.raises(ValueError, match=message):
        tl.infer(genuine=np.ones((3, 2, 1)), simulate=simulate, parameters=PARAMETERS, trials=60)


def test_tables_of_all_kinds_are_numbers():
    assert table_values({"a": [1, 2], "b": [3, 4]}, ["b", "a"]).tolist() == [[3, 1], [4, 2]]
    assert table_values([1, 2]).tolist() == [[1], [2]]
    with pytest.raises(ValueError, match="`table` must have the columns a, c; got a, b"):
        table_values({"a": [1], "b": [2]}, ["a", "c"])


def flows(mean, sd, seed):
    draws = np.random.default_rng(seed).standard_normal(6)
    return {"in": mean + draws, "out": -mean * sd * np.ones(6)}


def flows_by_position(mean, sd, seed):
    return np.column_stack(list(flows(mean, sd, seed).values()))


@pytest.mark.parametrize(
    ("columns", "function"),
    [((), flows), (("in", "out"), flows), ((), flows_by_position)],
    ids=["all", "chosen", "array"],
)
def test_columns_are_those_of_the_same_name_from_the_begin_of_a_run(columns, function):
    """Tables of the system have another order, and a further column where columns are chosen."""
    frames = []
    for seed in range(12):
        frame = pd.DataFrame(flows(5.0, 1.0, seed))
        names = ["in", "out"] if function is flows_by_position else ["out", "in"]
        frame = frame[names]
        frames.append(frame.assign(run=seed) if columns else frame)
    simulate = per_model(function, PARAMETERS, columns=columns)
    system, data = describe(frames, PARAMETERS, {"vectorized": False}, columns)
    # A run that is resumed has the tables in another order.
    tables = [dict(reversed(list(frame.items()))) for frame in frames]
    for given in (Arguments(data, simulate), Arguments(tables, simulate)):
        with system.open(given) as source:
            sample = source.simulated(np.array([[5.0, 1.0]]), np.random.default_rng(1))[0, 0]
        np.testing.assert_array_equal(sample[:, system.signals.index("out")], -5.0)


def test_tables_of_a_live_source_are_read_by_name_also_when_resumed():
    """A later observation has another order, and the simulator's tables a third one."""
    orders = iter([["low", "high"], ["high", "low"], ["high", "low"], ["low"]])

    def observe(rng):
        table = pd.DataFrame({"low": [1.0, 2.0], "high": [101.0, 102.0]})
        return [table[next(orders)]] * 2

    def run_one(mean, sd, seed):
        return {"high": [100.0 + mean, 100.0], "low": [mean, 0.0]}

    system, data = describe(observe, PARAMETERS, {"vectorized": False})
    assert system.signals == ("low", "high")
    simulate = per_model(run_one, PARAMETERS)
    for genuine in (data, observe):
        with system.open(Arguments(genuine, simulate)) as opened:
            samples = collect(opened)
            seen = samples.genuine + system.center
            counterfeit = samples.counterfeit + system.center
        np.testing.assert_array_equal(seen[0], [[1, 101], [2, 102]])
        assert (counterfeit[..., 0] < 50).all()
        assert (counterfeit[..., 1] >= 100).all()
    message = "have the columns low, high; got low"
    opened = system.open(Arguments(observe, simulate))
    with opened, pytest.raises(CustomSystemError, match=message):
        collect(opened)


def test_a_column_that_the_other_side_lacks_is_refused_at_the_first_call():
    genuine = [{"in": np.ones(6), "inflow": np.ones(6)} for _ in range(3)]
    simulate = per_model(flows, PARAMETERS)
    message = (
        r"must have the columns in, inflow; got in, out \[what the simulator returns or prints\]"
        r"\. Rename inflow, out, or choose columns .* with columns= or --simulate-columns"
    )
    with pytest.raises(CustomSystemError, match=message):
        tl.infer(genuine=genuine, simulate=simulate, parameters=PARAMETERS, trials=60)
    simulate = per_model(flows, PARAMETERS, columns=["out"])
    message = r"`genuine` must have the columns out; got in, inflow \[sample 0\]"
    with pytest.raises(ValueError, match=message):
        tl.infer(genuine=genuine, simulate=simulate, parameters=PARAMETERS, trials=60)


PROGRAM = """
import random, sys
mean, sd, seed = float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
draw = random.Random(seed)
if mean > 9.99:
    sys.exit("no such mean")
print("step,value")
for step in range(10):
    print(f"{step},{draw.gauss(mean, sd)}")
"""


@pytest.fixture
def program(tmp_path):
    (tmp_path / "walk.py").write_text(PROGRAM)
    return f"{sys.executable} {tmp_path / 'walk.py'} {{mean}} {{sd}} {{seed}}"


def test_a_program_is_a_simulator(program):
    simulate = Command(program, ("mean", "sd"), ("value",))
    one, again = (simulate(np.array([5.0, 1.0]), np.random.default_rng(seed)) for seed in (1, 1))
    assert one.shape == (10, 1)
    np.testing.assert_array_equal(one, again)
    with pytest.raises(RuntimeError, match="ended with exit status 1: no such mean"):
        simulate(np.array([10.0, 1.0]), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("template", "message"),
    [
        (
            "prog {mean}",
            r"must hold \{sd\}, where the value of the parameter goes.*For example: prog \{mean\} \{sd\} \{seed\}",
        ),
        ("prog {mean} {sd} {speed}", "must hold no other names in braces .*; got speed"),
    ],
)
def test_a_command_names_all_parameters_and_no_others(template, message):
    with pytest.raises(ValueError, match=message):
        Command(template, ("mean", "sd"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must have a line of names and rows below; got 0 lines"),
        ("a,b\n1\n", r"must have 2 cells in each row; got 1 \[line 2\]"),
        ("a,b\n1,x\n", r"must hold numbers; got 'x' \[line 2, column b\]"),
    ],
)
def test_output_that_is_no_table_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        read_table(text)


def test_a_program_of_whole_numbers_says_how_to_ask_for_them():
    command = f"{sys.executable} -I -S -c 'import sys; int(sys.argv[1])' {{n_seeds}} {{seed}}"
    message = r"If it takes a whole number: --range n_seeds=1:30:integer, or in Python Parameter"
    with pytest.raises(CustomSystemError, match=message):
        tl.infer(
            genuine=[{"x": np.ones(3)}] * 3,
            simulate=Command(command, ("n_seeds",)),
            parameters={"n_seeds": (1.0, 30.0)},
            trials=60,
        )


def test_a_prior_is_refused_with_the_reason():
    from scipy.stats import norm

    message = r"not a distribution; got .*\['mean'\]\. Classifiers judge models, and no prior enters the search: give two bounds"
    with pytest.raises(ValueError, match=message):
        tl.systems.read_parameters({"mean": norm(5, 1)})
    with pytest.raises(
        ValueError, match=r"`prior` must be left out; .* no prior enters the search"
    ):
        tl.infer(genuine=np.ones((3, 5, 1)), simulate=noise_of_one, prior={"mean": norm(5, 1)})


def test_a_client_of_dask_yields_what_this_process_yields():
    distributed = pytest.importorskip("distributed")
    options = {
        "n_workers": 2,
        "threads_per_worker": 1,
        "processes": False,
        "dashboard_address": ":0",
    }
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        there = by(client.get_executor(pure=False), noise_of_one, batches=0)
        with source(noise_of_one, batches=0) as here:
            np.testing.assert_array_equal(collect(here).counterfeit, collect(there).counterfeit)
