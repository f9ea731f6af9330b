"""How large a search is."""

import math
from dataclasses import dataclass

from turing_learning.config import ConfigurationError, require_whole_cycles
from turing_learning.swarm import Scenario

MOST_CONTROLLERS = 1_000_000
"""On the whole grid; their costs are kept in memory."""
LONGEST_S = 3600.0
LARGEST_TRIALS = 100_000
SEMIFINALISTS = 20
"""Controllers of the second round, for each of the last one."""


@dataclass(frozen=True)
class Round:
    """One round of a search: the best so far, in fresh trials."""

    controllers: int
    trials: int


@dataclass(frozen=True)
class SearchSettings:
    """How large a search is.

    Parameters
    ----------
    steps
        Settings of each wheel speed, from -1 to 1; >= 2.
    trials
        Of each controller on the grid in the first round, the screening; >= 1.
    finalists
        Controllers of the last round; >= 1.
    final_trials
        Of each of them; >= `trials`.
    duration_s
        Of a trial (s); at most 3600, and a whole number of control intervals.
    seed
        Of initial poses and wheel noise; >= 0.

    Raises
    ------
    ConfigurationError
        If a number breaks its rule.

    Source
    ------
    Steps and duration: Gauci et al. 2014, Int. J. Robotics Research 33, as far as is known; docs/decisions/0016.
    """

    steps: int = 21
    trials: int = 1
    finalists: int = 50
    final_trials: int = 100
    duration_s: float = 180.0
    seed: int = 1

    def __post_init__(self) -> None:
        for name, least, most in (
            ("steps", 2, MOST_CONTROLLERS),
            ("trials", 1, LARGEST_TRIALS),
            ("finalists", 1, MOST_CONTROLLERS),
            ("final_trials", self.trials, LARGEST_TRIALS),
            ("seed", 0, 2**63 - 1),
        ):
            value = getattr(self, name)
            if type(value) is not int or not least <= value <= most:
                raise ConfigurationError(f"`{name}` must be an integer from {least} to {most}; got {value!r}.")
        if not 0 < self.duration_s <= LONGEST_S:
            raise ConfigurationError(
                f"`duration` must be above 0 and at most {LONGEST_S:g} s; got {self.duration_s:g}."
            )

    def check(self, scenario: Scenario) -> None:
        """Refuse a grid that is too large for a scenario, or trials that do not fit its control cycles.

        Raises
        ------
        ConfigurationError
            If one does not.
        """
        speeds = len(scenario.controller)
        if self.steps**speeds > MOST_CONTROLLERS:
            raise ConfigurationError(
                f"`steps` must give at most {MOST_CONTROLLERS} controllers; got {self.steps}, which gives "
                f"{self.steps}^{speeds} in scenario {scenario.name!r}. Choose fewer steps."
            )
        shortest = max(1.0, scenario.trial.control_interval_s)
        if self.duration_s < shortest:
            raise ConfigurationError(f"`duration` must be at least {shortest:g} s; got {self.duration_s:g}.")
        require_whole_cycles(scenario, self.duration_s)

    def rounds(self, controllers: int) -> tuple[Round, ...]:
        """Return the rounds of a search among that many controllers: all, the better ones in more trials, the finalists."""
        between = math.isqrt(self.trials * self.final_trials)
        sizes = (controllers, min(controllers, SEMIFINALISTS * self.finalists), min(controllers, self.finalists))
        trials = (self.trials, between, self.final_trials)
        return tuple(Round(*one) for one in zip(sizes, trials, strict=True))
