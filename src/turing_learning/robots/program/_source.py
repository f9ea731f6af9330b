"""The program of the PC: its five states, what moves it from one to the next, and what it does when a trial is disturbed."""

import logging
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Self, TypeVar

import numpy as np

from turing_learning.coevolution import Samples
from turing_learning.errors import require
from turing_learning.purposes import CLOCKS
from turing_learning.robots._link import LARGEST_SEQUENCE, PARAMETER_UNIT, Model, Replica, Signal
from turing_learning.robots.tracking._tracker import (
    CARRIED,
    IRREGULAR,
    MISSING,
    SURPLUS,
    Fault,
    Track,
    impossible,
)
from turing_learning.swarm import Scenario
from turing_learning.systems import Source

from ._equipment import Equipment, PoseSource, fastest_turn
from ._phases import told_by_phase
from ._plausible import TrackCheck
from ._setup import LaboratoryError, LaboratorySetup

BEGIN = "P0"  #: Before the states P1 to P5: connecting
STUCK = "stuck"  #: Kind of fault of a robot that does not move although it should
TURN_RAD = 0.1
#: A model that must turn a robot so far in the track, in every sensor state, cannot stand
SURE_TURN_RAD = 0.5
#: How often the program tries again alone after a missed signal, or where the camera gives no
#: images
TRIES_ALONE = 2
#: How often after lost images: of 51 images, 1 % lost, two trials in five have a gap
IMAGES_ALONE = 10
#: How long a lost link is retried: as long as Bluetooth needs to reconnect
RECONNECT_S = 30.0
#: If at least this share of the robots jumps in one image, it was the camera that moved
MOST_JUMPED = 0.6
_POLL_S = 0.05
_LISTED = 3  #: Faults of a trial that are listed for the operator
REMOTE = "put all robots in their places, and press the remote control"
State = Callable[[], "State | None"]
Answer = TypeVar("Answer")


@dataclass(eq=False)
class Disturbance(Exception):
    """A trial cannot be used: in which state ("P0" while connecting), what happened, and what the operator has to do.

    Before that the program tries again alone `tries` times, and for `patience_s` at least. `connected`: links
    and camera are good.
    """

    state: str
    fault: str
    remedy: str
    tries: int = 0
    patience_s: float = 0.0
    connected: bool = False


@dataclass(frozen=True, eq=False)
class ObservedTrial:
    """What was observed in one trial."""

    number: int  #: In its generation, from 0
    #: (R, P): Wheel speeds that the replicas executed, fractions of the maximum
    models: np.ndarray
    sequences: tuple[int, ...]  #: Sequence numbers of these models
    counts: tuple[int, ...]  #: The replicas' own counts of trials
    started_s: float  #: Time of START, by the clock
    track: Track  #: Agents first, then replicas
    #: What makes it useless: the tracker's faults, and robots that are stuck; for the operator
    faults: tuple[str, ...]

    @classmethod
    def of(cls, number: int, arrays: Mapping[str, np.ndarray]) -> Self:
        """Return a trial without faults from its `arrays`."""
        labels = tuple(arrays["labels"].tolist())
        track = Track(arrays["poses"], arrays["present"], labels, float(arrays["interval_s"]))
        return cls(
            number=number,
            models=arrays["models"],
            sequences=tuple(arrays["sequences"].tolist()),
            counts=tuple(arrays["counts"].tolist()),
            started_s=float(arrays["started_s"]),
            track=track,
            faults=(),
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """Return what a file holds of a trial; its name says the number."""
        return {
            "poses": self.track.poses,
            "present": self.track.present,
            "labels": np.array(self.track.labels),
            "interval_s": np.array(self.track.interval_s),
            "models": self.models,
            "sequences": np.array(self.sequences, dtype=np.int64),
            "counts": np.array(self.counts, dtype=np.int64),
            "started_s": np.array(self.started_s),
            "faults": np.array(self.faults, dtype=np.str_),
        }


class PcProgram:
    """Run trials in step with the replicas (paper, section 5.2).

    `watch` is called with the name of every state that is entered, and with every trial: when STOP has
    confirmed it, or it was disturbed. `moving` are the robots with an address that were to be reached in this
    session, and have not been halted since.
    """

    def __init__(
        self, setup: LaboratorySetup, scenario: Scenario, equipment: Equipment,
        watch: Callable[[str | ObservedTrial], None] = lambda event: None,
    ) -> None:  # fmt: skip
        self._setup = setup
        self._timing = setup.timing
        self._scenario = scenario
        names = [replica.name for replica in setup.replicas]
        self._check = TrackCheck(scenario.robot, names, scenario.arena)
        self._equipment = equipment
        self._clock = equipment.clock
        self._watch = watch
        self._robots: dict[str, Replica] = {}
        self._poses: PoseSource | None = None
        # So that nobody has to press a remote control
        self._starts_all = all(robot.address for robot in setup.robots)
        self._in_step = True
        self._sequence = 0
        self.state = BEGIN
        self.moving: set[str] = set()
        self.disconnect()

    def disconnect(self) -> None:
        """Close links and tracker, and forget the trials that were not returned."""
        for robot in self._robots.values():
            robot.close()
        if self._poses is not None:
            self._poses.close()
        self._robots = {}
        self._poses = None
        self._queue: deque[np.ndarray] = deque()
        self._sent: dict[str, Model] = {}
        self._starts: dict[str, Signal] = {}
        self._counts: dict[str, int] = {}
        self._done: list[ObservedTrial] = []
        # The trial that waits for its STOP
        self._observed: ObservedTrial | None = None
        self._send_until = -np.inf

    def _enter(self, state: str) -> None:
        self.state = state
        self._watch(state)

    @property
    def connected(self) -> bool:
        return self._poses is not None

    def connect(self) -> None:
        """Open links and tracker, and start the robots if all have addresses and one has not begun, or is out of step."""
        self._enter(BEGIN)
        self.moving = {robot.name for robot in self._setup.linked}
        for robot in self._setup.linked:
            try:
                opened = self._robots[robot.name] = self._equipment.replica(str(robot.address))
                status = opened.status()
            except OSError as error:
                raise self._lost(robot.name, str(error)) from error
            if status.state == "R0" and not self._starts_all:
                raise Disturbance(
                    BEGIN, f"{robot.role} {robot.name} has not begun", REMOTE.capitalize()
                )
            self._in_step &= status.state != "R0"
            self._sequence = max(self._sequence, status.waiting + 1, status.executing + 1)
        try:
            self._poses = self._equipment.tracker()
        except OSError as error:
            raise Disturbance(BEGIN, str(error), "Connect the camera", tries=TRIES_ALONE) from error
        if not self._in_step:
            for name, opened in self._robots.items():
                self._guard(name, opened.start)
            self._await_beginning()
            self._in_step = True

    def _await_beginning(self) -> None:
        """Take the STOP with which R1 begins of all robots that were started.

        One that came later, because its control cycle did, would be taken for the end of a trial, a loop before the
        others'.
        """
        for name, robot in self._robots.items():
            try:
                robot.wait_for("STOP", self._timing.tolerance_s)
            except TimeoutError:
                continue
            except OSError as error:
                raise self._lost(name, str(error)) from error

    def halt(self) -> None:
        """Halt all robots that are `moving`, as far as is known; a lost link is reopened. Those that do not answer stay there."""
        for robot in self._setup.linked:
            if robot.name in self.moving:
                with suppress(OSError):
                    if robot.name not in self._robots:
                        self._robots[robot.name] = self._equipment.replica(str(robot.address))
                    self._robots[robot.name].halt()
                    self.moving.remove(robot.name)

    def run(
        self, models: np.ndarray, done: list[ObservedTrial] | None = None
    ) -> list[ObservedTrial]:
        """Let models (M, P), wheel speeds, be executed, one by each replica in a trial; return the trials.

        Trials are appended to `done`, and models of the trials in it not executed again: give it again after a
        `Disturbance`.
        """
        self._done = [] if done is None else done
        self._queue = deque(
            models.reshape(-1, len(self._setup.replicas), models.shape[1])[len(self._done) :]
        )
        state: State | None = self._wait_for_stop
        while state is not None:
            state = state()
        return self._done

    def _wait_for_stop(self) -> State | None:
        """P1: wait until a trial is over. STOP confirms the one that was tracked; without one, any STOP will do."""
        self._enter("P1")
        timing = self._timing
        if self._starts:
            end_s = (
                max(start.received_s for start in self._starts.values())
                + timing.wait_s
                + timing.execute_s
            )
            try:
                counts = {name: start.trial for name, start in self._starts.items()}
                stops = self._signals("STOP", end_s - self._clock.now(), counts)
            except Disturbance as disturbance:
                if self._observed is not None:
                    self._watch(replace(self._observed, faults=(disturbance.fault,)))
                raise
        elif self._clock.now() > self._send_until:
            for name, robot in self._robots.items():
                self._guard(name, robot.drop_signals)
            # one that stood in R5 leaves its next STOP out
            stops = self._signals("STOP", timing.loop_s + timing.execute_s)
        else:
            stops = {}
        if self._observed is not None:
            self._done.append(self._observed)
            self._queue.popleft()
            self._watch(self._observed)
            self._observed = None
        if stops:
            self._starts = {}
            self._counts = {name: stop.trial for name, stop in stops.items()}
            first_stop_s = min(stop.received_s for stop in stops.values())
            self._send_until = first_stop_s + timing.wait_s + timing.disperse_s - timing.tolerance_s
        return self._send_models if self._queue else None

    def _send_models(self) -> State:
        """P2: put a model into the buffer of each replica."""
        self._enter("P2")
        models = dict(
            zip([replica.name for replica in self._setup.replicas], self._queue[0], strict=True)
        )
        for name, robot in self._robots.items():
            if name in models:
                model = Model(
                    self._sequence % (LARGEST_SEQUENCE + 1),
                    tuple(np.round(models[name], 4).tolist()),
                )
                self._sequence = model.sequence + 1
                self._guard(name, partial(robot.send_model, model))
                self._sent[name] = model
            if not self._guard(name, robot.status).battery_ok:
                remedy = f"Change the battery of {self._called(name)}; then {REMOTE}"
                raise Disturbance("P2", f"{self._called(name)} has a low battery", remedy)
        return self._wait_for_start

    def _wait_for_start(self) -> State:
        """P3: wait until a trial begins, with the models that were sent."""
        self._enter("P3")
        timing = self._timing
        start_s = self._send_until + timing.tolerance_s + timing.wait_s
        counts = {}
        for name, count in self._counts.items():
            counts[name] = (count + 1) % (LARGEST_SEQUENCE + 1)
        self._starts = self._signals("START", start_s - self._clock.now(), counts)
        return self._track_robots

    def _track_robots(self) -> State:
        """P4: follow everybody in the middle of the trial."""
        self._enter("P4")
        assert self._poses is not None
        timing = self._timing
        length_s = self._scenario.trial.duration_s
        started_s = max(start.received_s for start in self._starts.values())
        spare_s = timing.execute_s - length_s
        # Each trial is observed up to half a control cycle earlier or later. Otherwise a robot would be
        # seen at the same phase of its cycle in every trial, and could be recognized by it. The shift
        # follows from the models, so that a repeated trial has the same one.
        sent = np.concatenate([model.parameters for model in self._sent.values()])
        key = np.rint((sent + 1) / PARAMETER_UNIT).astype(int).tolist()
        moment = float(np.random.default_rng([CLOCKS, *key]).uniform(-0.5, 0.5))
        begin_s = (
            started_s
            + timing.wait_s
            + spare_s / 2
            + moment * min(self._scenario.trial.control_interval_s, spare_s)
        )
        try:
            track = self._poses.track(begin_s, self._scenario.control_steps + 1)
        except OSError as error:
            raise Disturbance(
                "P4", str(error), "Look after the camera", tries=TRIES_ALONE
            ) from error
        expected = (self._scenario.control_steps + 1, len(self._setup.labels), 3)
        fits = (
            track.poses.shape == expected
            and np.isfinite(track.poses).all()
            and track.present.shape == expected[:2]
        )
        got = f"{track.poses.shape} and present {track.present.shape}"
        rule = f"give poses {expected}, all finite, and present {expected[:2]}"
        require(fits, "tracker", rule, got)
        track = track.bridged()
        faults = track.faults or impossible(track, self._scenario.robot, self._scenario.arena)
        return partial(self._update, replace(track, faults=faults), started_s)

    def _update(self, track: Track, started_s: float) -> State:
        """P5: continue unless the trial was disturbed, which is reported at once. The generation is judged when it is complete."""
        self._enter("P5")
        models = np.array([model.parameters for model in self._sent.values()])
        if wrong := self._check.fault(track, models):
            raise LaboratoryError(
                f"{wrong} Then begin the run anew: what its trials have shown may be wrong."
            )
        sequences = tuple(model.sequence for model in self._sent.values())
        counts = tuple(self._starts[name].trial for name in self._sent)
        # The fastest turn is that of wheel speeds 1 and -1: this is for a difference of 1
        turn = fastest_turn(self._scenario.robot) / 2
        stuck: tuple[Fault, ...] = ()
        if not track.faults:
            stuck = stuck_robots(track, models, self._setup.interventions.stuck_cm, turn)
        faults = tuple(fault.text for fault in (*track.faults, *stuck))
        trial = ObservedTrial(len(self._done), models, sequences, counts, started_s, track, faults)
        irregular = any(fault.kind == IRREGULAR for fault in track.faults)
        if trial.faults:
            self._watch(trial)
            listed = [f"{text[0].upper()}{text[1:]}" for text in trial.faults[:_LISTED]]
            if unlisted := len(trial.faults) - len(listed):
                listed.append(
                    f"And {unlisted} more; if they are of nearly all robots, look after the camera and the PC."
                )
            cause = "camera and the PC:" if irregular else "robots:"
            remedy = f"Look after the {cause} {' '.join(listed)} Then {REMOTE}"
            passing = irregular or passes(track, stuck)
            tries = IMAGES_ALONE if passing else 0
            raise Disturbance("P5", trial.faults[0], remedy, tries=tries, connected=bool(passing))
        self._observed = trial
        return self._wait_for_stop

    def _signals(
        self, awaited: str, expected_s: float, counts: Mapping[str, int] | None = None
    ) -> dict[str, Signal]:
        """Wait for a signal of each robot, of the trials by their `counts` if given, and with the models that were sent."""
        deadline = self._clock.now() + max(expected_s, 0.0) + self._timing.tolerance_s
        signals: dict[str, Signal] = {}
        while silent := [name for name in self._robots if name not in signals]:
            for name in silent:
                try:
                    signals[name] = self._robots[name].wait_for(awaited, _POLL_S)
                except TimeoutError:
                    continue
                except OSError as error:
                    raise self._lost(name, str(error)) from error
            if self._clock.now() > deadline and len(signals) < len(self._robots):
                silent = [name for name in silent if name not in signals]
                raise self._missed(f"{awaited} has not come from {', '.join(silent)}")
        # Replicas of one trial must begin together, as their samples are of the same time
        times = [signal.received_s for signal in signals.values()]
        if (apart := max(times) - min(times)) > self._timing.tolerance_s:
            self._in_step = not self._starts_all
            tries = TRIES_ALONE if self._starts_all else 0
            fault = f"the replicas are {apart:.1f} s out of step"
            raise Disturbance(self.state, fault, REMOTE.capitalize(), tries=tries)
        # An older signal, still on the line, is none of this trial
        for name, count in (counts or {}).items():
            signal = signals[name]
            if signal.trial != count:
                came = f"{awaited} of trial {signal.trial} has come from {name}"
                raise self._missed(f"{came}, {count} was expected: one was missed")
            model = signal.sequence
            if name in self._sent:
                model = self._sent[name].sequence
            if signal.sequence != model:
                raise self._missed(
                    f"replica {name} executes model {signal.sequence}, {model} was sent"
                )
        return {name: signals[name] for name in self._robots}

    def _guard(self, name: str, exchange: Callable[[], Answer]) -> Answer:
        """Use a replica's link; one that had to be reopened counts as lost."""
        robot = self._robots[name]
        before = robot.reconnections
        try:
            answer = exchange()
        except OSError as error:
            raise self._lost(name, str(error)) from error
        if robot.reconnections > before:
            raise self._lost(name, "it has come back")
        return answer

    def _lost(self, name: str, how: str) -> Disturbance:
        fault = f"the link to {self._called(name)} is lost ({how.rstrip('.')})"
        remedy = f"Switch {self._called(name)} on, and see to its link; then {REMOTE}"
        return Disturbance(self.state, fault, remedy, tries=TRIES_ALONE, patience_s=RECONNECT_S)

    def _called(self, name: str) -> str:
        return next(f"{robot.role} {name}" for robot in self._setup.robots if robot.name == name)

    def _missed(self, fault: str) -> Disturbance:
        return Disturbance(
            self.state,
            fault,
            f"See to the replicas and their links; then {REMOTE}",
            tries=TRIES_ALONE,
        )


def passes(track: Track, stuck: Sequence[Fault]) -> bool:
    """Return whether all faults of a trial are of images alone: gaps that ended, or a jump of nearly all robots."""
    jumps = Counter(fault.frame for fault in track.faults if fault.kind in (CARRIED, SURPLUS))
    jumped = {frame for frame, number in jumps.items() if number >= MOST_JUMPED * len(track.labels)}
    gaps = [fault for fault in track.faults if fault.frame not in jumped]
    seen, everybody = track.present.sum(axis=1).tolist(), len(track.labels)
    # the first or the last image may be lost, too
    begun = seen[0] == everybody or seen[:2] == [0, everybody]
    ended = seen[-1] == everybody or seen[-2:] == [everybody, 0]
    of_images = begun and ended and all(fault.kind == MISSING for fault in gaps)
    return bool(track.faults) and not stuck and bool(jumped or of_images)


def stuck_robots(
    track: Track, models: np.ndarray, least_cm: float, full_turn_rad_s: float
) -> tuple[Fault, ...]:
    """Return a fault for each robot that neither moved `least_cm` nor turned 0.1 rad in a track.

    Of replicas, the last ones, only those of models (R, 2 n) that turn in every sensor state must move: others
    may stand, or push.
    """
    moved = np.ptp(track.poses[..., :2], axis=0).max(axis=-1)
    turned = np.ptp(np.unwrap(track.poses[..., 2], axis=0), axis=0)
    pairs = models.reshape(len(models), -1, 2)
    turns = (
        np.abs(pairs[..., 0] - pairs[..., 1])
        * full_turn_rad_s
        * track.interval_s
        * (len(track.poses) - 1)
    )
    must = np.ones(len(track.labels), bool)
    must[len(must) - len(models) :] = (turns >= SURE_TURN_RAD).all(axis=1)
    faults = []
    for who in np.nonzero(must & (moved < least_cm) & (turned < TURN_RAD))[0].tolist():
        x, y, _ = track.poses[-1, who]
        text = f"individual {who} ({track.labels[who]}) has not moved from x, y = {x:.1f}, {y:.1f} cm: it is stuck"
        faults.append(Fault(0, STUCK, text + ", or its battery is empty. Free it."))
    return tuple(faults)


WHEEL_SPEED_RANGE = -1.0, 1.0  # as fractions of the largest
# of the paper: in how many batteries lose what one generation costs them
TRIALS_OF_A_GENERATION = 10
# Before links are reopened, twice as long each time; the longest pause
PAUSE_S, LONGEST_PAUSE_S = (2.0, 8.0)
_LOGGER = logging.getLogger(__name__)


@dataclass(frozen=True)
class Event:
    """What happened in a laboratory."""

    #: "state": the program enters a state; "trial": a trial was confirmed, or disturbed; "disturbed": a
    #: trial is repeated; "batteries": they are replaced; "complete": all trials are observed; "halted": who was
    #: halted at the end, and who has no address; "moving": who could not be halted
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
        Stage -> number of its attempts in earlier sessions, and trials of the last one: they are not executed
        again.
    spent
        Of a run of trials: number of its batches -> trials that these spend.
    """

    #: Number of the generation, or batch, that is collected next; set by the run
    generation: int = 0
    whole_batches = True

    def __init__(
        self, setup: LaboratorySetup, scenario: Scenario, equipment: Equipment, *,
        watch: Callable[[Event], None] = lambda event: None,
        stored: Callable[[str], tuple[int, Sequence[ObservedTrial]]] = lambda stage: (0, ()),
        spent: Callable[[int], int] | None = None,
    ) -> None:  # fmt: skip
        self._setup = setup
        self._robot = scenario.robot
        self._equipment = equipment
        self._watch = watch
        self._stored = stored
        self._stage = ""
        self._attempt = 0
        # The generation at whose beginning batteries were fresh
        self._fresh_at = 0
        self._spent = spent
        self.together = len(setup.replicas)
        self.ends = WHEEL_SPEED_RANGE if spent else None
        self._program = PcProgram(setup, scenario, equipment, self._follow)

    def close(self) -> None:
        """Halt the robots with an address, if they were to be reached in this session, and close links and camera.

        Events name those that were halted, and those that may still be moving, as they do not answer or have no
        address. The log names those that do not answer.
        """
        program = self._program
        reached = set(program.moving)
        try:
            program.halt()
        finally:
            program.disconnect()
            if reached:
                halted = ", ".join(sorted(reached - program.moving)) or "none"
                without = [robot.name for robot in self._setup.robots if not robot.address]
                todo = ""
                if without:
                    todo = f"Without an address, and perhaps still moving: {', '.join(without)}. Stop them by hand."
                self._tell("halted", program.state, f"robots halted: {halted}", todo)
            if program.moving:
                fault = f"robots are still moving: {', '.join(sorted(program.moving))}"
                _LOGGER.warning("%s. Switch them off.", fault)
                self._tell("moving", program.state, fault, "Switch them off.")

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the wheel speeds (M, P), fractions of the maximum, of models (M, P) as the optimizer has them:
        their hyperbolic tangent (paper, section 5.3), except in a run of trials, whose search ends at the
        largest speeds.
        """
        return models if self.ends else np.tanh(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples of the agents in all trials (trials x agents, T, 2), and one of each model (M, 1, T,
        2); raise `LaboratoryError` if an operator is needed and nobody answers.
        """
        number = self.generation
        name = f"generation-{number:04d}"
        every = self._setup.interventions.batteries_every
        begun = number
        before = number - 1
        if self._spent is not None:
            # batches have different numbers of trials: these are counted, as if in generations
            name = f"batch-{number:04d}"
            every *= TRIALS_OF_A_GENERATION
            begun = self._spent(number)
            before = self._spent(number - 1)
        if every and number != self._fresh_at and begun // every != before // every:
            self._stage = name
            self._attempt = 0
            self._fresh_at = number
            self._program.disconnect()
            todo = f"Replace the batteries of all robots; then {REMOTE}."
            self._tell("batteries", BEGIN, asked=todo)
            self._equipment.operator.ask(todo)
        return self.observe(self.to_units(models), name)

    def observe(self, speeds: np.ndarray, stage: str) -> Samples:
        """Return samples of models (M, P) in wheel speeds; see `collect`."""
        rounds = np.round(speeds, 4).reshape(-1, len(self._setup.replicas), speeds.shape[1])
        self._stage = stage
        self._attempt, stored = self._stored(stage)
        trials = []
        # trials of before count as far as they are of the same models
        for trial, sent in zip(stored, rounds, strict=False):
            if not np.array_equal(trial.models, sent):
                break
            trials.append(trial)
        wanted = len(rounds)
        # At the same trial: how often disturbed, and since when
        tries, since_s, before = 0, 0.0, 0
        while len(trials) < wanted:
            self._attempt += not trials
            try:
                if not self._program.connected:
                    self._program.connect()
                self._program.run(speeds, trials)
            except Disturbance as disturbance:
                now_s = self._equipment.clock.now()
                if not tries or len(trials) > before:
                    tries = 0
                    since_s = now_s
                    before = len(trials)
                tries += 1
                ask = tries > disturbance.tries and now_s - since_s >= disturbance.patience_s
                remedy = f"{disturbance.remedy.rstrip('.')}."
                state = disturbance.state
                asked = remedy if ask else ""
                self._tell("disturbed", state, disturbance.fault, asked)
                if disturbance.connected and not ask:
                    continue
                self._program.disconnect()
                pause_s = min(PAUSE_S * 2 ** (tries - 1), LONGEST_PAUSE_S)
                if ask:
                    again = "" if state == BEGIN else " The trial will be repeated."
                    tries = 0
                    pause_s = PAUSE_S
                    fault = f"{disturbance.fault[0].upper()}{disturbance.fault[1:]}".rstrip(".")
                    self._equipment.operator.ask(f"{fault}.{again} {remedy}")
                self._equipment.clock.sleep(pause_s)
        self._tell("complete", self._program.state)
        speeds_seen = np.array([trial.track.speeds() for trial in trials])
        return trial_samples(speeds_seen, len(self._setup.replicas))

    def told_by_phases(
        self, genuine: np.ndarray, estimate: np.ndarray, samples: np.ndarray, models: np.ndarray
    ) -> bool:
        """Say whether agents and replicas act at different phases of a control cycle."""
        agents = np.tile(self.to_units(estimate), (len(genuine), 1))
        return told_by_phase(genuine, agents, samples, self.to_units(models), self._robot)

    def _follow(self, event: str | ObservedTrial) -> None:
        trial = None if isinstance(event, str) else event
        self._tell("trial" if trial else "state", self._program.state, trial=trial)

    def _tell(
        self,
        kind: str,
        state: str,
        fault: str = "",
        asked: str = "",
        trial: ObservedTrial | None = None,
    ) -> None:
        self._watch(Event(kind, self._stage, self._attempt, state, fault, asked, trial))


def trial_samples(speeds: np.ndarray, replicas: int) -> Samples:
    """Return the samples of R trials with speeds (R, A, T, 2), agents first: of agents (R x agents, T, 2), of
    models (R x replicas, 1, T, 2)."""
    steps = speeds.shape[2:]
    return Samples(
        speeds[:, :-replicas].reshape(-1, *steps), speeds[:, -replicas:].reshape(-1, 1, *steps)
    )
