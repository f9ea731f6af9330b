"""Neural estimation with as many trials, on the same recordings: ``python peers.py METHOD TRIALS FIRST LAST CASE...``.

It needs the extra `baselines`. Methods, all in two rounds: npe (truncated), snle, snre. Cases: walker-K and families, as in
intervals.py and cases.py, with their ranges as the prior; three-state-0, the random controller whose number is the seed, with
the prior of 4.5+. Summaries are made by hand: of the walker and families mean, deviation and autocorrelations at lags of 1
and 10 of each signal, of robots those of `turing-learning reproduce 4.5+`. As there, a model is simulated in 10 trials,
whose summaries are averaged. Rows go to peers.csv; a run that has its rows is not repeated. ``python peers.py`` alone prints
medians beside those of runs of trials.
"""

import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cases
import curves
import numpy as np
import pandas as pd
import recovery
import walker

from turing_learning.reproduction import _methods as methods

PATH = Path(__file__).with_name("peers.csv")
FIELDS = ("case", "method", "trials", "seed", "parameter", "truth", "estimate", "low", "high", "error", "cpu_s")
GROUP, ROUNDS, LAGS = 10, 2, (1, 10)


@dataclass
class Problem:
    """What a peer is given: a simulator of summaries, those observed, and a uniform prior."""

    names: tuple[str, ...]
    truth: np.ndarray  # (P,)
    low: np.ndarray  # (P,)
    high: np.ndarray  # (P,)
    #: Models (M, P) -> mean summaries (M, S) of groups of trials
    simulate: Callable[[np.ndarray, np.random.Generator], np.ndarray]
    observed: np.ndarray  # (K, S)


def summaries(samples: np.ndarray) -> np.ndarray:
    """Return mean, deviation and autocorrelations (..., 4 D) of samples (..., T, D)."""
    mean, spread = samples.mean(axis=-2), samples.std(axis=-2) + 1e-9
    z = (samples - mean[..., None, :]) / spread[..., None, :]
    return np.concatenate(
        [mean, spread, *((z[..., lag:, :] * z[..., :-lag, :]).mean(axis=-2) for lag in LAGS)], axis=-1
    )


def problem(case: str, seed: int) -> Problem:
    """Return the problem of a case with the recordings of our runs."""
    kind, _, number = case.rpartition("-")
    if kind == "three-state":
        groups = methods.Groups(curves.system(f"three-state-{seed}"), GROUP)
        genuine, truth = groups.observe(1000, np.random.default_rng([seed, 5])), np.array(groups.scenario.controller)
        end, names = np.full(len(truth), methods.LARGEST), groups.scenario.parameter_names
        observed = methods.summaries(genuine, groups.scenario)[None]
        return Problem(names, truth, -end, end, groups.simulate, observed)
    if kind == "walker":
        genuine = walker.simulate(np.tile(walker.TRUTH, (int(number), 1)), np.random.default_rng([seed, int(number)]))
        return Problem(
            walker.NAMES, walker.TRUTH, walker.LOW, walker.HIGH,
            _grouped(lambda models, rng: summaries(walker.simulate(models, rng))), summaries(genuine),
        )  # fmt: skip
    known = recovery.CASES[case]
    genuine = known.family.observe(known.truth, groups=recovery.GROUPS, rng=np.random.default_rng([seed, 100]))
    parameters = known.family.parameters
    low, high = np.array([(each.low, each.high) for each in parameters.values()]).T

    def simulate(models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the mean summaries of the observed individuals of a group."""
        return summaries(known.family(models, rng)).reshape(len(models), -1, 4 * genuine.shape[-1]).mean(axis=1)

    truth = np.array([known.truth[name] for name in parameters])
    return Problem(tuple(parameters), truth, low, high, _grouped(simulate), summaries(genuine))


def infer(method: str, given: Problem, trials: int, seed: int) -> np.ndarray:
    """Return draws (N, P) from the posterior."""
    import torch
    from sbi import inference, utils

    torch.set_num_threads(1)
    torch.manual_seed(seed)
    rng, simulate = np.random.default_rng(seed), given.simulate

    def tensor(array: np.ndarray) -> torch.Tensor:
        return torch.as_tensor(array, dtype=torch.float32)

    first = simulate(rng.uniform(given.low, given.high, (50, len(given.low))), np.random.default_rng(seed + 1))
    # groups that are not counted give the scale of what a network takes
    scale = np.ptp(np.quantile(first, (0.1, 0.9), axis=0), axis=0) + 1e-6
    low, high = tensor(given.low), tensor(given.high)
    prior = utils.BoxUniform(low, high)
    kinds = {"npe": inference.NPE, "snle": inference.NLE, "snre": inference.NRE}
    trainer = kinds[method](prior, show_progress_bars=False, tracker=methods.NO_TRACKER)
    seen, posterior, proposal = tensor(given.observed.mean(axis=0, keepdims=True) / scale), None, prior
    for part in np.array_split(np.arange(trials // GROUP), ROUNDS):
        models = proposal.sample((len(part),))
        found = tensor(simulate(models.numpy().astype(float), rng) / scale)
        trainer.append_simulations(models, found)
        if method == "npe":
            trainer.train(force_first_round_loss=True)
            posterior = trainer.build_posterior().set_default_x(seen)
            proposal = methods.truncated(utils, posterior, low, high)
        else:
            trainer.train()
            posterior = proposal = trainer.build_posterior(
                sample_with="mcmc", mcmc_method="slice_np_vectorized",
                mcmc_parameters={"num_chains": 20, "warmup_steps": 100, "thin": 2},
            ).set_default_x(seen)  # fmt: skip
    return posterior.sample((1000,), show_progress_bars=False).numpy().astype(float)


def _grouped(simulate: Callable[[np.ndarray, np.random.Generator], np.ndarray]):
    def groups(models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return simulate(np.repeat(models, GROUP, axis=0), rng).reshape(len(models), GROUP, -1).mean(axis=1)

    return groups


def run(method: str, trials: int, case: str, seed: int) -> list[dict[str, object]]:
    """Return the rows of one run; `error` is a share of the range of the prior."""
    given, begun = problem(case, seed), time.process_time()
    draws = infer(method, given, trials, seed)
    cpu_s = round(time.process_time() - begun, 1)
    low, middle, high = np.quantile(draws, (0.05, 0.5, 0.95), axis=0)
    errors = np.abs(middle - given.truth) / (given.high - given.low)
    rows = []
    for k, name in enumerate(given.names):
        numbers = (given.truth[k], middle[k], low[k], high[k], errors[k])
        values = (case, method, trials, seed, name, *(f"{each:.6g}" for each in numbers), cpu_s)
        rows.append(dict(zip(FIELDS, values, strict=True)))
    return rows


def ours() -> pd.DataFrame:
    """Return the rows of runs of trials in the same cases."""
    here = PATH.parent
    walks = pd.read_csv(here / "intervals.csv")
    ranges = dict(zip(walker.NAMES, walker.HIGH - walker.LOW, strict=True))
    walks = walks[walks.case.str.startswith("walker") & walks.parameter.isin(ranges)]
    walks["error"] = (walks.estimate - walks.truth).abs() / walks.parameter.map(ranges)
    families = pd.read_csv(here / "cases.csv")
    robots = pd.read_csv(here / "three-state.csv")
    rows = []
    for _, each in robots.iterrows():
        names = ("vl0", "vr0", "vl1", "vr1", "vl2", "vr2")
        numbers = [np.fromstring(each[name], sep=" ") for name in ("truth", "estimate", "low", "high")]
        for name, truth, estimate, low, high in zip(names, *numbers, strict=True):
            error = abs(estimate - truth) / (2 * methods.LARGEST)
            rows.append(("three-state-0", each.trials, each.seed, name, truth, estimate, low, high, error, each.cpu_s))
    columns = [name for name in FIELDS if name != "method"]
    known = pd.concat([walks.rename(columns={"seconds": "cpu_s"}), families, pd.DataFrame(rows, columns=columns)])
    return known[columns].assign(method="Turing Learning")


def summary() -> None:
    """Print median errors, as shares of the range, and how many intervals hold, method by method."""
    peers = pd.read_csv(PATH)
    keys = peers[["case", "trials", "seed"]].drop_duplicates()
    rows = pd.concat([peers, ours().merge(keys)])
    open_ = rows.case.str.startswith("walker") & rows.parameter.isin(
        ("gain", "noise", "r_att")
    )  # no method can tell them
    rows = rows[~open_]
    rows["held"] = ((rows.low <= rows.truth) & (rows.truth <= rows.high)).where(rows.low.notna())
    table = rows.groupby(["case", "trials", "method"]).agg(
        runs=("seed", "nunique"), median=("error", "median"), mean=("error", "mean"), worst=("error", "max"),
        held=("held", "mean"), given=("low", "count"), cpu_s=("cpu_s", "median"),
    )  # fmt: skip
    sys.stdout.write(table.round(4).to_string() + "\n")


def main() -> None:
    """Run what the table lacks, or print what it holds."""
    if len(sys.argv) < 6:
        summary()
        return
    warnings.simplefilter("ignore")
    method, (trials, first, last) = sys.argv[1], map(int, sys.argv[2:5])
    done = pd.read_csv(PATH)[list(FIELDS[:4])].drop_duplicates().values.tolist() if PATH.exists() else []
    for seed in range(first, last + 1):
        for case in sys.argv[5:]:
            if [case, method, trials, seed] not in done:
                curves.append(PATH, FIELDS, run(method, trials, case, seed))


if __name__ == "__main__":
    assert cases  # puts the folder of recovery.py on the path
    main()
