"""The walker: a simulator whose likelihood is known, so that an inference can be held against maximum likelihood."""

import numpy as np
from scipy.optimize import minimize

NAMES = ("v0", "tau_v", "sig_v", "tau_w", "gain", "noise", "r_att")
TRUTH = np.array([7.0, 1.5, 2.0, 0.6, 1.5, 0.8, 12.0])
LOW = np.array([0.0, 0.2, 0.0, 0.1, 0.0, 0.0, 0.0])
HIGH = np.array([20.0, 5.0, 6.0, 3.0, 3.0, 3.0, 40.0])
STEPS, INTERVAL = 100, 0.1


def simulate(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a walk (M, 100, 2) of speed and turn rate for each model (M, 7)."""
    v0, tau_v, sig_v, tau_w, gain, noise, _ = np.asarray(parameters, float).T
    keep_v, keep_w = np.exp(-INTERVAL / tau_v), np.exp(-INTERVAL / tau_w)
    shocks = rng.standard_normal((STEPS, 2, len(v0)))
    walk = np.empty((len(v0), STEPS, 2))
    v, w = v0 + sig_v * shocks[0, 0], gain * noise * shocks[0, 1]
    for step in range(STEPS):
        if step:
            v = v0 + (v - v0) * keep_v + sig_v * np.sqrt(1 - keep_v**2) * shocks[step, 0]
            w = w * keep_w + gain * noise * np.sqrt(1 - keep_w**2) * shocks[step, 1]
        walk[:, step, 0], walk[:, step, 1] = v, w
    return walk


def maximum_likelihood(walks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the estimate of v0, tau_v, sig_v, tau_w and gain x noise, and its standard errors, from walks (K, 100, 2)."""
    speed, speed_error = _fit(walks[:, :, 0], walks[:, :, 0].mean())
    turn, turn_error = _fit(walks[:, :, 1], None)
    return np.r_[speed, turn], np.r_[speed_error, turn_error]


def _fit(series: np.ndarray, mean: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Return mean (unless it is 0), time constant and standard deviation of an autoregression, and their standard errors."""

    def loss(free: np.ndarray) -> float:
        """Return minus the logarithm of the likelihood of a mean and two logarithms."""
        center, (tau, spread) = (0.0 if mean is None else free[0]), np.exp(free[-2:])
        d, keep = series - center, np.exp(-INTERVAL / tau)
        shocks, noise = d[:, 1:] - keep * d[:, :-1], spread * np.sqrt(1 - keep**2)
        first = (d[:, 0] ** 2).sum() / (2 * spread**2) + len(d) * np.log(spread)
        return float(first + (shocks**2).sum() / (2 * noise**2) + shocks.size * np.log(noise))

    start = np.r_[[] if mean is None else mean, 0.0, np.log(series.std())]
    options = {"xatol": 1e-6, "fatol": 1e-7, "maxiter": 4000}
    best = minimize(loss, start, method="Nelder-Mead", options=options).x
    steps = np.eye(len(best)) * 1e-3
    curvature = [
        [
            loss(best + a + b) - loss(best + a - b) - loss(best - a + b) + loss(best - a - b)
            for a in steps
        ]
        for b in steps
    ]
    errors = np.sqrt(np.diag(np.linalg.inv(np.array(curvature) / 4e-6)))
    values = np.r_[best[:-2], np.exp(best[-2:])]
    return values, errors * np.r_[np.ones(len(best) - 2), values[-2:]]
