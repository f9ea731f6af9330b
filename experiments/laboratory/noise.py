"""Does the tracker's noise keep the fittest classifier of section 5 from forgetting? In plain simulation.

    python experiments/laboratory/noise.py 6101 30   # first seed, number of seeds; both presets, all noises
    python experiments/laboratory/noise.py           # prints accuracies and errors, and how often ten runs agree with the paper

Runs are those that `reproduce 5` simulates, with noise of the tracker (`scenario.tracker`), in x and y of each image
(cm) and in its heading (rad), and with robots as always or "worse" (`WORSE`). A row of noise.csv is a run: for each
of ten generations the accuracy of the subjectively and of the objectively best classifier over 100 random models, as
in figure 23 of the paper, and the errors of the model that is best when observed again. The random models are those
of `reproduce 5`; they are observed with the same noise. Ten runs are drawn from those of a row of the summary. A run
takes half a second of one core.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from generations import CONTROLLER, NAMES, PAPER, settings_of
from table import append_row

from turing_learning.analysis import decision_accuracy
from turing_learning.coevolution import THRESHOLD
from turing_learning.config import classifier_of, load_configuration
from turing_learning.purposes import ACCURACY_MODELS
from turing_learning.reproduction.experiments.laboratory import PRINTED_ACCURACY, does_not_drop
from turing_learning.robots.emulation import SimulatedLaboratory
from turing_learning.runs import Progress, simulate_laboratory

TABLE = Path(__file__).with_name("noise.csv")
KEPT = (0, 1, 2, 3, 4, 5, 10, 20, 50, 99)
MODELS = 100
MODELS_SEED = 6001
REPEATS = 5
VARIANTS = {"default": "1 2", "paper": "preset paper"}
"""Preset -> variant of generations.py: learning rates of a laboratory's runs."""
NOISES = ((0.0, 0.0), (0.1, 0.05), (0.2, 0.1), (0.4, 0.2))
"""Standard deviations (cm, rad)."""
WORSE = {
    "scenario.robot.wheel_noise": 0.2,
    "scenario.robot.wheel_scale_spread": 0.1,
    "scenario.robot.slip": 0.1,
    "scenario.sensor.mistakes": 0.05,
}
"""Robots whose wheels have four times the noise, differ by up to 10 %, and slip, and whose sensors err."""
CELLS = (*[(noise, "as always") for noise in NOISES], (NOISES[0], "worse"), (NOISES[1], "worse"))
"""Noise and robots."""
KEYS = ["preset", "noise_cm", "noise_rad", "robots"]
LATE = KEPT[-3:]
RUNS, DRAWS = 10, 20_000


def row(preset: str, noise: tuple[float, float], robots: str, seed: int) -> dict[str, object]:
    """Return the row of one run."""
    settings = settings_of(VARIANTS[preset]) | {"run.seed": seed}
    settings["scenario.controller"] = list(CONTROLLER)
    if robots == "worse":
        settings |= WORSE
    settings["scenario.tracker.position_noise_cm"] = noise[0]
    settings["scenario.tracker.heading_noise_rad"] = noise[1]
    configuration = load_configuration(None, preset, settings)
    models = np.random.default_rng((ACCURACY_MODELS, MODELS_SEED)).uniform(-1, 1, (MODELS, 4))
    laboratory = SimulatedLaboratory(configuration.swarm, MODELS_SEED)
    seen = laboratory.observe(models, "random-models")
    classifier = classifier_of(configuration)
    found: dict[str, object] = dict(zip(KEYS, (preset, *noise, robots), strict=True))
    found["seed"] = seed

    def watch(progress: Progress) -> None:
        generation = progress.generation
        assert generation is not None  # the run has generations
        if generation.number not in KEPT:
            return
        genomes = generation.classifiers
        agents = classifier.judge(genomes, seen.genuine) >= THRESHOLD
        replicas = classifier.judge(genomes, seen.counterfeit[:, 0]) >= THRESHOLD
        accuracy = decision_accuracy(agents[..., None], replicas[..., None])
        fittest = generation.classifier_fitness.argmax()
        found[f"subjective {generation.number}"] = round(float(accuracy[fittest]), 4)
        found[f"objective {generation.number}"] = round(float(accuracy.max()), 4)

    run = simulate_laboratory(configuration, REPEATS, observer=watch)
    assert run is not None  # nobody stops it
    errors = np.abs(run.best_model - CONTROLLER).round(4).tolist()
    return found | {f"error {name}": error for name, error in zip(NAMES, errors, strict=True)}


def summary() -> None:
    """Print means over the runs, and how many draws of ten runs agree with figure 23, and with the printed errors."""
    table = pd.read_csv(TABLE)
    lines = []
    for kind, runs in table.groupby(KEYS):
        rng = np.random.default_rng(0)
        subjective = runs[[f"subjective {number}" for number in KEPT]].to_numpy()
        objective = runs[f"objective {KEPT[-1]}"].to_numpy()
        errors = runs[[f"error {name}" for name in NAMES]].to_numpy()
        drawn = rng.integers(0, len(runs), (DRAWS, RUNS))
        stays = np.array([does_not_drop(subjective[ten]) for ten in drawn])
        agrees = stays & (objective[drawn].mean(axis=1) >= PRINTED_ACCURACY)
        exact = (errors[drawn].mean(axis=1) <= PAPER).all(axis=1)
        late = subjective[:, -len(LATE) :].mean(axis=1)
        line: dict[str, object] = dict(zip(KEYS, kind, strict=True))
        line |= {"runs": len(runs), "subjective": subjective.mean(axis=0).round(2)}
        line["late"] = f"{late.mean():.3f} +- {late.std(ddof=1) / len(late) ** 0.5:.3f}"
        line |= {"objective": objective.mean().round(2), "errors": errors.mean(axis=0).round(2)}
        line |= {"ten agree": agrees.mean().round(2), "ten exact": exact.mean().round(2)}
        line["both"] = (agrees & exact).mean().round(3)
        lines.append(line)
    with pd.option_context("display.width", 300):
        sys.stdout.write(pd.DataFrame(lines).to_string(index=False) + "\n")


def main(first: int, count: int) -> None:
    """Conduct the runs that the table lacks."""
    done = set()
    if TABLE.exists():
        done = set(pd.read_csv(TABLE)[[*KEYS, "seed"]].itertuples(index=False, name=None))
    for preset in VARIANTS:
        for noise, robots in CELLS:
            for seed in range(first, first + count):
                if (preset, *noise, robots, seed) not in done:
                    append_row(TABLE, row(preset, noise, robots, seed))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(int(sys.argv[1]), int(sys.argv[2]))
    else:
        summary()
