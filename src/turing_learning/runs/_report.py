"""The report of a run, its figures and its check: hand the arrays to the rooms that draw."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from shlex import quote
from types import MappingProxyType
from typing import Any

import numpy as np

from turing_learning import report as pages
from turing_learning.analysis import is_known, mean_absolute_error
from turing_learning.config import Configuration, to_toml
from turing_learning.errors import reject
from turing_learning.figures import Picture
from turing_learning.figures import one_run as one_run
from turing_learning.identifiability import Check
from turing_learning.report import Listing, Report, describe_selection, is_page, report_page
from turing_learning.report.tabular import aligned, comma_separated
from turing_learning.targets import refuse_target, writing

from ._folder import DIALOGUES, RunFolder
from ._history import SELECTION_CODES
from ._methods import CITATION, methods_text
from ._paper import SOURCE
from ._plots import distributions_of, draw_fitness, draw_parameters, recorded_replay, replay
from ._result import Result


def report(result: Result, path: str | Path | None = None, *, force: bool = False) -> Path:
    """Write the report of a run, one HTML file; `Result.report` calls it.

    Parameters
    ----------
    result
        Of the run.
    path
        Where, a name that ends with .html; None takes report.html in the run folder. A page of an
        earlier report is replaced.
    force
        Whether any other file is replaced, too.

    Raises
    ------
    ValueError
        If no path is given and the run is kept in memory, or no page may or can be written there.
    """
    if path is None and result.path is None:
        rule = "be given for a run that is kept in memory"
        reject("path", rule, path, "Name an HTML file.")
    record = result.stored()
    folder = record.folder
    manifest = record.manifest
    dialogues = record.dialogues
    if folder is not None:
        manifest = folder.manifest()
        dialogues = folder.find(DIALOGUES) or {}
    motion = record.motion(result.simulated_model)
    if path is None:
        assert folder is not None
        return write_report(
            result, folder.report_path, manifest, motion=motion, dialogues=dialogues
        )
    target = Path(path)
    refuse_target(target, name="path", suffixes=(".html",), force=force, replaceable=is_page)
    with writing(target, "path"):
        return write_report(result, target, manifest, motion=motion, dialogues=dialogues)


def _next_steps(result: Result, path: Path, infer: str) -> list[tuple[str, str]]:
    """Return commands that say more of a run in a folder, and what they answer.

    `infer` is the command that repeats it; empty if none does.
    """
    run = quote(str(path))
    steps = []
    if result.checked is None:
        tells = "Can fresh classifiers tell the model from the system? What is pinned down?"
        check = f"turing-learning check {run}"
        if RunFolder(path).needs_python(result.configuration.system):
            check = f"turing_learning.load_run({str(path)!r}).check(genuine=..., simulate=...)"
            tells += " In Python, with the samples and the simulator of the run."
        steps.append((check, tells))
    second_folder = quote(f"{path}-again")
    pool = f"turing-learning pool {run} {second_folder}"
    if infer:
        pool = f"{infer} --seed {result.seed + 1} --out {second_folder}\n{pool}"
    steps.append((pool, "Do runs with other seeds agree? Make one or more, and pool them."))
    return steps


def write_report(
    result: Result,
    target: Path,
    manifest: Mapping[str, Any],
    *,
    figures: Path | None = None,
    motion: Mapping[str, np.ndarray] = MappingProxyType({}),
    dialogues: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> Path:
    """Write the page of a run, and its figures to a folder, if there is one.

    `motion` is as of `Source.positions`.
    """
    history = result.stored().series()
    configuration = result.configuration
    simulated = result.configuration.system.simulated is not None
    pictures = draw(history, configuration, dialogues)
    if figures is not None:
        save_figures(pictures, figures)
    section = "recording in Manifest" if "recording" in manifest else "Configuration"
    again = f"see {section}, below"
    steps: list[tuple[str, str]] = []
    if result.path is not None and not result.in_laboratory:
        # Only what a command alone can repeat is printed as one
        infer = ""
        if simulated:
            infer = f"turing-learning infer --config {quote(str(result.path / 'config.toml'))}"
            again = f"{infer} --out AGAIN"
        steps = _next_steps(result, result.path, infer)
    begun = manifest.get("started", "unknown").replace("T", " ").replace("+00:00", " UTC")
    # Generations in which all models were equally fit, so that selection stood still
    words = {code: word for word, code in SELECTION_CODES.items()}
    stopped = describe_selection([words[int(code)] for code in history["selection"]])
    warning = ""
    if stopped:
        warning = f"{stopped} Many of them near the end make the result doubtful."
    checked: dict[str, Any] = {}
    if result.checked is not None:
        checked["check"] = check_listing(result.checked)
        checked["check_figures"] = draw_check(result.checked, result)
    # Simulated robots can be moved anew; others are shown as they were stored
    moving = recorded_replay(motion)
    if simulated:
        moving = replay(configuration, result.simulated_model)
    page = Report(
        title=f"{configuration.scenario.title}: what Turing Learning inferred",
        summary=summary(result),
        judgment=result.judgment,
        facts=[
            ("Seed", str(result.seed)),
            ("Begun", begun),
            ("Run again", again),
            ("Cite", CITATION),
        ],
        listings=[run_table(result)],
        data=tables(result, history, configuration),
        warning=warning,
        steps=steps,
        methods=methods_text(result, manifest),
        replay=moving,
        figures=pictures,
        configuration=to_toml(configuration),
        manifest=[(name.replace("_", " "), text) for name, text in _items_in_words(manifest)],
        **checked,
    )
    return pages.write_page(report_page(page), target)


def in_words(value: Any) -> str:
    """Return a value of a manifest for a page, also one with others in it."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {text}" for name, text in _items_in_words(value))
    if isinstance(value, list):
        return "; ".join(map(in_words, value))
    if isinstance(value, float):
        return f"{value:.2f}"
    return str(value)


def _items_in_words(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return names and values in words, but for values that nobody knows."""
    return [(name, in_words(value)) for name, value in values.items() if value is not None]


def save_figures(pictures: list[Picture], folder: Path) -> None:
    """Write every figure as PNG and SVG."""
    folder.mkdir(exist_ok=True)
    for picture in pictures:
        picture.save(folder)


def draw(
    history: Mapping[str, np.ndarray],
    configuration: Configuration,
    dialogues: Mapping[str, np.ndarray],
) -> list[Picture]:
    """Draw the figures of a run, of its history, and of what its classifiers did to the system."""
    scenario = configuration.scenario
    system = configuration.system
    trials = configuration.spent(len(history["selection"]))
    over = "generations"
    middle = "the typical one"
    models = "Subjectively best and typical model of each generation"
    fitness = "Subjective fitness of both populations: median and quartiles. Selection has stopped where it is shaded."
    if trials is not None:
        over = "trials"
        middle = "the estimate so far"
        models = "Best model of each batch of trials, and the estimate after it"
        fitness = "Fitness of the models tried in each batch, and of the classifiers: median and quartiles."
    if configuration.models.hidden:
        models += ", steady outputs of the networks"
    models += "." if scenario.truth is None else "; the truth is dashed."
    drawn = draw_parameters(history, configuration)
    pictures = [Picture("parameters", f"Parameters over {over}", models, drawn, wide=True)]
    if scenario.truth is not None:
        truth = np.asarray(scenario.truth, dtype=float)
        errors = []
        for readout in ("best_model", "typical_model"):
            models_read_out = configuration.described(history[readout])
            errors.append(mean_absolute_error(models_read_out, truth))
        caption = f"Mean over the parameters, of the best model and of {middle}."
        drawn = one_run.error_figure(*errors, trials=trials)
        pictures.append(Picture("error", f"Mean absolute error over {over}", caption, drawn))
    if dialogues:
        caption = "Classifiers only watched: one trial of the system and one of the estimate"
        # A system that acts by itself has a stimulus of its own in each trial.
        if np.array_equal(dialogues["stimuli"][:, 0], dialogues["stimuli"][:, 1]):
            caption += " under the same stimulus"
        caption += "."
        if "outputs" in dialogues:  # the classifiers chose
            caption = (
                "For each parameter the classifier, of the fittest of 50 generations, that tells the system best from "
                "models in which this parameter is drawn anew: the stimulus that it chose, and the answer, in a trial with "
                "the system and in one with the estimate. An output of 0.5 or more says genuine."
            )
        rows = tuple(system.parameters)
        interval_s = system.interval_s
        drawn = one_run.dialogues_figure(
            dialogues, names=system.dialogue_names, rows=rows, interval_s=interval_s
        )
        pictures.append(Picture("stimuli", "Stimulus and answer", caption, drawn, wide=True))
    drawn = draw_fitness(history, configuration)
    pictures.append(Picture("fitness", f"Fitness over {over}", fitness, drawn))
    if "model_step_size" in history and trials is None:
        names = scenario.parameter_names
        caption = f"Median mutation strength of each parameter{system.step_unit}"
        sizes = history["model_step_size"]
        weights = history["classifier_step_size"]
        if configuration.models.hidden:
            names = ("models",)
            caption = "Median mutation strength of the models' weights"
            sizes = sizes.reshape(len(sizes), -1, 1)
        middle_weight = np.median(weights.reshape(len(weights), -1), axis=1).astype(float)
        drawn = one_run.step_sizes_figure(np.median(sizes, axis=1), middle_weight, names=names)
        caption += ", and of the classifiers' weights."
        pictures.append(Picture("step-sizes", "Step sizes over generations", caption, drawn))
    return pictures


def summary(result: Result) -> str:
    """Say the result in one sentence, and how many simulations failed."""
    unfinished = "" if result.complete else " (the run is not complete)"
    done = f"After {result.length}{unfinished} the estimate"
    if result.estimate_mae is not None:
        return f"{done} differs from the truth by {result.estimate_mae:.4f} in the mean over all parameters."
    count = 0
    if result.failed_simulations is not None:
        count = result.failed_simulations["count"]
    failed = ""
    if count:
        failed = f" {pages.counted(count, 'simulation')} failed; result.json says which."
    return f"{done} stands; there is no truth to compare it with.{failed}"


def tables(
    result: Result, history: Mapping[str, np.ndarray], configuration: Configuration
) -> dict[str, str]:
    """Return the table of the parameters, and the models of each generation, or after so many trials, as CSV."""
    readouts = ("typical_model", "best_model")
    rows = np.hstack([configuration.described(history[name]) for name in readouts])
    spent = configuration.spent(len(rows))
    word = "trials"
    name = "trials.csv"
    if spent is None:
        spent = np.arange(len(rows))
        word = "generation"
        name = "generations.csv"
    pairs = product(readouts, configuration.scenario.parameter_names)
    models = [[word, *(f"{readout}_{parameter}" for readout, parameter in pairs)]]
    for number, values in zip(spent.tolist(), rows.tolist(), strict=True):
        models.append([str(number), *(f"{value:.7g}" for value in values)])
    return {"parameters.csv": comma_separated(result.table()), name: comma_separated(models)}


def run_table(result: Result) -> Listing:
    """Return the table inferred / true / absolute error / the paper's figure.

    Columns of which nothing is known are left out.
    """
    bounds: list[float | None] = []
    for name in result.estimate:
        bounds += result.interval[name]
    # aligned together, so that all bounds have the same number of digits
    texts = aligned(bounds)
    intervals: dict[str, str | None] = {}
    for name, low, high in zip(result.estimate, texts[::2], texts[1::2], strict=True):
        # a bound that is not known is a dash
        intervals[name] = None if "-" in (low, high) else f"{low} to {high}"
    papers = {name: f"{value:g}" for name, value in (result.paper_absolute_error or {}).items()}
    columns: list[
        tuple[str, Mapping[str, float | str | None] | None, float | None]
    ] = [  # and the mean
        ("Parameter", result.labels, None),
        ("Inferred", result.estimate, None),
        ("90 % interval", intervals, None),
        ("True", result.truth, None),
        ("Absolute error", result.estimate_absolute_error, result.estimate_mae),
        ("Paper\u2019s error", papers or None, None),
        ("Best model", result.best_model, None),
        ("Absolute error", result.absolute_error, result.mae),
    ]
    headings = []
    cells = []
    foot = []
    for heading, values, mean in columns:
        if values is not None:
            headings.append(heading)
            cells.append(list(map(values.get, result.estimate)))
            foot.append("" if mean is None else mean)
    foot[0] = "Mean"
    note = f"Paper's error: {SOURCE}, of the best model." if papers else ""
    if result.networks:
        note = "Outputs of the networks after 20 steps of each constant sensor reading."
    return Listing(
        name="result",
        heading="Inferred parameters",
        columns=headings,
        rows=list(zip(*cells, strict=True)),
        note=f"{note} {result.unknown}".strip(),
        foot=() if result.estimate_mae is None else foot,
        looks={"Inferred": "strong", "Best model": "apart"},
    )


def draw_check(check: Check, result: Result) -> list[Picture]:
    """Draw the figures of a check of a run."""
    pictures = []
    parameters = result.configuration.system.parameters
    labels = result.labels
    if check.profiles:
        caption = "Accuracy on held-out samples of fresh classifiers, trained against models in which one parameter "
        caption += f"is moved across its initial range; below the dashed line they may be guessing. {result.unknown}"
        panels = []
        for profiled in check.profiles:
            name = profiled.parameter
            interval = result.interval[name]
            panel = one_run.ParameterProfile(
                name=labels[name],
                values=np.array(profiled.values),
                accuracies=np.array(profiled.accuracies),
                criticals=np.array(profiled.criticals),
                estimate=result.estimate[name],
                interval=interval if is_known(*interval) else None,
                recovered=[recovery.estimate[name] for recovery in check.recoveries],
                logarithmic=parameters[name].scale == "log",
            )
            panels.append(panel)
        heading = "What each parameter leaves open"
        drawn = one_run.profiles_figure(panels)
        pictures.append(Picture("check-profiles", heading, caption.strip(), drawn, wide=True))
    if check.quantities:
        heading = "Genuine motion and motion simulated at the estimate"
        caption = "Shares of the values in each bin; the outermost bins hold what is beyond them."
        drawn = one_run.quantities_figure(distributions_of(check.quantities))
        pictures.append(Picture("check-quantities", heading, caption, drawn, wide=True))
    return pictures


def check_listing(check: Check) -> Listing:
    """Return what is said of each parameter, as a table."""
    forms = {"interval_share": "{:.0%}", "open_share": "at most {:.0%}", "recovery_error": "{:.1%}"}
    rows = []
    for entry in check.parameters:
        cells: list[str | None] = [entry.parameter]
        for name, form in forms.items():
            share = getattr(entry, name)
            cells.append(None if share is None else form.format(share))
        rows.append((*cells, entry.verdict))
    test = check.test
    columns = ("parameter", "interval", "left open", "missed by", "")
    note = f"{check.text} Tested on {test.genuine_samples} held-out samples in {test.genuine_groups} groups "
    note += f"({test.grouping}) and {test.counterfeit_samples} simulated ones. Shares of the initial range: width "
    note += "of the interval of the estimate, what fresh classifiers leave open where this parameter alone is moved, "
    note += "and by how much a run missed the estimate when it was the truth."
    return Listing(
        name="check", heading="Can it be believed?", columns=columns, rows=rows, note=note
    )
