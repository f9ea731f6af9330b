"""The emulated laboratory: faults and an operator, also as typed commands; runs before it, in virtual time or plain simulation."""

import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from turing_learning.coevolution import Samples
from turing_learning.config import ConfigurationError
from turing_learning.errors import choice, refuse, refusing_as, require
from turing_learning.models import Behavior
from turing_learning.purposes import REHEARSAL
from turing_learning.robots._epuck import EPuck
from turing_learning.robots.program._equipment import CameraPoses, Equipment, laboratory_tracker
from turing_learning.robots.program._setup import Laboratory
from turing_learning.robots.program._source import LARGEST
from turing_learning.swarm import Scenario, Trials, alone
from turing_learning.systems import Source

from ._arena import EmulatedArena
from ._camera import overhead_camera
from ._lines import Spoil, whole

GARBAGE = b"\x9a\xff\x01x,START,9"
"""Noise on a line: bytes that are no text, and the beginning of a line that never ends."""
_OTHER_NAMES = {"press-remote": "remote", "put-in-order": "repair"}


class Faults:
    """Faults on demand: each method is one; robots are named as in `EmulatedLaboratory.names`."""

    def __init__(self, arena: EmulatedArena) -> None:
        self._arena = arena

    def lose_link(self, name: str) -> None:
        """Break a robot's connection, until the operator resets it."""
        self._arena.line(name).drop()

    def garble(self, name: str) -> None:
        """Put garbage before what the robot sends next."""
        self._spoil_once(name, lambda data: [GARBAGE + b"\r\n" + data])

    def cut_reply(self, name: str) -> None:
        """Send the next reply in two pieces, with a pause between them."""
        self._spoil_once(name, lambda data: [data[: len(data) // 2], data[len(data) // 2 :]])

    def lose_half_reply(self, name: str) -> None:
        """Lose the second half of what the robot sends next."""
        self._spoil_once(name, lambda data: [data[: len(data) // 2]])

    def silence(self, name: str) -> None:
        """Let a replica send no more signals, until it is restarted."""
        self._arena.robot(name).silent = True

    def drain(self, name: str) -> None:
        """Let a robot's battery be low; it lasts a little longer."""
        robot = self._arena.robot(name)
        robot.charge = min(robot.charge, 0.1)

    def empty(self, name: str) -> None:
        """Let a robot stop for want of power."""
        self._arena.robot(name).charge = 1e-12

    def stick(self, name: str) -> None:
        """Let a robot be stuck on the floor: its wheels turn in vain."""
        self._arena.stuck.add(self._arena.number(name))

    def carry(self, name: str, x_cm: float, y_cm: float, heading: float = 0.0) -> None:
        """Carry a robot to another place."""
        self._arena.put(name, (x_cm, y_cm, heading))

    def cover(self, name: str) -> None:
        """Hide a robot's marker from the camera."""
        self._arena.covered.add(self._arena.number(name))

    def freeze_camera(self) -> None:
        """Let the camera give the same image again and again."""
        self._arena.camera.frozen = True

    def unplug_camera(self) -> None:
        """Let the camera give no images."""
        self._arena.camera.unplugged = True

    def _spoil_once(self, name: str, spoil: Spoil) -> None:
        line = self._arena.line(name)

        def once(data: bytes) -> Iterable[bytes]:
            line.spoil = whole
            return spoil(data)

        line.spoil = once


class EmulatedOperator:
    """The human in the laboratory: asked for help, it takes time, repairs everything, and presses the remote control."""

    def __init__(self, arena: EmulatedArena) -> None:
        self._arena = arena
        self.asked: list[str] = []

    def ask(self, what_to_do: str) -> None:
        """Do whatever is needed; `asked` lists what was said."""
        self.asked.append(what_to_do)
        self._arena.clock.sleep(self._arena.conditions.intervention_s)
        self.put_in_order()
        self.press_remote()

    def put_in_order(self) -> None:
        """Free and uncover the robots, look after links and camera, and replace all batteries."""
        self._arena.stuck.clear()
        self.restart_camera()
        for name in self._arena.names:
            self.uncover(name)
            self.reset_link(name)
            self.replace_battery(name)

    def press_remote(self) -> None:
        """Let all robots begin their loops."""
        for name in self._arena.names:
            self._arena.robot(name).hear_remote()

    def replace_battery(self, name: str) -> None:
        """Put a full battery into a robot, which restarts and waits for the remote control."""
        self._arena.robot(name).replace_battery()

    def restart(self, name: str) -> None:
        """Switch a robot off and on; it waits for the remote control."""
        self._arena.robot(name).restart()

    def reset_link(self, name: str) -> None:
        """Make it possible to connect to a robot again."""
        self._arena.line(name).restore()

    def free(self, name: str) -> None:
        """Lift a robot that is stuck."""
        self._arena.stuck.discard(self._arena.number(name))

    def uncover(self, name: str) -> None:
        """Clear the sight to a robot's marker."""
        self._arena.covered.discard(self._arena.number(name))

    def restart_camera(self) -> None:
        """Bring the camera back to work."""
        self._arena.camera.frozen = self._arena.camera.unplugged = False


class EmulatedLaboratory(EmulatedArena):
    """An `EmulatedArena` with an operator, in which faults happen on demand. See there for its parameters.

    Attributes
    ----------
    faults, operator
        What goes wrong, and who helps.
    """

    @cached_property
    def faults(self) -> Faults:
        """What may go wrong."""
        return Faults(self)

    @cached_property
    def operator(self) -> EmulatedOperator:
        """Who helps."""
        return EmulatedOperator(self)

    @property
    def commands(self) -> dict[str, Callable[..., None]]:
        """Name -> what it does: all that the operator can do by hand, and all faults."""
        found = {
            name.replace("_", "-"): method
            for hand in (self.operator, self.faults)
            for name, method in inspect.getmembers(hand, inspect.ismethod)
            if not name.startswith("_") and name != "ask"
        }
        return {_OTHER_NAMES.get(name, name): method for name, method in found.items()}


def usage(laboratory: EmulatedLaboratory) -> list[tuple[str, str]]:
    """Return each command with its arguments, and what it does."""
    return [
        (
            " ".join([name, *(word.upper() for word in inspect.signature(method).parameters)]),
            (inspect.getdoc(method) or "").splitlines()[0],
        )
        for name, method in laboratory.commands.items()
    ]


def obey(laboratory: EmulatedLaboratory, text: str) -> None:
    """Execute a typed line, a command and its arguments; reject one that makes no sense."""
    name, *arguments = text.split()
    method = laboratory.commands[choice("command", name, laboratory.commands)]
    parameters = inspect.signature(method).parameters.values()
    least = sum(parameter.default is parameter.empty for parameter in parameters)
    expected = " ".join(parameter.name.upper() for parameter in parameters)
    fits = least <= len(arguments) <= len(parameters)
    require(fits, name, f"be followed by {expected or 'nothing'}", repr(text.strip()))
    values: list[Any] = []
    for parameter, word in zip(parameters, arguments, strict=False):
        try:
            values.append(float(word) if parameter.annotation is float else word)
        except ValueError:
            refuse(parameter.name, "be a number", repr(word))
    with laboratory.lock:
        method(*values)


@contextmanager
def as_emulated(laboratory: Laboratory) -> Iterator[Laboratory]:
    """Yield a laboratory in the form that can be rehearsed, for `rehearse` and the run.

    It is marked as emulated, and so are its runs: they are resumed as rehearsals. It has no landmarks, which
    are not rendered. If the file of the calibration does not exist yet, it has the calibration of a camera
    above the arena's middle, in a file that is removed at the end. Its robots are emulated e-pucks before a
    camera, whatever the real ones are.
    """
    setup, scenario = laboratory.setup, laboratory.configuration.swarm
    changes: dict[str, object] = {"landmarks": {}}
    with TemporaryDirectory() as folder:
        width, height = scenario.arena.width_cm, scenario.arena.height_cm
        known = setup.camera.calibration is not None and Path(setup.camera.calibration).exists()
        if width is not None and height is not None and not known:
            path = Path(folder) / "camera.json"
            overhead_camera(width, height).save(path)
            changes["calibration"] = str(path)
        camera = setup.camera.model_copy(update=changes)
        plain = {"camera": camera, "emulated": True, "open_replica": None, "tracker": None}
        yield replace(laboratory, setup=setup.model_copy(update=plain))


def rehearse(laboratory: Laboratory, seed: int | None = None) -> Equipment:
    """Return the devices of an emulated laboratory with the robots, the arena and the calibration of a run.

    Its operator does whatever is asked. Time passes as fast as the computer can. The seed of places, noise and
    batteries is that of the run if None; a resumed run should not meet the same noise again. Raise
    ConfigurationError if the calibration cannot be read, or a robot cannot wear its marker.
    """
    setup, configuration = laboratory.setup, laboratory.configuration
    tracker = laboratory_tracker(setup, configuration.swarm.robot)
    with refusing_as(ConfigurationError):
        emulated = EmulatedLaboratory(
            configuration.swarm,
            seed=configuration.run.seed if seed is None else seed,
            calibration=tracker.calibration,
            markers=tracker.markers,
            labels=setup.labels,
        )
    robots = zip((*setup.agents, *setup.replicas), emulated.names, strict=True)
    names = {str(robot.address): name for robot, name in robots if robot.address}
    return Equipment(
        emulated.clock,
        lambda address: EPuck(emulated.link(names[address])),
        lambda: CameraPoses(emulated.camera, tracker, emulated.clock),
        emulated.operator,
    )


class SimulatedLaboratory(Source):
    """Samples of trials in which each replica executes a model of its own, among the same agents, in plain simulation.

    The counterpart of `LaboratorySource` in the paper's comparison: the same setup, without links, images, a
    tracker, dispersal and infrared sensors. The robots begin each trial at places drawn uniformly; a wall
    only stops them. Source: paper, section 5.4.

    Parameters
    ----------
    scenario
        The laboratory's, with R replicas.
    seed
        Of `observe`; the random numbers of `collect` come from the run.
    of_trials
        Whether of a run of trials, see `LaboratorySource`.
    """

    def __init__(self, scenario: Scenario, seed: int = 0, *, of_trials: bool = False) -> None:
        self._scenario, self._seed = scenario, seed
        self.together, self.ends = scenario.replicas, LARGEST if of_trials else None

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the wheel speeds (M, P), fractions of the maximum; see `LaboratorySource.to_units`."""
        return models if self.ends else np.tanh(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples of the agents in all trials (trials x agents, T, 2), and one of each model (M, 1, T, 2)."""
        return self._samples(self.to_units(models), rng)

    def observe(self, speeds: np.ndarray, stage: str) -> Samples:
        """Return samples of models (M, P) in wheel speeds; see `collect`. Each stage has its own random numbers."""
        return self._samples(speeds, np.random.default_rng([REHEARSAL, self._seed, *stage.encode()]))

    def _samples(self, speeds: np.ndarray, rng: np.random.Generator) -> Samples:
        scenario = self._scenario
        trials, rest = divmod(len(speeds), scenario.replicas)
        require(trials and not rest, "models", f"be a multiple of {scenario.replicas} replicas, not 0", len(speeds))
        executed = alone(scenario, trials)
        executed[:, scenario.agents :] = np.arange(len(speeds)).reshape(trials, -1)
        motion = Trials.draw(scenario, executed, rng).observe(Behavior(speeds), 1)
        shape = motion.shape[2:]
        return Samples(
            genuine=motion[:, : scenario.agents].reshape(-1, *shape),
            counterfeit=motion[:, scenario.agents :].reshape(-1, 1, *shape),
        )
