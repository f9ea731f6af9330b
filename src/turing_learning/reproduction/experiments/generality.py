"""Section 4.6: other morphologies, black-box models, separated groups, and random behaviors."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import compare, dynamic_outputs, response_error
from turing_learning.analysis._errors import DYNAMIC_READINGS as READINGS
from turing_learning.analysis._errors import median_place
from turing_learning.figures import box_figure
from turing_learning.figures._many_runs import (
    box_panels_figure,
    dynamic_outputs_figure,
    error_box_figure,
    error_histogram_figure,
)
from turing_learning.models import ElmanModel
from turing_learning.swarm import AGGREGATION, AGGREGATION_VIEW_0, AGGREGATION_VIEW_60

from .._experiment import (
    KINDS,
    PRESETS,
    Captions,
    Experiment,
    Findings,
    Runs,
    RunSizes,
    ShareSizes,
    Work,
    compare_columns,
    seeded,
    sensor_shares,
    small,
    spreads_frame,
    stacked,
    values_of,
    variant_of,
)
from .._verdicts import (
    PAPER_RUNS,
    PRINTED,
    REASONS,
    ClaimVerdict,
    errors_verdict,
    listed,
    load_claims,
    not_worse,
    printed_spreads,
    shares_not_worse,
    spreads_of,
    valued,
)

FIELDS_OF_VIEW = {"4.6.1-morphology-0": AGGREGATION_VIEW_0, "4.6.1-morphology-60": AGGREGATION_VIEW_60}
"""Claim -> scenario."""
OFF = 0.1  # mean absolute error above which a run is off


@dataclass(frozen=True)
class MorphologySizes:
    """How many runs, `beside` of them with the preset that stands beside the verdict, and generations."""

    runs: int = 30
    beside: int = 10
    generations: int = 1000
    first_seed: int = 2001
    presets: tuple[str, ...] = PRESETS
    settings: Mapping[str, Any] = field(default_factory=dict)


def conduct_morphology(work: Work) -> Findings:
    """Conduct a study for each field of view and preset."""
    sizes: MorphologySizes = work.sizes
    captions, verdicts, errors, tables, pictures = Captions("4.6.1"), [], {}, [], []
    for preset in sizes.presets:
        for claim, scenario in FIELDS_OF_VIEW.items():
            number = sizes.runs if preset == PRESETS[0] else sizes.beside
            result = work.runs(f"study-{scenario.name}-{preset}", scenario.name, preset, runs=number)
            runs = Runs.of(result, preset, scenario.parameter_names)
            verdicts += [morphology_verdict(claim, runs, kind) for kind in KINDS]
            errors[scenario.name, preset] = runs.errors_frame(claim)
            words = {"scenario": scenario, "preset": preset, "runs": number}
            tables.append(captions.table("{scenario.name}-{preset}-models", runs.models_frame(), **words))
            figure = box_figure(runs.models["best_model"], names=scenario.parameter_labels, truth=scenario.truth)
            pictures.append(captions.picture("{scenario.name}-{preset}-boxes", claim, figure, **words))
    summary = captions.table("absolute-errors", stacked(errors, "scenario", "preset"))
    return Findings(verdicts, [summary, *tables], pictures)


def morphology_verdict(claim: str, runs: Runs, kind: str) -> ClaimVerdict:
    """Hold the errors against a claim; name the runs that are off, which a mean hides, and those that mistook a reading."""
    names, truth, errors = (
        FIELDS_OF_VIEW[claim].parameter_labels,
        np.array(FIELDS_OF_VIEW[claim].controller),
        runs.errors[kind],
    )

    def seeds(chosen: np.ndarray) -> str:
        return ", ".join(str(runs.seeds[k]) for k in np.flatnonzero(chosen))

    off = runs.maes(kind) > OFF
    text = f"; the mean error is at most {OFF} in every run"
    if off.any():
        text = f"; the mean error exceeds {OFF} in {np.count_nonzero(off)} of {len(off)} runs (seeds {seeds(off)})"
        if not off.all():
            text += f", without them {listed(names, spreads_of(errors[~off]))}"
    speeds = runs.models[kind][:, : len(truth)]
    mirrored = np.abs(speeds - np.roll(truth, 2)).sum(axis=1) < np.abs(speeds - truth).sum(axis=1)
    strayed = {"mirrored": off & mirrored, "strayed": off & ~mirrored & (errors[:, -1] > math.pi / 2)}
    reasons = [
        f"{REASONS[f'4.6.1-{what}']} (seeds {seeds(chosen)})" for what, chosen in strayed.items() if chosen.any()
    ]
    reason = f"{'; '.join(reasons)}; docs/decisions/0016" if reasons else ""
    return errors_verdict(claim, errors, names, variant_of(runs.preset, kind), observed_also=text, reason=reason)


MORPHOLOGY = Experiment.of(
    "4.6.1",
    conduct_morphology,
    full=MorphologySizes(),
    fast=MorphologySizes(runs=2, beside=2, generations=6, settings=small(6, 6)),
)


NETWORKS = "4.6.2-black-box"
NEAR = 0.1
QUICK = 3  # steps after a change of the reading in which the outputs are to be near their steady values
PRINTED_ASTRAY = {5: 2}  # hidden neurons -> outliers that the caption of figure 11 names, of `PAPER_RUNS`
TRUTH, NAMES = np.array(AGGREGATION.controller), AGGREGATION.parameter_names


@dataclass(frozen=True)
class BlackBoxSizes(RunSizes):
    """How many runs and generations, for networks of which sizes."""

    hidden: tuple[int, ...] = (1, 3, 5)
    presets: tuple[str, ...] = PRESETS
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class NetworkRuns:
    """What runs with networks of one size have inferred."""

    runs: Runs  # whose "models" are the steady outputs of the networks
    model: ElmanModel
    networks: np.ndarray  # (R, Q), weights of the subjectively best models

    @property
    def title(self) -> str:
        """The size in words."""
        neurons = {1: "One", 3: "Three", 5: "Five"}.get(self.model.hidden, str(self.model.hidden))
        return f"{neurons} hidden neuron{'s' if self.model.hidden > 1 else ''}"

    @property
    def performance(self) -> np.ndarray:
        """The paper's metric of each network (R,)."""
        return response_error(self.model, self.networks, TRUTH)

    @property
    def dynamics(self) -> np.ndarray:
        """Outputs (T, 2) of the network of median performance."""
        return dynamic_outputs(self.model, self.networks[median_place(self.performance)])

    @property
    def near(self) -> bool:
        """Whether the median of every steady output is near the truth."""
        return bool((np.abs(np.median(self.runs.models["best_model"], axis=0) - TRUTH) <= NEAR).all())

    @property
    def astray(self) -> int:
        """Number of runs with an output far from the truth."""
        return int(np.count_nonzero(self.runs.errors["best_model"].max(axis=1) > 2 * NEAR))

    @property
    def few_astray(self) -> bool:
        """Whether the share of the others does not fall short of the printed one."""
        runs, printed = len(self.runs), PRINTED_ASTRAY.get(self.model.hidden, 0)
        return shares_not_worse(1 - self.astray / runs, runs, 1 - printed / PAPER_RUNS, PAPER_RUNS)


def conduct_black_box(work: Work) -> Findings:
    """Conduct the studies, and look at what the networks do."""
    sizes: BlackBoxSizes = work.sizes
    captions, verdicts, pictures = Captions("4.6.2"), [], []
    errors, steady, dynamic = {}, {}, {}
    for preset in sizes.presets:
        outcomes = []
        for hidden in sizes.hidden:
            settings = {"models.hidden": hidden}
            result = work.runs(f"study-{hidden}-hidden-{preset}", AGGREGATION.name, preset, settings=settings)
            found = [run.result["networks"]["best_model"] for run in result.runs if run.result is not None]
            model, networks = ElmanModel(AGGREGATION.sensor.states, hidden), [list(one.values()) for one in found]
            outcomes.append(NetworkRuns(Runs.of(result, preset, NAMES), model, np.array(networks)))
        verdicts.append(black_box_verdict(outcomes))
        for one in outcomes:
            key, runs = (preset, one.model.hidden), one.runs
            frame = runs.errors_frame()
            frame.insert(3, "median_output", np.ravel([np.median(outputs, axis=0) for outputs in runs.models.values()]))
            errors[*key, len(one.model.parameter_names)] = frame
            median = np.arange(len(runs)) == median_place(one.performance)
            steady[key] = frame = seeded(runs.seeds, runs.models["best_model"], NAMES)
            frame.insert(1, "metric", one.performance)
            frame.insert(2, "is_median", median)
            moments = pd.DataFrame({"step": np.arange(1, len(READINGS) + 1), "reading": READINGS})
            dynamic[key] = moments.join(pd.DataFrame(one.dynamics, columns=["left", "right"]))
        titles, words = [one.title for one in outcomes], {"preset": preset, "runs": len(outcomes[0].runs)}
        look: dict[str, Any] = {"titles": titles, "names": NAMES, "truth": TRUTH, "what": "Steady output"}
        boxes = box_panels_figure([one.runs.models["best_model"] for one in outcomes], **look)
        truth, dynamics = TRUTH.reshape(-1, 2)[READINGS], [one.dynamics for one in outcomes]
        curves = dynamic_outputs_figure(dynamics, readings=READINGS, titles=titles, truth=truth)
        pictures += [
            captions.picture("{preset}-steady-outputs", NETWORKS, boxes, **words),
            captions.picture("{preset}-dynamic-outputs", NETWORKS, curves, **words),
        ]
    tables = [
        captions.table("absolute-errors", stacked(errors, "preset", "hidden", "weights")),
        captions.table("steady-outputs", stacked(steady, "preset", "hidden")),
        captions.table("dynamic-outputs", stacked(dynamic, "preset", "hidden")),
    ]
    return Findings(verdicts, tables, pictures)


def settling(outputs: np.ndarray, readings: np.ndarray = READINGS) -> int:
    """Return in which step after a change of the reading, from 1, the outputs (T, 2) are near where they end, to stay."""
    begins = np.flatnonzero(np.diff(readings, prepend=readings[0] - 1))
    slowest = 1
    for phase in np.split(outputs, begins[1:]):
        astray = np.flatnonzero((np.abs(phase - phase[-1]) > NEAR).any(axis=1))
        slowest = max(slowest, int(astray[-1]) + 2 if astray.size else 1)
    return slowest


def black_box_verdict(outcomes: Sequence[NetworkRuns]) -> ClaimVerdict:
    """Hold networks of all sizes against the claim."""
    settled = [settling(outcome.dynamics) for outcome in outcomes]
    texts = []
    for one, step in zip(outcomes, settled, strict=True):
        medians = valued(NAMES, np.median(one.runs.models["best_model"], axis=0))
        texts.append(
            f"{one.model.hidden} hidden: medians {medians}; median MAE {np.median(one.runs.maes('best_model')):.3f}, an output "
            f"off by more than {2 * NEAR:g} in {one.astray} of {len(one.runs)} runs; settled in step {step}"
        )
    return ClaimVerdict(
        NETWORKS,
        all(one.near and one.few_astray for one in outcomes) and max(settled) <= QUICK,
        PRINTED[NETWORKS],
        ". ".join(texts),
        "black box",
        variant_of(outcomes[0].runs.preset),
    )


BLACK_BOX = Experiment.of(
    "4.6.2", conduct_black_box, full=BlackBoxSizes(),
    fast=BlackBoxSizes(runs=2, generations=8, hidden=(1, 3), presets=PRESETS[:1], settings=small(8, 8)),
)  # fmt: skip


SEPARATED_SWARMS = "4.6.3-separated"
GROUPINGS = ("mixed", "separated")


@dataclass(frozen=True)
class SeparatedSizes(RunSizes):
    """How many runs and generations, with mixed and with separated groups."""

    presets: tuple[str, ...] = PRESETS
    settings: Mapping[str, Any] = field(default_factory=dict)


def conduct_separated(work: Work) -> Findings:
    """Conduct the studies, and test whether their errors differ."""
    sizes: SeparatedSizes = work.sizes
    captions, verdicts, errors, tables, pictures = Captions("4.6.3"), [], {}, [], []
    for preset in sizes.presets:
        both = {}
        for grouping in GROUPINGS:
            settings = {"scenario.grouping": grouping}
            result = work.runs(f"study-{grouping}-{preset}", AGGREGATION.name, preset, settings=settings)
            both[grouping] = Runs.of(result, preset, NAMES)
        for kind in KINDS:
            verdicts.append(separated_verdict(both, kind))
            frame = pd.DataFrame({"parameter": NAMES, "runs": sizes.runs})
            for name, runs in both.items():
                spreads = spreads_of(runs.errors[kind])
                frame = frame.join(spreads_frame(spreads, f"{name}_mean", f"{name}_standard_deviation"))
            tests = compare_columns(*(runs.errors[kind] for runs in both.values()))
            errors[preset, kind] = frame.assign(p_value=tests.p_values, significant=tests.significant)
        models = stacked({name: runs.models_frame() for name, runs in both.items()}, "grouping")
        tables.append(captions.table("{preset}-models", models, preset=preset))
        look: dict[str, Any] = {"titles": ("Mixed", "Separated"), "names": NAMES, "truth": AGGREGATION.controller}
        figure = box_panels_figure([runs.models["best_model"] for runs in both.values()], **look)
        pictures.append(captions.picture("{preset}-boxes", SEPARATED_SWARMS, figure, preset=preset, runs=sizes.runs))
    summary = captions.table("absolute-errors", stacked(errors, "preset", "model"))
    return Findings(verdicts, [summary, *tables], pictures)


def separated_verdict(both: Mapping[str, Runs], kind: str) -> ClaimVerdict:
    """Test whether the errors of mixed and of separated runs differ, parameter by parameter."""
    tests = compare_columns(*(both[grouping].errors[kind] for grouping in GROUPINGS))
    texts = "; ".join(f"{name}: {listed(NAMES, spreads_of(runs.errors[kind]))}" for name, runs in both.items())
    agrees, observed = not tests.significant.any(), f"{texts}; p: {valued(NAMES, tests.p_values, '.2g')}"
    variant = variant_of(both["mixed"].preset, kind)
    return ClaimVerdict(SEPARATED_SWARMS, agrees, PRINTED[SEPARATED_SWARMS], observed, "separated", variant)


SEPARATED = Experiment.of(
    "4.6.3", conduct_separated, full=SeparatedSizes(),
    fast=SeparatedSizes(runs=2, generations=8, presets=PRESETS[:1], settings=small(8, 8)),
)  # fmt: skip


RANDOM = "4.6.4-random-behaviors"
PAPER_BEHAVIORS = 1000
GOOD, FAIR = 0.05, 0.1
DRAWS = 200  # draws of few runs from many: how often do a few show what many do?


@dataclass(frozen=True)
class BehaviorSizes:
    """How many runs of each preset, and how often behaviors see another robot."""

    runs: Mapping[str, int] = field(default_factory=lambda: {"default": 200, "paper": 30})
    generations: int = 1000
    first_seed: int = 2001
    settings: Mapping[str, Any] = field(default_factory=dict)
    shares: ShareSizes = field(default_factory=ShareSizes)


def conduct_behaviors(work: Work) -> Findings:
    """Conduct runs with each preset, and see how often each behavior of the first one sees another robot."""
    from scipy.stats import binomtest

    sizes: BehaviorSizes = work.sizes
    captions, all_runs, behaviors, summary, tables, pictures = Captions("4.6.4"), [], [], {}, [], []
    for preset in PRESETS:
        result = work.runs(f"study-{preset}", "random-behaviors", preset, runs=sizes.runs[preset])
        runs, truth = Runs.of(result, preset, NAMES), values_of(result, "truth")
        all_runs.append(runs)
        behaviors.append(truth)
        for kind in KINDS:
            maes = runs.maes(kind)
            ends = binomtest(int(np.count_nonzero(maes < GOOD)), len(maes)).proportion_ci(0.95)
            shares = {"share_below_0.05": np.mean(maes < GOOD), "low": ends.low, "high": ends.high}
            row = {"runs": len(maes), **shares, "share_above_0.1": np.mean(maes > FAIR)}
            means = dict(zip(NAMES, runs.errors[kind].mean(axis=0), strict=True))
            summary[preset, kind] = pd.DataFrame([row | means])
        frame = seeded(runs.seeds, truth, NAMES)
        frame[[f"estimate_{name}" for name in NAMES]] = runs.models["estimate"]
        frame = frame.assign(best_model_mae=runs.maes("best_model"), estimate_mae=runs.maes("estimate"))
        tables.append(captions.table("{preset}-runs", frame, preset=preset))
        words = {"preset": preset, "runs": len(runs)}
        histogram = error_histogram_figure(runs.maes("best_model"), limits=(GOOD, FAIR))
        boxes = error_box_figure(list(runs.errors["best_model"].T), names=NAMES)
        pictures += [
            captions.picture("{preset}-histogram", RANDOM, histogram, **words),
            captions.picture("{preset}-errors", RANDOM, boxes, **words),
        ]

    def compute() -> dict[str, Any]:
        swarms = (replace(AGGREGATION, controller=tuple(map(float, behavior))) for behavior in behaviors[0])
        return {"shares": [float(sensor_shares(swarm, sizes.shares)[..., 1].mean()) for swarm in swarms]}

    most, sees = all_runs[0], np.array(work.piece("shares", compute)["shares"])
    frame = seeded(most.seeds, behaviors[0], NAMES)
    frame = frame.assign(estimate_mae=most.maes("estimate"), share_of_I_1=sees, rank=np.argsort(np.argsort(sees)) + 1)
    failures = frame[frame["estimate_mae"] >= GOOD]
    return Findings(
        [behaviors_verdict(runs, kind, most.errors[kind]) for runs in all_runs for kind in KINDS],
        [
            captions.table("summary", stacked(summary, "preset", "model")),
            *tables,
            captions.table("failures", failures, runs=len(sees), median=np.median(sees)),
        ],
        pictures,
    )


def behaviors_verdict(runs: Runs, kind: str, of_most: np.ndarray) -> ClaimVerdict:
    """Hold the errors against the claim; `of_most` are those (R, P) of the preset with the most runs."""
    values, maes = load_claims()[RANDOM].values, runs.maes(kind)
    printed, observed = printed_spreads(RANDOM, PAPER_BEHAVIORS), spreads_of(runs.errors[kind])
    good, bad = float(np.mean(maes < GOOD)), float(np.mean(maes > FAIR))
    printed_good, printed_bad = values["share_mae_below_0_05"], values["count_mae_above_0_1"] / PAPER_BEHAVIORS
    found = (
        not_worse(observed, printed)
        and shares_not_worse(good, len(maes), printed_good, PAPER_BEHAVIORS)
        and shares_not_worse(1 - bad, len(maes), 1 - printed_bad, PAPER_BEHAVIORS)
    )
    harder = depends_on_the_reading(runs.errors[kind])
    reason = ""
    if found and not harder and len(maes) < len(of_most):  # how often do so few runs show what is harder?
        rng, many = np.random.default_rng(1), len(of_most)
        few = [depends_on_the_reading(of_most[rng.choice(many, len(maes), replace=False)]) for _ in range(DRAWS)]
        reason = (
            f"{len(maes)} runs are few for comparing I = 0 with I = 1: of {DRAWS} draws of {len(maes)} from the {many} runs of "
            f"the default preset, {np.mean(few):.0%} show that difference"
        )
    return ClaimVerdict(
        RANDOM,
        found and harder,
        f"MAE below {GOOD} in {printed_good:.0%} of {PAPER_BEHAVIORS} runs, above {FAIR} in {printed_bad:.1%}; "
        f"{listed(NAMES, printed, 2)}; vl0 and vr0 significantly lower",
        f"MAE below {GOOD} in {good:.1%} of {len(maes)} runs, above {FAIR} in {bad:.1%}; {listed(NAMES, observed)}; "
        f"vl0 and vr0 {'' if harder else 'not '}significantly lower",
        "random behaviors",
        variant_of(runs.preset, kind),
        reason,
    )


def depends_on_the_reading(errors: np.ndarray) -> bool:
    """Return whether the errors (R, P) for I = 1 are significantly larger than those for I = 0, each against each."""
    tests = [compare(errors[:, k], [errors[:, 2], errors[:, 3]], level=0.05 / 2) for k in (0, 1)]
    medians = np.median(errors, axis=0)
    return all(test.significant.all() for test in tests) and medians[:2].max() < medians[2:].min()


BEHAVIORS = Experiment.of(
    "4.6.4", conduct_behaviors, full=BehaviorSizes(),
    fast=BehaviorSizes(
        runs={"default": 4, "paper": 3}, generations=12, settings=small(10, 12), shares=ShareSizes(trials=5)
    ),
)  # fmt: skip
