"""How likely parameters are, by what classifiers say of samples.

Goes in: outputs of J classifiers for S counterfeit samples, whose parameters are known, and for K
genuine samples. Comes out: a function of the parameters, the logarithm of their likelihood. Why it
works: all outputs are condensed to one composite judgment for each parameter, the linear
combination that predicts it best. Near the solution the mean composite judgment is a smooth
function of the parameters, which a Gaussian process learns (`Emulator`). Parameters are the
likelier the nearer this mean is to that of the genuine samples.

Source: Fearnhead and Prangle, Constructing summary statistics for approximate Bayesian computation
(2012); Price et al., Bayesian synthetic likelihood (2018). The numbers: decision 0028, "The
read-out".
"""

from dataclasses import dataclass

import numpy as np

from ._emulator import Emulator, conditioned, learned_kernel, surprise
from ._jurors import quadratic_terms

SAMPLE_FOLDS = 5
"""Parts of the counterfeit samples; what is learned from four is applied to the fifth."""

TRUSTED_SHARE = 0.7
"""Share of the samples at which the prediction is sure enough for draws."""

SURE_VARIANCE = 0.25
"""Variance of a prediction, in units of that of the target, that is sure enough in any case."""

TIGHT = 0.5
"""Squared distance in judgment, in units of the noise of one sample, within which samples are too
much alike to tell slopes."""

STEEP = 4.0
"""Squared distance, in the same units, up to which samples are taken in place of half of those."""

LENGTH_GROWTH = 2.5
"""By how much length scales of the fine fit may be longer than those of the broad one."""

RULED_OUT = 20.0
"""Half the squared misses beyond which a broad fit rules models out: those of twenty parameters are
as large by chance in one of two hundred cases."""

MEANS_BY_CHANCE = 1000
"""Means of samples of the model that the distance is held against."""

WEIGHT_GROWTH = 1.1
"""Factor by which weights are widened until they rest on enough samples."""

WIDEST_WEIGHTS = 1e4
"""Width at which they are not widened any more: then all samples count alike."""

LEAST_NOISE_SHARE = 0.2
"""Least share of a miss that counts as noise where the emulator knows the rest."""


@dataclass(frozen=True)
class Likelihood:
    """Composite judgments as functions of the parameters, and where those of the agents are.

    There is one judgment for each of P parameters, none for the canary, which comes last among the
    parameters of a model. Judgments are in units of the noise of one sample.
    """

    emulator: Emulator
    points: np.ndarray  #: (N, P + 1), that it was fitted to
    outputs: np.ndarray  #: (N, P), composite judgments there
    trust: float  #: Largest variance of a prediction that counts
    target: np.ndarray  #: (P,), mean composite judgment of the genuine samples
    covariance: np.ndarray  #: (P, P), of the target
    broad: "Likelihood | None" = None  #: A broader fit, which must not rule models out

    def remoteness(self, z: np.ndarray) -> np.ndarray:
        """Return how far (S,) models (S, P + 1) are judged from the agents, squared."""
        distances: np.ndarray = ((self.emulator.mean(z) - self.target) ** 2).sum(axis=1)
        return distances

    def log_likelihood(
        self, z: np.ndarray, optimistic: bool = False, least: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the logarithm (S,) of the likelihood of models (S, P + 1).

        Parameters
        ----------
        z : (S, P + 1)
            Parameters on [-1, 1]; beyond, the likelihood is 0.
        optimistic
            Whether models of which little is known are not held to be unlikely.
        least : (S,)
            What lies below need not be exact.
        """
        inside = (np.abs(z) <= 1).all(axis=1)
        mean, variance = self.emulator.predict(z[inside])
        squares, half_logs = surprise(mean - self.target, variance, self.covariance)
        values = -0.5 * squares
        if not optimistic:
            values -= half_logs
        trusted = variance.mean(axis=1) <= self.trust
        likelihood = np.full(len(z), -np.inf)
        likelihood[inside] = np.where(trusted, values, -np.inf)
        if self.broad is not None:
            counts = np.flatnonzero(likelihood > (-np.inf if least is None else least))
            broadly = self.broad.log_likelihood(z[counts], optimistic=True)
            likelihood[counts[broadly <= -RULED_OUT]] = -np.inf
        return likelihood

    def without_canary(self, z: np.ndarray, least: np.ndarray | None = None) -> np.ndarray:
        """Return the likelihood of models (S, P) where the canary is at its middle."""
        return self.log_likelihood(np.c_[z, np.zeros(len(z))], least=least)


@dataclass(frozen=True, eq=False)
class JudgedSamples:
    """What classifiers say of samples.

    Outputs in units of their spread over the counterfeit ones, those that vary.
    """

    #: (S, P + 1), parameters of the models on [-1, 1], the canary the last
    parameters: np.ndarray
    counterfeit: np.ndarray  #: (S, J), outputs for the counterfeit samples
    genuine: np.ndarray  #: (K, J), outputs for the genuine ones
    fold: np.ndarray  #: (S,)
    samples_per_trial: int  #: Samples of a trial that each counterfeit output is the mean of
    size: int  #: Samples that a fit rests on

    def weights(self, remoteness: np.ndarray) -> np.ndarray:
        """Return weights (S,) that fall with remoteness, slowly enough for a regression."""
        wanted = min(self.size / 2, 0.7 * len(remoteness))
        beyond = remoteness - remoteness.min()
        width = 1.0
        while True:
            weights = np.exp(-0.5 * beyond / width**2)
            effective_enough = weights.sum() ** 2 >= wanted * (weights**2).sum()
            if effective_enough or width > WIDEST_WEIGHTS:
                return weights
            width *= WEIGHT_GROWTH

    def fit(
        self,
        remoteness: np.ndarray,
        logs: np.ndarray | None,
        far_share: float,
        weight_floor: float | None = None,
    ) -> Likelihood:
        """Return the likelihood by the samples that are judged nearest to the agents.

        Parameters
        ----------
        remoteness : (S,)
            How far the samples are judged from the agents, as far as that is known.
        logs
            Logarithms of length scales, shape and variances, see `Emulator`, from which those of
            the fit are sought.
        far_share
            Share of the samples that are from anywhere.
        weight_floor
            If given, samples are taken evenly down to that weight, relative to the largest.
        """
        weights = self.weights(remoteness)
        # roots of such weights are weights of a width larger by root 2
        composite, genuine = self._composite(np.sqrt(weights))
        chosen = self._chosen(weights, remoteness, far_share, weight_floor)
        z = self.parameters[chosen]
        t = composite[chosen]
        weights = weights[chosen] / weights.max()
        # a linear fit says along which directions judgments move
        terms = np.c_[np.ones(len(z)), z]
        root = np.sqrt(weights)[:, None]
        expected = terms @ np.linalg.lstsq(root * terms, root * t, rcond=None)[0]
        misses = t - expected
        offset = np.average(t, axis=0, weights=weights)
        longer = np.inf if far_share else LENGTH_GROWTH
        # The second time with the covariance that the first has found
        for _ in range(2):
            residual = _covariance_of(misses, weights)
            residual += 1e-6 * np.trace(residual) / len(residual) * np.eye(len(residual))
            values, vectors = np.linalg.eigh(residual)
            whiten = vectors / np.sqrt(values)
            whiten = whiten @ np.linalg.svd((expected - offset) @ whiten, full_matrices=False)[2].T
            outputs = (t - offset) @ whiten
            logs = learned_kernel(z, outputs, logs, longer)
            longer = min(longer, LENGTH_GROWTH)
            emulator = conditioned(z, outputs, logs)
            mean, variance = emulator.predict(z)
            # If left out, a sample misses by 1 / (1 - v) as much, with a variance of
            # 1 + v / (1 - v), of which 1 is noise
            noise_share = np.maximum(1 - variance, LEAST_NOISE_SHARE)
            scaled = (outputs - mean) / (noise_share * np.sqrt(1 + variance / noise_share))
            misses = scaled @ np.linalg.inv(whiten)
        target, covariance = self._target(genuine, _covariance_of(misses, weights))
        covariance = whiten.T @ covariance @ whiten
        sure = SURE_VARIANCE * float(np.trace(covariance)) / len(covariance)
        return Likelihood(
            emulator=emulator,
            points=z,
            outputs=outputs,
            trust=max(float(np.quantile(variance.mean(axis=1), TRUSTED_SHARE)), sure),
            target=(target - offset) @ whiten,
            covariance=covariance,
        )

    def _composite(self, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return composite judgments of counterfeit (S, P) and genuine samples (K, P).

        Each fold is judged by what was learned from the others; the canary has no judgment.
        """
        counterfeit = np.zeros_like(self.parameters)
        genuine = np.zeros((len(self.genuine), self.parameters.shape[1]))
        for fold_number in range(SAMPLE_FOLDS):
            out = self.fold == fold_number
            middle, coefficients, offset = _ridge(
                self.counterfeit[~out], self.parameters[~out], weights[~out]
            )
            counterfeit[out] = (self.counterfeit[out] - middle) @ coefficients + offset
            genuine += ((self.genuine - middle) @ coefficients + offset) / SAMPLE_FOLDS
        return counterfeit[:, :-1], genuine[:, :-1]

    def _chosen(
        self,
        weights: np.ndarray,
        remoteness: np.ndarray,
        far_share: float,
        weight_floor: float | None,
    ) -> np.ndarray:
        """Return the indices of the samples that a fit rests on."""
        order = np.argsort(-weights, kind="stable")
        remote = remoteness[order] - remoteness.min()
        near_count = round(self.size * (1 - far_share))
        if weight_floor is not None:
            # evenly from farther out
            inside = max(near_count, int((weights > weight_floor * weights.max()).sum()))
            return order[np.linspace(0, inside - 1, near_count).astype(int)]
        too_alike = remote[min(near_count, len(remote)) - 1] < TIGHT
        if too_alike and not far_share:
            # half of them by how much they tell of slopes: their squared distance
            lever = np.cumsum(remote[remote < STEEP])
            half = near_count // 2
            spread = np.searchsorted(lever, lever[-1] * (np.arange(half) + 0.5) / half)
            return order[np.unique(np.r_[: min(half, len(order)), spread])]
        # the nearest, and every so many of the others
        stride = max((len(order) - near_count) // max(self.size - near_count, 1), 1)
        return np.r_[order[:near_count], order[near_count::stride]]

    def _target(self, judged: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean composite judgment of genuine samples (K, P) and its covariance.

        Few samples say little of their own covariance: that of the model's samples, `residual`,
        stands in for 2 P + 10 of them. Where trials have several samples, it is the least that is
        expected, as samples of one trial are alike.
        """
        count = len(judged)
        expected = residual * self.samples_per_trial / count
        own_covariance = np.atleast_2d(np.cov(judged.T)) / count
        if self.samples_per_trial > 1:
            factor = np.linalg.cholesky(expected)
            relative = np.linalg.solve(factor, np.linalg.solve(factor, own_covariance).T)
            values, vectors = np.linalg.eigh(relative)
            own_covariance = factor @ (vectors * np.maximum(values, 1)) @ vectors.T @ factor.T
        prior = 2 * judged.shape[1] + 10
        return judged.mean(axis=0), (prior * expected + count * own_covariance) / (prior + count)

    def distance(
        self,
        likelihood: Likelihood,
        remoteness: np.ndarray,
        leverage: float,
        rng: np.random.Generator,
    ) -> tuple[float, float]:
        """Return how far classifiers tell the model from the agents, and how often by chance.

        The distance is the mean squared miss over classifiers, in standard errors. Chance is how
        often means of samples of the model exceed it.

        The model is the one that composite judgments, predicted for each sample, say; their misses
        are not counted. For `leverage` see `Matched`.
        """
        weights = self.weights(remoteness)
        effective = int(weights.sum() ** 2 / (weights**2).sum())
        nearest = np.argsort(-weights, kind="stable")[:effective]
        outputs = self.counterfeit[nearest]
        offsets = (likelihood.emulator.mean(self.parameters) - likelihood.target)[nearest]
        # a judgment that hardly varies among them says nothing of slopes
        offsets = offsets[:, offsets.std(axis=0) > 0.1]
        # outputs as quadratic functions of the composite judgments, which are 0 for the agents
        terms = np.c_[np.ones(len(offsets)), quadratic_terms(offsets)]
        # slopes of about 1 are expected, bends of about 1/2
        penalty = np.repeat(
            [1e-9, 1.0, 4.0], [1, offsets.shape[1], terms.shape[1] - 1 - offsets.shape[1]]
        )
        inverse = np.linalg.inv(terms.T @ terms + np.diag(penalty))
        coefficients = inverse @ (terms.T @ outputs)
        misses = outputs - terms @ coefficients
        count = max(round(len(self.genuine) / self.samples_per_trial), 2)
        # genuine events may be rare
        spread = self.genuine.std(axis=0) / np.sqrt(self.samples_per_trial)
        scale = np.maximum(misses.std(axis=0), spread) + 1e-9
        slopes = coefficients[1 : 1 + offsets.shape[1]] / scale
        basis = np.linalg.qr(slopes.T)[0]

        def statistic(means: np.ndarray) -> np.ndarray:
            """Return the mean squared miss (N,) of mean outputs (N, J) beside the slopes."""
            means = means / scale
            residuals = means - (means @ basis) @ basis.T
            squares: np.ndarray = (residuals**2).mean(axis=1) * count
            return squares

        # how often each sample is drawn, in each of the simulated means
        samples = len(outputs)
        drawn = (
            rng.integers(samples, size=(MEANS_BY_CHANCE, count))
            + samples * np.arange(MEANS_BY_CHANCE)[:, None]
        )
        counts = np.bincount(drawn.ravel(), minlength=MEANS_BY_CHANCE * samples)
        shares = counts.reshape(MEANS_BY_CHANCE, samples) / count
        uncertain = 1 + count * (inverse[0, 0] + leverage)
        simulated = statistic(shares @ misses) * uncertain
        observed = float(statistic((self.genuine.mean(axis=0) - coefficients[0])[None])[0])
        exceeding = (simulated >= observed).sum()
        return observed, float((1 + exceeding) / (1 + len(simulated)))


def _covariance_of(misses: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the weighted covariance (M, M) of misses (S, M)."""
    covariance: np.ndarray = (misses * weights[:, None]).T @ misses / weights.sum()
    return covariance


def _ridge(
    x: np.ndarray, z: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Regress parameters z (S, P) on outputs x (S, J), with the ridge that predicts best.

    That is by generalized cross-validation (Golub, Heath and Wahba 1979).

    Returns the mean output (J,), coefficients (J, P) and the mean parameter (P,).
    """
    share = weights / weights.sum()
    middle = share @ x
    offset = share @ z
    x = x - middle
    z = z - offset
    weighted = x * weights[:, None]
    values, vectors = np.linalg.eigh(x.T @ weighted)
    values = np.maximum(values, 0)
    projected = vectors.T @ (weighted.T @ z)
    total = weights @ z**2
    effective = weights.sum() ** 2 / (weights**2).sum()
    best = values[-1]
    lowest = np.inf
    for ridge in values[-1] * 10.0 ** np.arange(-7, 1):
        shrunk = projected / (values + ridge)[:, None]
        explained = (shrunk * (2 * projected - values[:, None] * shrunk)).sum(axis=0)
        unexplained = (total - explained) / total
        freedom = 1 - min((values / (values + ridge)).sum() / effective, 0.99)
        score = unexplained.sum() / freedom**2
        if score < lowest:
            best = ridge
            lowest = score
    return middle, vectors @ (projected / (values + best)[:, None]), offset
