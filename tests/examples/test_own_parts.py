"""The parts of docs/your-own-parts.md: run, stored, resumed, checked and detected with, as the built-in ones are."""

import re
import sys
import types
from pathlib import Path

import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError, load_configuration
from turing_learning.detection import run_classifiers
from turing_learning.identifiability import Effort
from turing_learning.runs import RunFolderError

PAGE = Path(__file__).parents[2] / "docs" / "your-own-parts.md"
SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.checkpoint_every": 2,
    "run.threads": 1,
}
QUICK = Effort(samples=20, points=0)


@pytest.fixture(scope="module")
def parts():
    """The module of the page."""
    module = types.ModuleType("parts")
    module.__dict__["__name__"] = "parts"
    found = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[1]
    exec(found, module.__dict__)  # noqa: S102
    sys.modules["parts"] = module
    yield module
    del sys.modules["parts"]


def infer(out=None, **options):
    return tl.infer("aggregation", generations=6, seed=2, settings=SMALL, out=out, **options)


@pytest.fixture(scope="module")
def whole(parts, tmp_path_factory):
    return infer(
        tmp_path_factory.mktemp("parts") / "run",
        models=parts.RandomSearch,
        classifier=parts.Perceptron,
    )


def stopped():
    answers = iter([False, False])
    return lambda: next(answers, True)


def test_both_can_be_imported_and_leave_all_that_a_run_leaves(whole, parts):
    configuration = whole.configuration
    assert (configuration.models.optimizer, configuration.classifiers.network) == (
        "parts:RandomSearch",
        "parts:Perceptron",
    )
    assert whole.history["classifier"].shape == (6, 8, 5)
    assert (whole.path / "report.html").exists()
    found = tl.load_run(whole.path).check(effort=QUICK, recoveries=1)
    assert found.recoveries[0].truth == whole.estimate
    learned = run_classifiers(tl.load_run(whole.path))
    assert isinstance(learned.classifier, parts.Perceptron)
    assert learned.last.shape == (8, 5)


def test_a_file_names_them(whole, parts, tmp_path):
    path = tmp_path / "c.toml"
    names = 'models.optimizer = "parts:RandomSearch"\nclassifiers.network = "parts:Perceptron"\n'
    path.write_text(f'scenario = "aggregation"\n{names}')
    assert tl.infer(config=path, generations=6, seed=2, settings=SMALL).estimate == whole.estimate


def test_a_stopped_run_imports_them_and_ends_as_one_that_never_stopped(whole, parts, tmp_path):
    infer(
        tmp_path / "run",
        models="parts:RandomSearch",
        classifier="parts:Perceptron",
        should_stop=stopped(),
    )
    assert tl.resume(tmp_path / "run").estimate == whole.estimate


def test_objects_are_given_again(whole, parts, tmp_path, monkeypatch):
    def made():
        scale = whole.configuration.input_scale
        optimizer = parts.RandomSearch(4, size=8, seed=(1, 2), initial_low=-1, initial_high=1)
        return {"models": optimizer, "classifier": parts.Perceptron(inputs=2, scale=scale)}

    never = infer(**made())
    infer(tmp_path / "run", **made(), should_stop=stopped())
    monkeypatch.setattr("turing_learning.config.parts._objects", {})  # as in another process
    with pytest.raises(
        RunFolderError, match=r"must be given again, as no folder holds an object"
    ) as refused:
        tl.resume(tmp_path / "run")
    assert str(tmp_path / "run") in str(refused.value)
    result = tl.resume(tmp_path / "run", **made())
    assert result.estimate == never.estimate
    monkeypatch.setattr("turing_learning.config.parts._objects", {})
    with pytest.raises(ConfigurationError, match="`classifier` must be given again"):
        run_classifiers(tl.load_run(tmp_path / "run"))
    assert run_classifiers(
        tl.load_run(tmp_path / "run", classifier=made()["classifier"])
    ).last.shape == (8, 5)


def test_two_objects_of_one_name_stay_apart(parts):
    one, other = (parts.Perceptron(inputs=2, scale=(1.0, scale)) for scale in (1.0, 2.0))
    results = [
        infer(classifier=each)
        for each in (one, other, parts.Perceptron(inputs=2, scale=(1.0, 1.0)))
    ]
    names = [run.configuration.classifiers.network for run in results]
    assert all(name.startswith("given:Perceptron") for name in names)
    assert names[0] == names[2] != names[1]
    assert results[0].estimate == results[2].estimate != results[1].estimate


def test_cma_is_built_in(tmp_path):
    pytest.importorskip("cma")
    infer(tmp_path / "run", models="cma", should_stop=stopped())
    assert tl.resume(tmp_path / "run").estimate == infer(models="cma").estimate


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"models": "cmaes"},
            "`models.optimizer` must be evolution-strategy, cma, or module:function; got 'cmaes'",
        ),
        ({"models": "parts:Nothing"}, '`models` must be "module:function"'),
        (
            {"models": 5},
            "`models` must have the methods and properties of an `Optimizer`|not callable",
        ),
        ({"classifier": 5}, "`classifier` must have `parameters` and `judge`"),
        (
            {"models": print},
            "`models` must be a function that takes a dimension, size, seed, initial_low, initial_high",
        ),
        ({"models": int}, "`models` must be a function that takes a dimension"),
        (
            {"classifier": print},
            "`classifier` must be a function that takes inputs, scale; got <built-in function",
        ),
        (
            {"models": lambda dimension, **given: None},
            "`models` must have the methods and properties of an `Optimizer`",
        ),
        (
            {"classifier": "elmann"},
            "`classifiers.network` must be elman, or module:function; got 'elmann'",
        ),
    ],
)
def test_what_is_no_part_is_rejected_before_anything_is_written(parts, tmp_path, options, message):
    with pytest.raises(ConfigurationError, match=message):
        infer(tmp_path / "run", **options)
    assert not (tmp_path / "run").exists()


def test_an_optimizer_of_another_size_is_rejected(parts):
    optimizer = parts.RandomSearch(4, size=6, seed=1, initial_low=-1, initial_high=1)
    with pytest.raises(
        ConfigurationError, match="`models` must have 8 candidates of 4 parameters; got 6 of 4"
    ):
        infer(models=optimizer)


@pytest.mark.parametrize(
    ("method", "returned", "message"),
    [
        (
            "tell",
            None,
            r"`models.tell\(\)` must be an array of numbers|`models.tell\(\)` must be of shape",
        ),
        ("tell", [1.0], r"`models.tell\(\)` must be of shape \(M,\) = \(8,\); got \(1,\)"),
        (
            "ask",
            [[0.0] * 3] * 8,
            r"`models.ask\(\)` must be of shape \(M, P\) = \(8, 4\); got \(8, 3\)",
        ),
        ("ask", [[float("nan")] * 4] * 8, r"`models.ask\(\)` must be finite"),
    ],
)
def test_an_optimizer_that_returns_something_else_is_named(parts, method, returned, message):
    broken = type("Broken", (parts.RandomSearch,), {method: lambda self, *given: returned})
    with pytest.raises(ConfigurationError, match=message):
        infer(models=broken)


def test_a_study_takes_names_alone(parts):
    from turing_learning.config.settings import load_variants

    named = load_configuration(
        scenario="aggregation", overrides={"models.optimizer": "parts:RandomSearch"}
    )
    assert named.given == ()
    with pytest.raises(
        ConfigurationError, match="`classifier` must be a name that a worker can import"
    ):
        load_variants(overrides={"classifiers.network": "given:Perceptron"}, scenario="aggregation")
