"""Processor time of a generation in which 100 classifiers choose the light for 100 models, as a multiple of one that only watches.

The two systems with an e-puck follow, in seconds. Run with ``python benchmarks/bench_interaction.py``.
A trial has 100 steps; classifiers that watch judge one sample of each model.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import time

import numpy as np

from turing_learning.config import load_configuration
from turing_learning.runs._loops import Generations
from turing_learning.systems import Arguments

FORMS = {"watching": (1, "constant"), "10 opponents": (10, ""), "all 100": (100, "")}


def seconds(
    opponents: int, passive: str, generations: int = 15, system: str = "light-response"
) -> float:
    """Return the median processor time of a generation (s)."""
    settings = {
        "scenario.opponents": opponents,
        "scenario.stimulus.passive": passive,
        "coevolution.archive": 0,
    }
    configuration = load_configuration(scenario=system, overrides=settings | {"run.threads": 1})
    loop, found = Generations(configuration, configuration.system.open(Arguments())), []
    for _ in range(generations):
        begun = time.process_time()
        loop.step()
        found.append(time.process_time() - begun)
    return float(np.median(found))


if __name__ == "__main__":
    times = {name: seconds(*form) for name, form in FORMS.items()}
    for name, spent in times.items():
        print(f"{name:>14} {1e3 * spent:7.1f} ms {spent / times['watching']:6.1f}")
    for robot in ("infrared-sensors", "rangefinder-response"):
        for form in ("10 opponents", "all 100"):
            spent = seconds(*FORMS[form], generations=4, system=robot)
            print(f"{robot:>21} {form:>13} {spent:6.2f} s")
