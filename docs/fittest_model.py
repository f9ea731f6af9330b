"""Measure how often the classifiers that a run of experiment 4.6.1 ends with take models and agents for genuine.

Run with ``python docs/fittest_model.py RUN...`` after, for example,
``turing-learning infer aggregation-field-of-view-60 --generations 1000 --seed 2023 --out RUN``.
Trials are fresh ones; decision 0016.
"""

import sys

import numpy as np

from turing_learning.coevolution import THRESHOLD
from turing_learning.detection import RunClassifiers, run_classifiers
from turing_learning.runs import Result, load_run
from turing_learning.swarm import execution_of, initial_poses, simulate

TRIALS, LAST, FAR, MUCH = 60, 100, 2.2, 0.3


def shares(
    result: Result, known: RunClassifiers, model: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the shares of replicas of a model (P,), and of the agents beside them, that each classifier takes for genuine."""
    scenario = result.configuration.scenario
    poses = initial_poses(scenario, TRIALS, np.random.default_rng(5))
    executed = np.full(poses.shape[:2], -1)
    executed[:, scenario.agents :] = 0
    execution = execution_of(scenario, scenario.model.behavior(model[None]), executed)
    motion = simulate(
        scenario,
        execution.controllers,
        poses,
        control_steps=scenario.control_steps,
        seed=1,
        fields_of_view=execution.fields_of_view,
    )
    kinds = motion.speeds[:, scenario.agents :], motion.speeds[:, : scenario.agents]
    judged = [
        known.classifier.judge(known.last, each.reshape(-1, *each.shape[2:])) for each in kinds
    ]
    replicas, agents = (np.mean(outputs >= THRESHOLD, axis=1) for outputs in judged)
    return replicas, agents


def main() -> None:
    """Print a row for each model of each run: taken for genuine, replicas / agents; and the views of the last models."""
    for path in sys.argv[1:]:
        result = load_run(path)
        known = run_classifiers(result)
        models = {
            "truth": result.configuration.scenario.truth,
            "estimate": tuple(result.estimate.values()),
            "best model": tuple(result.best_model.values()),
        }
        for name, values in models.items():
            model = np.array(values)
            replicas, agents = shares(result, known, model)
            more, less = np.sum(replicas > agents + MUCH), np.sum(replicas < agents - MUCH)
            print(  # noqa: T201
                f"{path}: {name} {np.round(model, 2)} {replicas.mean():.2f} / {agents.mean():.2f}; "
                f"{more} classifiers take it for genuine much more often than agents, {less} much less often",
                flush=True,
            )
        fittest = int((result.history["best_model"][-LAST:, -1] > FAR).sum())
        print(f"{path}: the fittest has another view in {fittest} of the last {LAST} generations")  # noqa: T201
        for generation in range(600, result.generations, LAST):
            now = result.history.isel(generation=slice(generation, generation + LAST))
            other, step = now["model"][..., -1] > FAR, now["model_step_size"][..., -1]
            print(  # noqa: T201
                f"{path}: generations {generation} to {generation + LAST - 1}: {float(other.mean()):.1%} of the models have "
                f"another view; median step size of its number {float(step.median()):.2f}"
            )


if __name__ == "__main__":
    main()
