"""A laboratory as a source of samples: what it does when a trial is disturbed."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.coevolution import Samples
from turing_learning.swarm import Scenario
from turing_learning.systems import Source

from ._equipment import Equipment
from ._setup import LaboratorySetup
from ._states import BEGIN, REMOTE, Disturbance, ObservedTrial, PcProgram

LARGEST = -1.0, 1.0  # wheel speeds, as fractions of the largest
TRIALS_OF_A_GENERATION = 10  # of the paper: in how many batteries lose what one generation costs them
PAUSE_S, LONGEST_PAUSE_S = 2.0, 8.0  # before links are reopened, twice as long each time; the longest pause
_LOGGER = logging.getLogger(__name__)


@dataclass(frozen=True)
class Event:
    """What happened in a laboratory."""

    #: "state": the program enters a state; "trial": a trial was confirmed, or disturbed; "disturbed": a
    #: trial is repeated; "batteries": they are replaced; "complete": all trials are observed; "moving": replicas could
    #: not be halted
    kind: str
    stage: str  #: The generation, or which post-evaluation
    #: At the first trial of this stage, from 1; a later trial that is repeated belongs to the same attempt
    attempt: int
    state: str  #: "P1" to "P5" of the program, "P0" while connecting
    fault: str = ""  #: What was wrong; empty unless "disturbed"
    asked: str = ""  #: What the operator was asked to do; empty if nobody was asked
    trial: ObservedTrial | None = None  #: The trial, of the kind "trial"


class LaboratorySource(Source):
    """Samples of real agents and of replicas among them, in trials of all models (paper, sections 5.2 and 5.3).

    A disturbed trial is not used but repeated: at once where only images were lost; else after links and camera
    have been reopened. The operator is asked where an intervention is needed, or what may pass does not. A
    context manager.

    Parameters
    ----------
    setup, scenario, equipment
        The laboratory; of the trials their length, and the robots; its devices.
    watch
        Called with every event.
    stored
        Stage -> number of its attempts in earlier sessions, and trials of the last one: they are not executed again.
    spent
        Of a run of trials: number of its batches -> trials that these spend.
    """

    generation: int = 0  #: Number of the generation, or batch, that is collected next; set by the run

    def __init__(
        self, setup: LaboratorySetup, scenario: Scenario, equipment: Equipment, *,
        watch: Callable[[Event], None] = lambda event: None,
        stored: Callable[[str], tuple[int, Sequence[ObservedTrial]]] = lambda stage: (0, ()),
        spent: Callable[[int], int] | None = None,
    ) -> None:  # fmt: skip
        self._setup, self._equipment, self._watch, self._stored = setup, equipment, watch, stored
        self._stage, self._attempt = "", 0
        self._fresh_at = 0  # the generation at whose beginning batteries were fresh
        self._spent = spent
        self.together, self.ends = len(setup.replicas), LARGEST if spent else None
        self._program = PcProgram(setup, scenario, equipment, self._follow)

    def close(self) -> None:
        """Halt the replicas, if they were to be reached in this session, and close links and camera. The log, and an event, name
        those that do not answer: they may still be moving.
        """
        try:
            self._program.halt()
        finally:
            self._program.disconnect()
            if self._program.moving:
                fault = f"robots are still moving: {', '.join(sorted(self._program.moving))}"
                _LOGGER.warning("%s. Switch them off.", fault)
                self._tell("moving", self._program.state, fault, "Switch them off.")

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the wheel speeds (M, P), fractions of the maximum, of models (M, P) as the optimizer has them: their hyperbolic
        tangent (paper, section 5.3), except in a run of trials, whose search ends at the largest speeds.
        """
        return models if self.ends else np.tanh(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples of the agents in all trials (trials x agents, T, 2), and one of each model (M, 1, T, 2); raise
        `LaboratoryError` if an operator is needed and nobody answers.
        """
        name = f"{'batch' if self._spent else 'generation'}-{self.generation:04d}"
        every, number, spent = self._setup.interventions.batteries_every, self.generation, self._spent
        begun, before = (number, number - 1) if spent is None else (spent(number), spent(number - 1))
        every *= 1 if spent is None else TRIALS_OF_A_GENERATION
        if every and number != self._fresh_at and begun // every != before // every:
            self._stage, self._attempt, self._fresh_at = name, 0, number
            self._program.disconnect()
            todo = f"Replace the batteries of all robots; then {REMOTE}."
            self._tell("batteries", BEGIN, asked=todo)
            self._equipment.operator.ask(todo)
        return self.observe(self.to_units(models), name)

    def observe(self, speeds: np.ndarray, stage: str) -> Samples:
        """Return samples of models (M, P) in wheel speeds; see `collect`."""
        rounds = np.round(speeds, 4).reshape(-1, len(self._setup.replicas), speeds.shape[1])
        self._stage, (self._attempt, known) = stage, self._stored(stage)
        same = [np.array_equal(trial.models, models) for trial, models in zip(known, rounds, strict=False)]
        trials, wanted = list(known[: [*same, False].index(False)]), len(rounds)
        tries, since_s, before = 0, 0.0, 0  # at the same trial: how often disturbed, and since when
        while len(trials) < wanted:
            self._attempt += not trials
            try:
                if not self._program.connected:
                    self._program.connect()
                self._program.run(speeds, trials)
            except Disturbance as disturbance:
                now_s = self._equipment.clock.now()
                if not tries or len(trials) > before:
                    tries, since_s, before = 0, now_s, len(trials)
                tries += 1
                ask = tries > disturbance.tries and now_s - since_s >= disturbance.patience_s
                remedy, state = f"{disturbance.remedy.rstrip('.')}.", disturbance.state
                self._tell("disturbed", state, disturbance.fault, remedy if ask else "")
                if disturbance.connected and not ask:
                    continue
                self._program.disconnect()
                pause_s = min(PAUSE_S * 2 ** (tries - 1), LONGEST_PAUSE_S)
                if ask:
                    again, tries, pause_s = "" if state == BEGIN else " The trial will be repeated.", 0, PAUSE_S
                    fault = f"{disturbance.fault[0].upper()}{disturbance.fault[1:]}".rstrip(".")
                    self._equipment.operator.ask(f"{fault}.{again} {remedy}")
                self._equipment.clock.sleep(pause_s)
        self._tell("complete", self._program.state)
        speeds_seen = np.array([trial.track.speeds() for trial in trials])
        return trial_samples(speeds_seen, len(self._setup.replicas))

    def _follow(self, what: str | ObservedTrial) -> None:
        trial = None if isinstance(what, str) else what
        self._tell("trial" if trial else "state", self._program.state, trial=trial)

    def _tell(
        self, kind: str, state: str, fault: str = "", asked: str = "", trial: ObservedTrial | None = None
    ) -> None:
        self._watch(Event(kind, self._stage, self._attempt, state, fault, asked, trial))


def trial_samples(speeds: np.ndarray, replicas: int) -> Samples:
    """Return the samples of R trials with speeds (R, A, T, 2), agents first: of agents (R x agents, T, 2), of
    models (R x replicas, 1, T, 2)."""
    steps = speeds.shape[2:]
    return Samples(speeds[:, :-replicas].reshape(-1, *steps), speeds[:, -replicas:].reshape(-1, 1, *steps))
