"""The emulated laboratory: an arena, the faults that may happen in it, and the operator; both also as typed commands."""

import inspect
from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any

from turing_learning.errors import choice, refuse, require

from ._arena import EmulatedArena
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
