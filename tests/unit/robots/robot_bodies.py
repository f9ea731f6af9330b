"""Bodies for emulated robots, a clock that a test turns by hand, and a client that knows the public protocol alone."""

import os
import select


class Body:
    def __init__(self):
        self.readings = (10, 200, -3, 4, 5, 6, 7, 3000)
        self.battery = True

    def proximity(self):
        return self.readings

    def battery_ok(self):
        return self.battery


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


class PublicClient:
    """Knows the wiki's tables and nothing of the driver."""

    def __init__(self, descriptor):
        self.descriptor, self.rest = descriptor, b""

    def line(self, timeout=60.0):
        while b"\n" not in self.rest:
            assert select.select([self.descriptor], [], [], timeout)[0], (
                f"silence after {self.rest!r}"
            )
            self.rest += os.read(self.descriptor, 1024)
        line, self.rest = self.rest.split(b"\n", 1)
        return line.rstrip(b"\r").decode("ascii")

    def ask(self, command):
        os.write(self.descriptor, command.encode("ascii") + b"\n")
        return self.line()

    def binary(self, request, expected):
        os.write(self.descriptor, request)
        while len(self.rest) < expected:
            assert select.select([self.descriptor], [], [], 60.0)[0]
            self.rest += os.read(self.descriptor, 1024)
        answer, self.rest = self.rest[:expected], self.rest[expected:]
        return answer
