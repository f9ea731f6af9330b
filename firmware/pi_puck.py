"""A replica, or an agent, on a Pi-puck: run it on its Raspberry Pi, with its port as the address in the laboratory's file.

    pip install 'turing-learning[vision]' smbus2
    python pi_puck.py 10.0.0.1 5000                         # a replica; 10.0.0.1 is the PC, nobody else may connect
    python pi_puck.py 10.0.0.1 5000 -0.7 -1.0 1.0 -1.0      # the paper's agent

The e-puck2 below answers at I2C channel 12, or 4 in older systems, address 0x1F: 20 bytes in, 47 out, the last of each the
exclusive or of the others (github.com/gctronic/Pi-puck, e-puck2/e-puck2_test.py). It has not been tried on a robot.
"""

import struct
import sys
from collections.abc import Callable
from functools import reduce
from operator import xor
from typing import Any

from turing_learning.robots import LiveCapture, live

CHANNELS = (12, 4)  # the makers' code tries them in this order
ADDRESS = 0x1F
DARK = 60  # brightness (0 to 255) below which the middle of the image is a robot's skirt


class PiPuck:
    """A `RobotBody`; `exchange` takes 20 bytes to the robot and returns its 47. `live` bears its OSErrors."""

    def __init__(self, exchange: Callable[[bytes], bytes], camera: Any) -> None:
        self._exchange, self._camera = exchange, camera
        self._speeds, self._proximity = (0, 0), (0,) * 8

    def set_speed(self, left: int, right: int) -> None:
        self._speeds = (left, right)
        data = struct.pack("<hh15x", left, right)
        told = self._exchange(data + bytes([reduce(xor, data)]))
        if len(told) == 47 and reduce(xor, told) == 0:  # else those of the cycle before
            self._proximity = struct.unpack_from("<8h", told)

    def proximity(self) -> tuple[int, ...]:
        return self._proximity

    def battery_ok(self) -> bool:
        return True  # the Pi-puck's own light shows it

    def sight(self) -> int:
        """Return 1 if the middle of the image is dark, a robot's skirt, and not a white wall."""
        image = self._camera.take()
        height, width = image.shape[:2]
        return int(image[height // 2, 12 * width // 25 : 13 * width // 25].mean() < DARK)


def exchange(data: bytes) -> bytes:
    """Write and read over I2C, at the first channel where the robot answers; raise OSError where it does at none."""
    from smbus2 import SMBus, i2c_msg

    write = i2c_msg.write(ADDRESS, data)
    read = i2c_msg.read(ADDRESS, 47)
    for channel in CHANNELS:
        try:
            with SMBus(channel) as bus:
                bus.i2c_rdwr(write, read)
            return bytes(read)
        except OSError as error:
            failed = error
    raise failed


if __name__ == "__main__":
    pc, port, *speeds = sys.argv[1:]
    controller = tuple(float(speed) for speed in speeds) or None
    live(
        PiPuck(exchange, LiveCapture(0)),
        host="0.0.0.0",
        port=int(port),
        peers=[pc],
        controller=controller,
    )
