"""What happens in an emulated laboratory, and what its operator does about it."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ._line import Spoil, whole

if TYPE_CHECKING:
    from ._arena import EmulatedLaboratory

GARBAGE = b"\x9a\xff\x01x,START,9"
"""What noise on a line looks like: bytes that are no text, and the beginning of a line that never ends."""


class Faults:
    """What goes wrong, on demand: each method is a fault; robots are named as in `EmulatedLaboratory.names`."""

    def __init__(self, laboratory: "EmulatedLaboratory") -> None:
        self._laboratory = laboratory

    def lose_link(self, name: str) -> None:
        """Break a robot's connection, until the operator resets it."""
        self._laboratory.line(name).drop()

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
        """Let a replica send no signals any more, until it is restarted."""
        self._laboratory.robot(name).silent = True

    def drain(self, name: str) -> None:
        """Let a robot's battery be low; it lasts a little longer."""
        robot = self._laboratory.robot(name)
        robot.charge = min(robot.charge, 0.1)

    def empty(self, name: str) -> None:
        """Let a robot stop for want of power."""
        self._laboratory.robot(name).charge = 1e-12

    def stick(self, name: str) -> None:
        """Let a robot be stuck on the floor: its wheels turn in vain."""
        self._laboratory.stuck.add(self._laboratory.number(name))

    def carry(self, name: str, x_cm: float, y_cm: float, heading: float = 0.0) -> None:
        """Carry a robot to another place."""
        self._laboratory.put(name, (x_cm, y_cm, heading))

    def cover(self, name: str) -> None:
        """Hide a robot's marker from the camera."""
        self._laboratory.covered.add(self._laboratory.number(name))

    def freeze_camera(self) -> None:
        """Let the camera give the same image again and again."""
        self._laboratory.camera.frozen = True

    def unplug_camera(self) -> None:
        """Let the camera give no images."""
        self._laboratory.camera.unplugged = True

    def _spoil_once(self, name: str, spoil: Spoil) -> None:
        line = self._laboratory.line(name)

        def once(data: bytes) -> Iterable[bytes]:
            line.spoil = whole
            return spoil(data)

        line.spoil = once


class EmulatedOperator:
    """The human in the laboratory.

    Asked for help, it takes its time, puts everything in order that can be, and presses the remote control.
    """

    def __init__(self, laboratory: "EmulatedLaboratory", intervention_s: float) -> None:
        self._laboratory, self._intervention_s = laboratory, intervention_s
        self.asked: list[str] = []

    def ask(self, what_to_do: str) -> None:
        """Do whatever is needed; `asked` remembers what was said."""
        self.asked.append(what_to_do)
        self._laboratory.clock.sleep(self._intervention_s)
        self.put_in_order()
        self.press_remote()

    def put_in_order(self) -> None:
        """Free and uncover the robots, look after links and camera, and replace all batteries."""
        laboratory = self._laboratory
        laboratory.stuck.clear()
        self.restart_camera()
        for name in laboratory.names:
            self.uncover(name)
            self.reset_link(name)
            self.replace_battery(name)

    def press_remote(self) -> None:
        """Let all robots begin their loops."""
        for name in self._laboratory.names:
            self._laboratory.robot(name).hear_remote()

    def replace_battery(self, name: str) -> None:
        """Put a full battery into a robot, which forgets what it was doing and waits for the remote control."""
        self._laboratory.robot(name).replace_battery()

    def restart(self, name: str) -> None:
        """Switch a robot off and on; it waits for the remote control."""
        self._laboratory.robot(name).restart()

    def reset_link(self, name: str) -> None:
        """Make it possible to connect to a robot again."""
        self._laboratory.line(name).restore()

    def free(self, name: str) -> None:
        """Lift a robot that is stuck."""
        self._laboratory.stuck.discard(self._laboratory.number(name))

    def uncover(self, name: str) -> None:
        """Clear the sight to a robot's marker."""
        if self._laboratory.covered:
            self._laboratory.covered.discard(self._laboratory.number(name))

    def restart_camera(self) -> None:
        """Bring the camera back to work."""
        self._laboratory.wake_camera()
