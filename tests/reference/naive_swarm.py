"""A slow, plain twin of the swarm simulator: one body, one pair and one physics step at a time (docs/physics.md)."""

import math

import numpy as np

MASK = 2**64 - 1
SCALES, SLIPS, MISTAKES = 0x6A09E667F3BCC909, 0xBB67AE8584CAA73B, 0x3C6EF372FE94F82B


def uniform(key, counter):
    """SplitMix64 on Python integers."""
    z = (key + (counter + 1) * 0x9E3779B97F4A7C15) & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    z ^= z >> 31
    return ((z >> 11) + 0.5) * 2.0**-53


class NaiveSwarm:
    def __init__(self, scenario, controllers, poses, key, noise):
        self.scenario, self.controllers, self.key, self.noise = (
            scenario,
            controllers,
            int(key),
            noise,
        )
        self.robots, self.count = len(controllers), len(poses)
        self.x, self.y, self.heading = (list(map(float, poses[:, k])) for k in range(3))
        self.vx, self.vy, self.turn = [0.0] * self.count, [0.0] * self.count, [0.0] * self.count
        own = [(item, name) for name, item in scenario.items.items() for _ in range(item.count)]
        objects = self.count - self.robots - len(own)
        kinds = [(scenario.robot, "robot")] * self.robots + [(scenario.objects, "object")] * objects
        kinds += own
        self.radius = [kind.radius_cm for kind, _ in kinds]
        self.mobility = [getattr(kind, "mobility", "pushed") for kind, _ in kinds]
        self.mass = [
            math.inf if mobility == "fixed" else kind.mass_g
            for (kind, _), mobility in zip(kinds, self.mobility, strict=True)
        ]
        self.friction = [getattr(kind, "friction", 0.0) for kind, _ in kinds]
        self.inertia = [m * r * r / 2 for m, r in zip(self.mass, self.radius, strict=True)]
        self.readings = [scenario.sensor.reading_of(name) for _, name in kinds]

    def poses(self):
        return np.array([self.x, self.y, self.heading]).T

    def sense(self, i):
        c, s = math.cos(self.heading[i]), math.sin(self.heading[i])
        nearest, reading = math.inf, 0
        for j in range(self.count):
            if j == i or self.readings[j] == 0:
                continue
            dx, dy = self.x[j] - self.x[i], self.y[j] - self.y[i]
            ahead, off = dx * c + dy * s, dx * s - dy * c
            if ahead > 0 and abs(off) <= self.radius[j]:
                entry = ahead - math.sqrt(self.radius[j] ** 2 - off**2)
                if entry < nearest:
                    nearest, reading = entry, self.readings[j]
        return reading

    def mistaken(self, readings, cycle):
        sensor = self.scenario.sensor
        result = []
        for i in range(self.robots):
            draw = uniform(self.key ^ MISTAKES, cycle * self.robots + i)
            reading = readings[i]
            if draw < sensor.mistakes:
                others = sensor.states - 1
                reading = (reading + 1 + int(draw / sensor.mistakes * others)) % sensor.states
            result.append(reading)
        return result

    def command(self, readings, cycle):
        robot = self.scenario.robot
        commands = []
        for i in range(self.robots):
            wheels = []
            for side in range(2):
                draw = uniform(self.key, 2 * (cycle * self.robots + i) + side)
                speed = self.controllers[i][2 * readings[i] + side] * robot.maximum_speed_cm_s
                speed *= 1 + self.noise * (2 * draw - 1)
                speed *= 1 + robot.wheel_scale_spread * (
                    2 * uniform(self.key ^ SCALES, 2 * i + side) - 1
                )
                if robot.clamp_wheel_speeds:
                    speed = max(-robot.maximum_speed_cm_s, min(robot.maximum_speed_cm_s, speed))
                speed *= 1 - robot.slip * uniform(
                    self.key ^ SLIPS, 2 * (cycle * self.robots + i) + side
                )
                wheels.append(speed)
            commands.append(
                ((wheels[0] + wheels[1]) / 2, (wheels[1] - wheels[0]) / robot.wheel_distance_cm)
            )
        return commands

    def slow_down(self, i, speed, dt):
        friction = self.friction[i] * self.scenario.objects.gravity_cm_s2
        norm = math.hypot(*speed)
        if friction * dt > norm or norm == 0:
            return [0.0 for _ in speed]
        return [v + (-friction * v / norm - 0.01 * v) * dt for v in speed]

    def step(self, commands, dt):
        for i in range(self.count):
            if i < self.robots:
                forward, turn = commands[i]
                direction = self.heading[i] + self.turn[i] * dt / 2
                self.vx[i], self.vy[i] = (
                    forward * math.cos(direction),
                    forward * math.sin(direction),
                )
                self.turn[i] = turn
            else:
                self.vx[i], self.vy[i] = self.slow_down(i, [self.vx[i], self.vy[i]], dt)
                (self.turn[i],) = self.slow_down(i, [self.turn[i]], dt)
            self.x[i] += self.vx[i] * dt
            self.y[i] += self.vy[i] * dt
            self.heading[i] += self.turn[i] * dt
        for i in range(self.count):
            for j in range(i + 1, self.count):
                self.collide(i, j)
        for i in range(self.count):
            self.bounce(i)
            self.heading[i] = (self.heading[i] + math.pi) % (2 * math.pi) - math.pi

    def collide(self, i, j):
        if "seen" in (self.mobility[i], self.mobility[j]):
            return
        if self.mobility[i] == self.mobility[j] == "fixed":
            return
        dx, dy = self.x[i] - self.x[j], self.y[i] - self.y[j]
        distance = math.hypot(dx, dy)
        depth = self.radius[i] + self.radius[j] - distance
        if depth <= 0:
            return
        nx, ny = dx / distance, dy / distance
        share = (1 / self.mass[i]) / (1 / self.mass[i] + 1 / self.mass[j])
        self.x[i] += nx * depth * share
        self.y[i] += ny * depth * share
        self.x[j] -= nx * depth * (1 - share)
        self.y[j] -= ny * depth * (1 - share)
        px, py = self.x[j] + nx * self.radius[j], self.y[j] + ny * self.radius[j]
        ax, ay, bx, by = px - self.x[i], py - self.y[i], px - self.x[j], py - self.y[j]
        vx = self.vx[i] - self.turn[i] * ay - self.vx[j] + self.turn[j] * by
        vy = self.vy[i] + self.turn[i] * ax - self.vy[j] - self.turn[j] * bx
        ca, cb = ax * ny - ay * nx, bx * ny - by * nx
        impulse = -(1 + 0.9 * 0.9) * (vx * nx + vy * ny)
        impulse /= (
            1 / self.mass[i] + 1 / self.mass[j] + ca**2 / self.inertia[i] + cb**2 / self.inertia[j]
        )
        self.vx[i] += impulse * nx / self.mass[i]
        self.vy[i] += impulse * ny / self.mass[i]
        self.turn[i] += impulse * ca / self.inertia[i]
        self.vx[j] -= impulse * nx / self.mass[j]
        self.vy[j] -= impulse * ny / self.mass[j]
        self.turn[j] -= impulse * cb / self.inertia[j]

    def bounce(self, i):
        arena = self.scenario.arena
        if arena.width_cm is None or self.mobility[i] == "seen":
            return
        for position, speed, size in (
            (self.x, self.vx, arena.width_cm),
            (self.y, self.vy, arena.height_cm),
        ):
            low, high = self.radius[i], size - self.radius[i]
            if position[i] < low:
                position[i], speed[i] = low, -0.9 * speed[i] if speed[i] < 0 else speed[i]
            elif position[i] > high:
                position[i], speed[i] = high, -0.9 * speed[i] if speed[i] > 0 else speed[i]

    def run(self, cycles):
        """Return poses (T + 1, B, 3), sensors (T + 1, A) and speeds (A, T, 2)."""
        trial = self.scenario.trial
        poses, sensors, speeds = [self.poses()], [], []
        rest = [(0.0, 0.0)] * self.robots
        waiting = [rest for _ in range(self.scenario.robot.actuation_lag_cycles)]
        for cycle in range(cycles):
            readings = self.mistaken([self.sense(i) for i in range(self.robots)], cycle)
            waiting.append(self.command(readings, cycle))
            commands = waiting.pop(0)
            for _ in range(trial.physics_steps):
                self.step(commands, trial.control_interval_s / trial.physics_steps)
            poses.append(self.poses())
            sensors.append(readings)
            moved = poses[-1] - poses[-2]
            ahead = moved[:, 0] * np.cos(poses[-2][:, 2]) + moved[:, 1] * np.sin(poses[-2][:, 2])
            speed = (
                np.where(ahead < 0, -1, 1)
                * np.hypot(moved[:, 0], moved[:, 1])
                / trial.control_interval_s
            )
            speeds.append([(speed[i], commands[i][1]) for i in range(self.robots)])
        sensors.append(self.mistaken([self.sense(i) for i in range(self.robots)], cycles))
        return np.array(poses), np.array(sensors), np.array(speeds).transpose(1, 0, 2)
