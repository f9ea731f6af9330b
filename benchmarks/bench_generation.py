"""One generation at the paper's size (100 trials of 11 robots, 100 classifiers), and where its time goes."""

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.classifiers import ElmanClassifier
from turing_learning.coevolution import Coevolution, Judgments, PassiveInterrogation
from turing_learning.evolution import EvolutionStrategy
from turing_learning.kernels.parallel import default_threads
from turing_learning.swarm import MixedSwarm

SIZE = 100
THREADS = sorted({1, default_threads()})
SCENARIOS = ("aggregation", "object-clustering")


def coevolution(interrogation, scenario, classifier):
    models = EvolutionStrategy(len(scenario.controller), seed=[1, 1])
    return Coevolution(
        interrogation, models, EvolutionStrategy(classifier.parameters, seed=[1, 2]), seed=1
    )


def report(benchmark, label):
    print(f"\n{label}: median {1e3 * benchmark.stats.stats.median:.2f} ms")


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("name", SCENARIOS)
def test_simulating(benchmark, name, threads):
    scenario = tl.swarm.SCENARIOS[name]
    source = MixedSwarm(scenario, threads)
    models = np.random.default_rng(0).uniform(-1, 1, (SIZE, len(scenario.controller)))
    generators = iter(np.random.default_rng(seed) for seed in range(10**6))
    benchmark.pedantic(
        lambda: source.collect(models, next(generators)), rounds=200, warmup_rounds=5
    )
    report(benchmark, f"simulate {name}, {threads} threads")


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("name", SCENARIOS)
def test_a_generation(benchmark, name, threads):
    scenario = tl.swarm.SCENARIOS[name]
    classifier = ElmanClassifier(scale=scenario.input_scale, threads=threads)
    loop = coevolution(
        PassiveInterrogation(MixedSwarm(scenario, threads), classifier), scenario, classifier
    )
    benchmark.pedantic(loop.step, rounds=300, warmup_rounds=5)
    report(benchmark, f"generation of {name}, {threads} threads")


def test_everything_but_simulating_and_judging(benchmark, tmp_path):
    scenario = tl.swarm.AGGREGATION
    classifier = ElmanClassifier(scale=scenario.input_scale)
    rng = np.random.default_rng(0)
    judgments = Judgments(
        genuine_outputs=rng.uniform(size=(SIZE, SIZE * scenario.agents)).astype(np.float32),
        counterfeit_outputs=rng.uniform(size=(SIZE, SIZE, 1)).astype(np.float32),
    )

    def fresh(models, classifiers, rng):
        return Judgments(
            genuine_outputs=judgments.genuine_outputs,
            counterfeit_outputs=judgments.counterfeit_outputs,
        )

    loop = coevolution(fresh, scenario, classifier)
    benchmark.pedantic(loop.step, rounds=1000, warmup_rounds=5)
    report(benchmark, "rewards, selection and variation")
