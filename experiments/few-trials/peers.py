"""Other methods with as many trials, on the same recordings: ``python peers.py METHOD TRIALS FIRST LAST CASE...``.

It needs the extra `baselines`. Methods: npe (truncated), snle, snre and npe-raw (npe with an embedding of the raw motion), in
two rounds; abc-smc; bolfi; avo (adversarial variational optimization, of raw motion). Cases: walker-K and families, as in
intervals.py and cases.py, with their ranges as the prior; three-state-0, the random controller whose number is the seed, and
scenarios by name, with the prior of 4.5+. Summaries are made by hand: of the walker and families mean, deviation and
autocorrelations at lags of 1 and 10 of each signal, of robots those of `turing-learning reproduce 4.5+`. As there, a model is
simulated in 10 trials, whose summaries are averaged; only avo simulates each in one. Rows go to peers.csv; a run that has its
rows is not repeated. ``python peers.py`` alone prints medians beside those of runs of trials.
"""

import copy
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import cases
import curves
import numpy as np
import pandas as pd
import recovery
import walker

from turing_learning.reproduction import _methods as methods
from turing_learning.swarm import SCENARIOS, MixedSwarm

PATH = Path(__file__).with_name("peers.csv")
FIELDS = (
    "case",
    "method",
    "trials",
    "seed",
    "parameter",
    "truth",
    "estimate",
    "low",
    "high",
    "error",
    "cpu_s",
)
GROUP, ROUNDS, LAGS = 10, 2, (1, 10)


@dataclass
class Problem:
    """What a peer is given: a simulator, what was observed, and a uniform prior."""

    names: tuple[str, ...]
    truth: np.ndarray  # (P,)
    low: np.ndarray  # (P,)
    high: np.ndarray  # (P,)
    #: Models (M, P) -> motion (M, C, T, D) in a trial of each
    move: Callable[[np.ndarray, np.random.Generator], np.ndarray]
    recorded: np.ndarray  # motion (K, T, D)
    #: Groups of motion (M, C, T, D) -> summaries (M, S)
    condense: Callable[[np.ndarray], np.ndarray]
    observed: np.ndarray  # summaries (K, S) or (1, S)

    def group(self, models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the motion (M, 10 C, T, D) of a group of trials of each model (M, P)."""
        motion = self.move(np.repeat(models, GROUP, axis=0), rng)
        return motion.reshape(len(models), -1, *motion.shape[-2:])

    def simulate(self, models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the summaries (M, S) of a group of trials of each model (M, P)."""
        return self.condense(self.group(models, rng))

    def prior(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return models (M, P) from the prior."""
        return rng.uniform(self.low, self.high, (count, len(self.low)))


def summaries(samples: np.ndarray) -> np.ndarray:
    """Return mean, deviation and autocorrelations (..., 4 D) of samples (..., T, D)."""
    mean, spread = samples.mean(axis=-2), samples.std(axis=-2) + 1e-9
    z = (samples - mean[..., None, :]) / spread[..., None, :]
    return np.concatenate(
        [mean, spread, *((z[..., lag:, :] * z[..., :-lag, :]).mean(axis=-2) for lag in LAGS)],
        axis=-1,
    )


def problem(case: str, seed: int) -> Problem:
    """Return the problem of a case with the recordings of our runs."""
    kind, _, number = case.rpartition("-")
    if kind == "three-state" or case in SCENARIOS:
        scenario = SCENARIOS[case] if case in SCENARIOS else curves.system(f"three-state-{seed}")
        genuine = methods.Groups(scenario, GROUP).observe(1000, np.random.default_rng([seed, 5]))
        truth, swarm = np.array(scenario.controller), MixedSwarm(scenario, threads=1)
        end = np.full(len(truth), methods.HIGHEST_SPEED)
        return Problem(
            scenario.parameter_names, truth, -end, end,
            lambda models, rng: swarm.collect(models, rng).counterfeit, genuine,
            lambda motion: methods.summaries(motion, scenario), methods.summaries(genuine, scenario)[None],
        )  # fmt: skip
    if kind == "walker":
        genuine = walker.simulate(
            np.tile(walker.TRUTH, (int(number), 1)), np.random.default_rng([seed, int(number)])
        )
        return Problem(
            walker.NAMES, walker.TRUTH, walker.LOW, walker.HIGH,
            lambda models, rng: walker.simulate(models, rng)[:, None], genuine,
            lambda motion: summaries(motion).mean(axis=1), summaries(genuine),
        )  # fmt: skip
    known = recovery.CASES[case]
    genuine = known.family.observe(
        known.truth, groups=recovery.GROUPS, rng=np.random.default_rng([seed, 100])
    )
    parameters = known.family.parameters
    low, high = np.array([(each.low, each.high) for each in parameters.values()]).T
    truth = np.array([known.truth[name] for name in parameters])
    return Problem(
        tuple(parameters), truth, low, high, known.family, genuine,
        lambda motion: summaries(motion).mean(axis=1), summaries(genuine),
    )  # fmt: skip


def abc_smc(given: Problem, trials: int, seed: int) -> methods.Inferred:
    """Return what ABC-SMC infers, as in 4.5+, whose prior has the same range for all parameters."""

    def units(models: np.ndarray) -> np.ndarray:
        return given.low + (models / methods.HIGHEST_SPEED + 1) / 2 * (given.high - given.low)

    groups = SimpleNamespace(
        scenario=SimpleNamespace(parameter_names=given.names),
        simulate=lambda models, rng: given.simulate(units(models), rng),
    )
    found = methods.infer_by_abc_smc(groups, given.observed.mean(axis=0), trials // GROUP, seed)
    return methods.Inferred(units(found.estimate), units(found.low), units(found.high))


def bolfi(given: Problem, trials: int, seed: int, *, width: float = 1.0) -> methods.Inferred:
    """Return what Bayesian optimization for likelihood-free inference infers (Gutmann and Corander, 2016).

    A Gaussian process about a quadratic function models the logarithm of the distance of summaries, at most of 500
    groups. The first 50 are models from the prior; each further one is where the mean minus `width` deviations is smallest
    (the paper's bound, of about 8, explores without end in seven dimensions). The estimate is the tried model with the
    smallest mean. The posterior is the probability of a distance below that mean, sampled by Metropolis steps; it is close to
    the prior. This is done with scikit-learn: elfi 0.8.8 runs beside this numpy, but wants an older matplotlib than this
    package, takes eight times as long, and was no better.
    """
    from scipy.special import log_ndtr
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels

    rng, count, size = np.random.default_rng(seed), min(trials // GROUP, 500), len(given.low)

    def unit(share: np.ndarray) -> np.ndarray:
        return given.low + (share + 0.5) * (given.high - given.low)

    scale = _scale(given, rng, seed)
    target = given.observed.mean(axis=0) / scale

    def distance(share: np.ndarray) -> np.ndarray:
        return np.log(np.linalg.norm(given.simulate(unit(share), rng) / scale - target, axis=1))

    known = rng.uniform(-0.5, 0.5, (50, size))
    values = distance(known)
    quadratic = kernels.ConstantKernel(0.1) * kernels.DotProduct(1.0, "fixed") ** 2
    rough = kernels.ConstantKernel(1.0) * kernels.RBF(0.5, (0.1, 5))
    start = quadratic + rough + kernels.WhiteKernel(0.1, (1e-4, 1))
    while True:
        if len(known) % 50 == 0:  # scales and noise are fitted anew
            kernel = GaussianProcessRegressor(start, normalize_y=True).fit(known, values).kernel_
        field = GaussianProcessRegressor(kernel, optimizer=None, normalize_y=True).fit(
            known, values
        )
        if len(known) >= count:
            break
        best = known[np.argsort(field.predict(known))[:10]]
        near = best[rng.integers(10, size=500)] + rng.normal(size=(500, size)) * rng.choice(
            (0.02, 0.1), (500, 1)
        )
        tried = np.concatenate([rng.uniform(-0.5, 0.5, (500, size)), near.clip(-0.5, 0.5)])
        mean, spread = field.predict(tried, return_std=True)
        known = np.concatenate([known, tried[[np.argmin(mean - width * spread)]]])
        values = np.append(values, distance(known[-1:]))
    center = field.predict(known)
    estimate, threshold = unit(known[np.argmin(center)]), center.min()

    def logarithm(share: np.ndarray) -> np.ndarray:
        mean, spread = field.predict(share, return_std=True)  # with the noise of a group
        inside = (np.abs(share) <= 0.5).all(axis=1)
        return np.where(inside, log_ndtr((threshold - mean) / spread), -np.inf)

    walkers = rng.uniform(-0.5, 0.5, (2000, size))
    level = logarithm(walkers)
    chosen = rng.choice(
        2000, 200, p=np.exp(level - level.max()) / np.exp(level - level.max()).sum()
    )
    walkers, level, draws = walkers[chosen], level[chosen], []
    for step in range(150):
        first, second = walkers[rng.integers(200, size=200)], walkers[rng.integers(200, size=200)]
        stride = rng.choice((2.4 / np.sqrt(2 * size), 1.0), (200, 1))
        tried = walkers + stride * (first - second) + 0.01 * rng.normal(size=walkers.shape)
        heights = logarithm(tried)
        taken = np.log(rng.uniform(size=200)) < heights - level
        walkers, level = np.where(taken[:, None], tried, walkers), np.where(taken, heights, level)
        if step >= 50 and step % 10 == 0:
            draws.append(walkers)
    return replace(methods.Inferred.of_posterior(unit(np.concatenate(draws))), estimate=estimate)


def avo(
    given: Problem, trials: int, seed: int, *, batch: int = 25, rate: float = 0.015
) -> methods.Inferred:
    """Return what adversarial variational optimization infers (Louppe, Hermans and Cranmer, 2017): no interval.

    Models are drawn from a Gaussian within the prior's ranges, whose mean and deviations rise on the output of a critic, by
    REINFORCE with the mean of the batch as baseline. The critic, a convolution over time with a penalty on its gradient at
    recordings (R1), learns to tell recorded motion from that of the last four batches. The estimate is the mean.
    """
    import torch

    torch.set_num_threads(1)
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    motion = _Motion(given, seed)
    critic = torch.nn.Sequential(
        motion.body(), torch.nn.Linear(32, 32), torch.nn.LeakyReLU(), torch.nn.Linear(32, 1)
    )
    judge = torch.optim.Adam(critic.parameters(), 2e-3, betas=(0.5, 0.99))
    size = len(given.low)
    mean = torch.full((size,), 0.5, requires_grad=True)
    deviation = torch.full((size,), np.log(0.25), requires_grad=True)  # its logarithm
    mover, genuine, recent = (
        torch.optim.Adam([mean, deviation], rate),
        motion.tensor(given.recorded),
        [],
    )
    softplus = torch.nn.functional.softplus
    for _ in range(trials // batch):
        proposal = torch.distributions.Normal(mean, deviation.exp())
        share = proposal.sample((batch,))
        tried = given.low + share.clamp(0, 1).numpy().astype(float) * (given.high - given.low)
        found = motion.tensor(given.move(tried, rng))  # (M, C, T, D)
        recent = [*recent[-3:], found.flatten(0, 1)]
        pool = torch.cat(recent)
        for _ in range(10):
            real = genuine[torch.randint(len(genuine), (64,))].requires_grad_()
            right, wrong = critic(real), critic(pool[torch.randint(len(pool), (64,))])
            (slope,) = torch.autograd.grad(right.sum(), real, create_graph=True)
            loss = (
                softplus(-right).mean()
                + softplus(wrong).mean()
                + slope.square().sum(dim=(1, 2)).mean()
            )
            judge.zero_grad()
            loss.backward()
            judge.step()
        with torch.no_grad():
            reward = critic(found.flatten(0, 1)).reshape(batch, -1).mean(dim=1)
            gain = (reward - reward.mean()) / (reward.std() + 1e-6)
        mover.zero_grad()
        (-(gain[:, None] * proposal.log_prob(share)).sum(dim=1).mean()).backward()
        mover.step()
        with torch.no_grad():
            mean.clamp_(0, 1)
            deviation.clamp_(np.log(0.01), np.log(0.4))
    return methods.Inferred(
        given.low + mean.detach().numpy().astype(float) * (given.high - given.low)
    )


class _Motion:
    """Raw motion as tensors, in standard deviations of that of the prior, and a network that condenses it."""

    def __init__(self, given: Problem, seed: int) -> None:
        rng = np.random.default_rng(seed + 1)
        self.motion = given.move(given.prior(100, rng), rng)
        self.mean, self.spread = (
            self.motion.mean(axis=(0, 1, 2)),
            self.motion.std(axis=(0, 1, 2)) + 1e-6,
        )

    def tensor(self, motion: np.ndarray):
        """Return standardized motion (..., T, D)."""
        import torch

        return torch.as_tensor((motion - self.mean) / self.spread, dtype=torch.float32)

    def body(self):
        """Return a network that takes motion (..., T, D) to the mean over time of 32 features of short windows."""
        from torch import nn

        class Body(nn.Module):
            def __init__(self, signals: int) -> None:
                super().__init__()
                self.layers = nn.Sequential(
                    nn.Conv1d(signals, 16, 5, stride=2),
                    nn.LeakyReLU(),
                    nn.Conv1d(16, 32, 5, stride=2),
                    nn.LeakyReLU(),
                )

            def forward(self, motion):
                flat = motion.reshape(-1, *motion.shape[-2:]).transpose(1, 2)
                return self.layers(flat).mean(dim=-1).reshape(*motion.shape[:-2], -1)

        return Body(self.motion.shape[-1])


def _embedding(body):
    """Return a network that takes groups of motion (M, C, T, D) to features (M, 12), by means over trials; features stay."""
    from torch import nn

    class Embedding(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.body, self.head = (
                body,
                nn.Sequential(nn.Linear(32, 32), nn.LeakyReLU(), nn.Linear(32, 12)),
            )

        def forward(self, motion):
            return motion if motion.ndim == 2 else self.head(self.body(motion).mean(dim=1))

    return Embedding()


def npe_raw(given: Problem, trials: int, seed: int) -> methods.Inferred:
    """Return what npe infers from the raw motion of groups, with an embedding that is trained with the flow."""
    import torch
    from sbi import inference, utils
    from sbi.neural_nets import posterior_nn

    torch.set_num_threads(1)
    torch.manual_seed(seed)
    rng, motion = np.random.default_rng(seed), _Motion(given, seed)
    low, high = (torch.as_tensor(end, dtype=torch.float32) for end in (given.low, given.high))
    network, prior = _embedding(motion.body()), utils.BoxUniform(low, high)
    flow = posterior_nn("maf", z_score_x="none", embedding_net=network)
    trainer = inference.NPE(
        prior, density_estimator=flow, show_progress_bars=False, tracker=methods.SILENT_TRACKER
    )
    genuine, proposal = motion.tensor(given.recorded)[None], prior
    for part in np.array_split(np.arange(trials // GROUP), ROUNDS):
        models = proposal.sample((len(part),))
        found = motion.tensor(given.group(models.numpy().astype(float), rng))
        estimator = trainer.append_simulations(models, found).train(
            learning_rate=2e-3, force_first_round_loss=True
        )
        posterior = trainer.build_posterior(copy.deepcopy(estimator))
        trained = posterior.posterior_estimator
        with torch.no_grad():  # groups of another size are given as their features
            seen = next(each for each in trained.modules() if type(each) is type(network))(genuine)
        trained._condition_shape = seen.shape[1:]
        proposal = methods.truncated(utils, posterior.set_default_x(seen), low, high)
    draws = posterior.sample((1000,), show_progress_bars=False)
    return methods.Inferred.of_posterior(draws.numpy().astype(float))


def _scale(given: Problem, rng: np.random.Generator, seed: int) -> np.ndarray:
    """Return what summaries (S,) are divided by, from groups that are not counted."""
    first = given.simulate(given.prior(50, rng), np.random.default_rng(seed + 1))
    return np.ptp(np.quantile(first, (0.1, 0.9), axis=0), axis=0) + 1e-6


def neural(method: str, given: Problem, trials: int, seed: int) -> methods.Inferred:
    """Return what npe, snle or snre infers from summaries."""
    import torch
    from sbi import inference, utils

    torch.set_num_threads(1)
    torch.manual_seed(seed)
    rng, simulate = np.random.default_rng(seed), given.simulate

    def tensor(array: np.ndarray) -> torch.Tensor:
        return torch.as_tensor(array, dtype=torch.float32)

    scale = _scale(given, rng, seed)
    low, high = tensor(given.low), tensor(given.high)
    prior = utils.BoxUniform(low, high)
    kinds = {"npe": inference.NPE, "snle": inference.NLE, "snre": inference.NRE}
    trainer = kinds[method](prior, show_progress_bars=False, tracker=methods.SILENT_TRACKER)
    seen, posterior, proposal = (
        tensor(given.observed.mean(axis=0, keepdims=True) / scale),
        None,
        prior,
    )
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
    draws = posterior.sample((1000,), show_progress_bars=False)
    return methods.Inferred.of_posterior(draws.numpy().astype(float))


METHODS = {
    **{name: partial(neural, name) for name in ("npe", "snle", "snre")},
    "npe-raw": npe_raw, "abc-smc": abc_smc, "bolfi": bolfi, "avo": avo,
}  # fmt: skip


def run(method: str, trials: int, case: str, seed: int) -> list[dict[str, object]]:
    """Return the rows of one run; `error` is a share of the range of the prior."""
    given, begun = problem(case, seed), time.process_time()
    found = METHODS[method](given, trials, seed)
    cpu_s = round(time.process_time() - begun, 1)
    unknown = np.full(len(given.names), np.nan)
    low, high = (unknown if end is None else end for end in (found.low, found.high))
    errors = np.abs(found.estimate - given.truth) / (given.high - given.low)
    rows = []
    for k, name in enumerate(given.names):
        numbers = (given.truth[k], found.estimate[k], low[k], high[k], errors[k])
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
        numbers = [
            np.fromstring(each[name], sep=" ") for name in ("truth", "estimate", "low", "high")
        ]
        for name, truth, estimate, low, high in zip(names, *numbers, strict=True):
            error = abs(estimate - truth) / (2 * methods.HIGHEST_SPEED)
            rows.append(
                (
                    "three-state-0",
                    each.trials,
                    each.seed,
                    name,
                    truth,
                    estimate,
                    low,
                    high,
                    error,
                    each.cpu_s,
                )
            )
    columns = [name for name in FIELDS if name != "method"]
    known = pd.concat(
        [walks.rename(columns={"seconds": "cpu_s"}), families, pd.DataFrame(rows, columns=columns)]
    )
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
    done = (
        pd.read_csv(PATH)[list(FIELDS[:4])].drop_duplicates().values.tolist()
        if PATH.exists()
        else []
    )
    for seed in range(first, last + 1):
        for case in sys.argv[5:]:
            if [case, method, trials, seed] not in done:
                curves.append(PATH, FIELDS, run(method, trials, case, seed))


if __name__ == "__main__":
    assert cases  # puts the folder of recovery.py on the path
    main()
