"""A mixture of normal distributions, fitted to the speeds: no simulation, but much to be known beforehand."""

import numpy as np

from turing_learning.swarm import Scenario

from ._groups import Inferred, baseline, wheel_speeds

CYCLES = 50_000
"""Most cycles that are looked at: the estimate hardly changes with more."""
SPARE = 1
"""Components beyond the sensor states, for collisions."""


def fit_mixture(genuine: np.ndarray, scenario: Scenario, seed: int) -> Inferred:
    """Infer a reactive behavior from the levels of its wheel speeds; the rarest level is that of the last sensor state.

    Parameters
    ----------
    genuine : (K, T, 2)
        Motion of the agents.
    scenario
        Tells the wheels and the number of sensor states, not the controller.
    seed
        Of the cycles that are looked at and of the first components.

    Returns
    -------
    Inferred
        Centers of the heaviest components, in the order of their weights.

    Raises
    ------
    ImportError
        If scikit-learn is not installed.
    """
    wheels = wheel_speeds(genuine, scenario).reshape(-1, 2)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(wheels, min(len(wheels), CYCLES), replace=False)
    states = scenario.sensor.states
    mixture = baseline("sklearn.mixture").GaussianMixture(states + SPARE, n_init=3, random_state=seed).fit(chosen)
    heaviest = np.argsort(-mixture.weights_)[:states]
    return Inferred(mixture.means_[heaviest].ravel())
