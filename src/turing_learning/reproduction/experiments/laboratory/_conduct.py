"""Section 5: robots in the loop, in a laboratory that is emulated."""

from dataclasses import dataclass, field

import numpy as np

from turing_learning.reproduction._claims import load_claims
from turing_learning.reproduction._experiment import Experiment, Findings
from turing_learning.reproduction._work import Work

from ._accuracy import RandomModelSizes, laboratory_accuracies
from ._runs import LaboratoryRunSizes, emulated_runs, simulated_runs
from ._tables import (
    EMULATED,
    SIMULATED,
    accuracy_picture,
    accuracy_table,
    dynamics_table,
    errors_table,
    gathering_table,
    models_table,
    run_pictures,
    validation_pictures,
)
from ._validation import ValidationSizes, validate
from ._verdicts import (
    CLASSIFIERS,
    DYNAMICS,
    ERRORS,
    VALIDATION,
    classifiers_verdict,
    dynamics_verdict,
    errors_verdict,
    validation_verdict,
)


@dataclass(frozen=True)
class LaboratorySizes:
    """Which runs, which trials of many robots, and how many random models."""

    runs: LaboratoryRunSizes = field(default_factory=LaboratoryRunSizes)
    validation: ValidationSizes = field(default_factory=ValidationSizes)
    random_models: RandomModelSizes = field(default_factory=RandomModelSizes)


def conduct(work: Work) -> Findings:
    """Conduct the runs in the emulated laboratory and in simulation; validate the median model; judge random models."""
    from turing_learning.robots import LABORATORY

    sizes: LaboratorySizes = work.sizes
    truth, names = np.array(LABORATORY.controller), LABORATORY.parameter_names
    claims = load_claims()
    emulated = emulated_runs(work)
    outcomes = {
        EMULATED: emulated,
        SIMULATED: simulated_runs(work, "default"),
        f"{SIMULATED}, preset paper": simulated_runs(work, "paper"),
    }
    validation = validate(work, np.median(emulated.best, axis=0))
    best = laboratory_accuracies(work, emulated)
    verdicts = [
        *(
            errors_verdict(runs, truth, names, claims, "" if kind == EMULATED else kind)
            for kind, runs in outcomes.items()
        ),
        dynamics_verdict(emulated, outcomes[SIMULATED], truth, names),
        validation_verdict(validation),
        classifiers_verdict(best),
    ]
    tables = [
        errors_table(outcomes, truth, names, dict(claims[ERRORS].values)),
        models_table(outcomes, sizes.runs.seeds, names),
        dynamics_table(outcomes, truth, names),
        gathering_table(validation),
        accuracy_table(best),
    ]
    pictures = [
        *run_pictures(outcomes, truth, names),
        *validation_pictures(validation, sizes.validation),
        accuracy_picture(best, sizes.random_models.models),
    ]
    return Findings(verdicts, tables, pictures)


EXPERIMENT = Experiment(
    id="5",
    title="Robots in the loop, in an emulated laboratory",
    cost="about 2 hours",
    claims=(ERRORS, DYNAMICS, VALIDATION, CLASSIFIERS),
    deviations=(
        "There are no physical robots: the laboratory is emulated. Program, protocol and tracker are those of a laboratory; robots "
        "move as the simulated swarm does, and images are rendered. What else is emulated, and what is not, is listed in "
        "docs/robots/arena.md. A verdict says that the emulation is not worse than the paper's robots, not that other robots "
        "would be. "
        "What is printed about the robots themselves, the bias of vl0 to -0.65, 18 s for a loop and 5 hours for a run, is not "
        "judged.",
        "Dispersal and avoidance of walls are described in a supplement that we have not seen; the rules are ours.",
        "The settings are those of the default preset without jumps (decision 0025). Simulated runs with the preset `paper`, which "
        "keeps to the text, stand beside them.",
        "What the paper calls simulated runs with the same setup is done here in the same arena, with walls that only stop robots, "
        "from places drawn uniformly, without dispersal and infrared sensors.",
        "The 40 robots begin at places drawn uniformly, without touching; they avoid walls as in a trial of a run, and are located "
        "by the camera every 2 s.",
        "Each of the 100 random models has one trial with 8 agents beside it and another model; all agents' samples count.",
        "Seeds 5001 to 5010, which nothing has been tuned on.",
    ),
    full=LaboratorySizes(),
    fast=LaboratorySizes(
        runs=LaboratoryRunSizes(
            runs=1,
            generations=2,
            repeats=1,
            kept=(0, 1),
            settings={"models.population": 2, "classifiers.population": 10},
        ),
        validation=ValidationSizes(robots=12, trials=2, duration_s=8.0, every_s=4.0, shown_s=(0, 4, 8)),
        random_models=RandomModelSizes(models=4),
    ),
    conduct=conduct,
    packages=("cv2", "serial"),
    extra="robot,vision",
)
