"""Infer the parameters of one of Mesa's own examples, Schelling's model of segregation, from what it reports.

    pip install 'mesa>=3.1' networkx
    python examples/segregation.py

Observed are 40 runs of 10 steps: how many agents are happy, how many there are, and the share of the minority.
"""

from mesa.examples.basic.schelling.model import Schelling

import turing_learning as tl

PARAMETERS = {"density": (0.3, 0.95), "minority_pc": (0.1, 0.5), "homophily": (0.1, 0.7)}
TRUTH = {"density": 0.8, "minority_pc": 0.3, "homophily": 0.45}
COLUMNS = ["happy", "population", "minority_pct"]
STEPS = 10


def run(density, minority_pc, homophily, seed):
    """Run one model, and return a row for each step."""
    model = Schelling(density=density, minority_pc=minority_pc, homophily=homophily, seed=seed)
    for _ in range(STEPS):
        model.step()
    return model.datacollector.get_model_vars_dataframe()


def infer(trials=1000, observed=40, workers=None):
    """Infer the parameters from runs with known ones."""
    genuine = [run(**TRUTH, seed=seed)[COLUMNS] for seed in range(observed)]
    simulate = tl.systems.per_model(run, PARAMETERS, columns=COLUMNS)
    return tl.infer(
        genuine=genuine,
        simulate=simulate,
        parameters=PARAMETERS,
        trials=trials,
        seed=1,
        workers=workers,
    )


if __name__ == "__main__":
    print(infer(workers=2))
