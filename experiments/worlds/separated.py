"""Why are errors smaller where replicas are separated from agents (section 4.6.3)? ``python separated.py FIRST LAST [FORM]``.

Separated, classifiers see other agents, other replicas, and eleven samples of each model instead of one. Two forms
between change one of these at a time: "one of a group" is separated, but a single replica of each group is judged;
"agents alone" has genuine samples from groups of agents, and that of the replica from a group of agents and it.
Preset `paper`, world `paper`, 1000 generations, seeds FIRST to LAST. A row of separated.csv is a run: errors of the
subjectively best model of the last generation, and of the estimate. Runs of the forms "mixed" and "separated" are
those of experiments/as-printed/4.6.3. Without arguments mean errors of all four are printed, and Mann-Whitney tests
against both. A run takes half a minute of a processor. One that has its row is not repeated.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import mannwhitneyu

from turing_learning.coevolution import Samples
from turing_learning.config import Configuration, load_configuration
from turing_learning.runs import Run
from turing_learning.swarm import AGGREGATION, MixedSwarm, Scenario, SeparatedSwarm, Trials, alone
from turing_learning.systems import Source

HERE = Path(__file__).parent
TABLE = HERE / "separated.csv"
STORED = HERE.parent / "as-printed" / "4.6.3" / "tables" / "paper-models.csv"
NAMES = AGGREGATION.parameter_names
MODELS = ("best_model", "estimate")


class OneOfGroup(Source):
    """Separated groups; of the replicas of a model only the first is judged."""

    cheap = True
    fallible = False

    def __init__(self, configuration: Configuration) -> None:
        self.system = configuration.system
        self._groups = SeparatedSwarm(configuration.swarm, 1)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (M x individuals, T, 2) and counterfeit samples (M, 1, T, 2) of models (M, P)."""
        samples = self._groups.collect(models, rng)
        return Samples(samples.genuine, samples.counterfeit[:, :1])


class AgentsAlone(OneOfGroup):
    """Replicas among agents; genuine samples are from other groups, of agents alone."""

    def __init__(self, configuration: Configuration) -> None:
        super().__init__(configuration)
        self._scenario: Scenario = configuration.swarm
        self._mixed = MixedSwarm(configuration.swarm, 1)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (M x individuals, T, 2) and counterfeit samples (M, 1, T, 2) of models (M, P)."""
        agents = Trials.draw(self._scenario, alone(self._scenario, len(models)), rng)
        genuine = np.concatenate(agents.observe(None, 1))
        return Samples(genuine, self._mixed.collect(models, rng).counterfeit)


FORMS = {"one of a group": OneOfGroup, "agents alone": AgentsAlone}


def row(form: str, seed: int) -> dict[str, object]:
    """Return the row of a run."""
    settings = {"scenario.world": "paper", "run.seed": seed, "run.threads": 1}
    configuration = load_configuration(None, "paper", settings, scenario=AGGREGATION.name)
    source = FORMS[form](configuration)
    run = Run.begin(configuration, source=source)
    with run:
        for _ in run:
            pass
    result = run.result
    found: dict[str, object] = {"form": form, "seed": seed}
    for kind in MODELS:
        values = getattr(result, kind)
        for name, truth in zip(NAMES, AGGREGATION.controller, strict=True):
            found[f"{kind} {name}"] = round(abs(values[name] - truth), 6)
    return found


def stored() -> pd.DataFrame:
    """Return the rows of the runs with mixed and with separated groups."""
    table = pd.read_csv(STORED)
    rows = []
    for (form, seed), runs in table.groupby(["grouping", "seed"]):
        found: dict[str, object] = {"form": form, "seed": seed}
        for kind, models in runs.set_index("model").iterrows():
            for name, truth in zip(NAMES, AGGREGATION.controller, strict=True):
                found[f"{kind} {name}"] = abs(models[name] - truth)
        rows.append(found)
    return pd.DataFrame(rows)


def summary() -> None:
    """Print median errors, their means over the parameters, and p-values against mixed and separated groups."""
    table = pd.concat([stored(), pd.read_csv(TABLE)])
    for kind in MODELS:
        columns = [f"{kind} {name}" for name in NAMES]
        by_form = {form: runs[columns].to_numpy() for form, runs in table.groupby("form")}
        for form, errors in by_form.items():
            line = f"{kind}, {form}, {len(errors)} runs: means {errors.mean(axis=0).round(3)}, "
            line += f"median of their means {np.median(errors.mean(axis=1)):.4f}"
            for other in ("mixed", "separated"):
                one_by_one = mannwhitneyu(errors, by_form[other]).pvalue
                together = mannwhitneyu(errors.mean(axis=1), by_form[other].mean(axis=1)).pvalue
                line += f"; p against {other} {one_by_one.round(4)}, of the means {together:.2g}"
            sys.stdout.write(line + "\n")


def main(first: int, last: int, *forms: str) -> None:
    """Execute the runs that the table lacks."""
    done = set()
    if TABLE.exists():
        done = set(pd.read_csv(TABLE)[["form", "seed"]].itertuples(index=False, name=None))
    for seed in range(first, last + 1):
        for form in forms or FORMS:
            if (form, seed) in done:
                continue
            line = pd.DataFrame([row(form, seed)])
            line.to_csv(TABLE, mode="a", header=not TABLE.exists(), index=False)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:])
    else:
        summary()
