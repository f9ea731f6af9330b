"""Bodies for emulated robots, and a clock that a test turns by hand."""


class Body:
    def __init__(self):
        self.speeds = (0, 0)
        self.readings = (10, 200, -3, 4, 5, 6, 7, 3000)
        self.battery = True

    def set_speed(self, left, right):
        self.speeds = (left, right)

    def proximity(self):
        return self.readings

    def battery_ok(self):
        return self.battery


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now
