"""A robot alone in a square court with posts that it can push, and its infrared sensors.

Motion and contacts are those of docs/physics.md, for one robot: the equations of the Enki simulator
(docs/worlds.md). Posts are as heavy as the robot.
"""

import math
from typing import NamedTuple

import numpy as np

from .compile import compile_cached, inlined
from .motion import wrapped


class Court(NamedTuple):
    """Lengths in cm, times in s."""

    side: float  # of the square, whose corner is the origin
    radius: float  # of the robot
    post_radius: float
    wheel_distance: float
    step_s: float  # of the physics
    steps: int  # in a control cycle
    bounce: float  # restitution of the robot and a post, and of two posts
    wall_bounce: float  # restitution of a post at a wall
    dry_friction: float  # deceleration of a post that slides (cm/s^2)
    viscous_friction: float  # the same for each unit of speed (1/s)


class Infrared(NamedTuple):
    """What a sensor makes of distances (cm): of three rays, `aperture` (rad) apart.

    At a distance x a ray has the value peak (c - x0^2) / (x^2 - 2 x0 x + c), below x0 the peak.
    """

    range: float
    peak: float
    x0: float
    c: float
    aperture: float
    noise: float  # standard deviation, in the unit of the peak
    full: float  # value that is a reading of 1


# Columns of a robot: pose (cm, rad), turn rate of the last step (rad/s), and the speeds of its
# wheels (cm/s), which stay for a cycle.
X, Y, HEADING, TURN, LEFT, RIGHT = range(6)


@inlined
def slow_down(post: np.ndarray, court: Court) -> None:
    """Let friction act on a post (x, y and velocity) for a step, and move it."""
    speed = math.sqrt(post[2] * post[2] + post[3] * post[3])
    if court.dry_friction * court.step_s > speed:
        post[2] = 0.0
        post[3] = 0.0
        return
    factor = 1.0 - court.step_s * (court.dry_friction / speed + court.viscous_friction)
    post[2] *= factor
    post[3] *= factor
    post[0] += post[2] * court.step_s
    post[1] += post[3] * court.step_s


@inlined
def collide(first: np.ndarray, second: np.ndarray, reach: float, bounce: float) -> bool:
    """Separate two equally heavy disks, and exchange their impulse; return whether they touch.

    A disk is (x, y and velocity); disks whose centers are nearer than the reach overlap.
    """
    dx = first[0] - second[0]
    dy = first[1] - second[1]
    square = dx * dx + dy * dy
    if square >= reach * reach or square == 0.0:
        return False
    distance = math.sqrt(square)
    dx /= distance
    dy /= distance
    overlap = 0.5 * (reach - distance)
    first[0] += overlap * dx
    first[1] += overlap * dy
    second[0] -= overlap * dx
    second[1] -= overlap * dy
    closing = (first[2] - second[2]) * dx + (first[3] - second[3]) * dy
    change = 0.5 * (1.0 + bounce) * closing
    first[2] -= change * dx
    first[3] -= change * dy
    second[2] += change * dx
    second[3] += change * dy
    return True


@inlined
def hit_walls(post: np.ndarray, court: Court) -> None:
    """Put a post that has crossed a wall back to touch it, and reflect it."""
    low = court.post_radius
    high = court.side - court.post_radius
    for axis in range(2):
        if post[axis] < low:
            post[axis] = low
            if post[2 + axis] < 0.0:
                post[2 + axis] *= -court.wall_bounce
        elif post[axis] > high:
            post[axis] = high
            if post[2 + axis] > 0.0:
                post[2 + axis] *= -court.wall_bounce


@inlined
def touch_all(
    disk: np.ndarray, posts: np.ndarray, near: np.ndarray, stirred: np.ndarray, court: Court
) -> None:
    """Resolve the contacts of a step: of the robot, a disk, with the posts, of these, with walls.

    Posts that are not near do not touch the robot; those that are not stirred have not moved.
    """
    reach = court.radius + court.post_radius
    moving = False
    for k in range(len(posts)):
        if (near[k] or stirred[k]) and collide(disk, posts[k], reach, court.bounce):
            stirred[k] = True
        moving |= stirred[k]
    if moving:
        for k in range(len(posts)):
            for other in range(k + 1, len(posts)):
                # Posts at rest were apart before.
                if (stirred[k] or stirred[other]) and collide(
                    posts[k], posts[other], 2.0 * court.post_radius, court.bounce
                ):
                    stirred[k] = True
                    stirred[other] = True
        for k in range(len(posts)):
            if stirred[k]:
                hit_walls(posts[k], court)
    # The velocity of a robot is what its wheels command, in every step anew.
    disk[0] = min(max(disk[0], court.radius), court.side - court.radius)
    disk[1] = min(max(disk[1], court.radius), court.side - court.radius)


def _drive(robots: np.ndarray, posts: np.ndarray, court: Court) -> None:
    """Advance robots (n, 6) and their posts (n, K, 4), each x, y and velocity, by a control cycle."""
    count = posts.shape[1]
    stirred = np.empty(count, np.bool_)
    near = np.empty(count, np.bool_)
    disk = np.empty(4)
    for i in range(len(robots)):
        robot = robots[i]
        speed = 0.5 * (robot[LEFT] + robot[RIGHT])
        turn = (robot[RIGHT] - robot[LEFT]) / court.wheel_distance
        # A robot that overlaps posts and walls is moved by contacts, too: by less than its radius.
        distance = court.steps * court.step_s * abs(speed) + court.radius
        reach = court.radius + court.post_radius + distance
        for k in range(count):
            dx = posts[i, k, 0] - robot[X]
            dy = posts[i, k, 1] - robot[Y]
            stirred[k] = posts[i, k, 2] != 0.0 or posts[i, k, 3] != 0.0
            near[k] = dx * dx + dy * dy < reach * reach
        disk[0] = robot[X]
        disk[1] = robot[Y]
        # The first step goes where the turn rate of the cycle before points.
        direction = robot[HEADING] + 0.5 * court.step_s * robot[TURN]
        cosine = math.cos(direction)
        sine = math.sin(direction)
        turned_cosine = math.cos(turn * court.step_s)
        turned_sine = math.sin(turn * court.step_s)
        for step in range(court.steps):
            if step == 1:
                direction = robot[HEADING] + 1.5 * court.step_s * turn
                cosine = math.cos(direction)
                sine = math.sin(direction)
            elif step > 1:
                before = cosine
                cosine = before * turned_cosine - sine * turned_sine
                sine = before * turned_sine + sine * turned_cosine
            disk[2] = speed * cosine
            disk[3] = speed * sine
            disk[0] += disk[2] * court.step_s
            disk[1] += disk[3] * court.step_s
            for k in range(count):
                if stirred[k]:
                    slow_down(posts[i, k], court)
            touch_all(disk, posts[i], near, stirred, court)
        robot[X] = disk[0]
        robot[Y] = disk[1]
        robot[HEADING] = wrapped(robot[HEADING] + court.steps * court.step_s * turn)
        robot[TURN] = turn


@inlined
def response(distance: float, infrared: Infrared) -> float:
    """Return the value of a ray that ends at a distance."""
    if distance > infrared.range:
        return 0.0
    if distance < infrared.x0:
        return infrared.peak
    top = infrared.peak * (infrared.c - infrared.x0 * infrared.x0)
    return top / (distance * (distance - 2.0 * infrared.x0) + infrared.c)


@inlined
def to_walls(x: float, y: float, cosine: float, sine: float, side: float, limit: float) -> float:
    """Return how far a ray goes to the nearest wall, and the limit if that is less."""
    # A division is slow: only rays that reach the wall need it.
    nearest = limit
    if cosine > 0.0 and side - x < limit * cosine:
        nearest = (side - x) / cosine
    elif cosine < 0.0 and x < -limit * cosine:
        nearest = -x / cosine
    if sine > 0.0 and side - y < nearest * sine:
        nearest = (side - y) / sine
    elif sine < 0.0 and y < -nearest * sine:
        nearest = -y / sine
    return nearest


@inlined
def to_post(dx: float, dy: float, cosine: float, sine: float, radius: float, limit: float) -> float:
    """Return how far a ray goes to a post at (dx, dy), and the limit if that is less."""
    along = dx * cosine + dy * sine
    across = dx * sine - dy * cosine
    square = radius * radius - across * across
    if square < 0.0 or along <= 0.0:
        return limit
    return min(limit, max(along - math.sqrt(square), 0.0))


def _read(
    robots: np.ndarray,
    posts: np.ndarray,
    mounts: np.ndarray,
    noise: np.ndarray,
    readings: np.ndarray,
    court: Court,
    infrared: Infrared,
) -> None:
    """Fill the readings (n, S) of sensors, from 0 to 1.

    Mounts (n, S, 4) are position and direction, as a unit vector, in the frame of the robot; the
    noise (n, S) is standard normal.
    """
    beyond = 2.0 * infrared.range
    side_cosine = math.cos(infrared.aperture)
    side_sine = math.sin(infrared.aperture)
    slope = side_sine / side_cosine
    radius = court.post_radius
    sight = infrared.range + radius
    in_sight = np.empty(posts.shape[1], np.int64)
    for i in range(len(robots)):
        cosine = math.cos(robots[i, HEADING])
        sine = math.sin(robots[i, HEADING])
        # Sensors are inside the robot.
        count = 0
        for k in range(posts.shape[1]):
            dx = posts[i, k, 0] - robots[i, X]
            dy = posts[i, k, 1] - robots[i, Y]
            if dx * dx + dy * dy < (sight + court.radius) ** 2:
                in_sight[count] = k
                count += 1
        for s in range(mounts.shape[1]):
            mount = mounts[i, s]
            x = robots[i, X] + cosine * mount[0] - sine * mount[1]
            y = robots[i, Y] + sine * mount[0] + cosine * mount[1]
            ahead_x = cosine * mount[2] - sine * mount[3]
            ahead_y = sine * mount[2] + cosine * mount[3]
            right_x = ahead_x * side_cosine + ahead_y * side_sine
            right_y = ahead_y * side_cosine - ahead_x * side_sine
            left_x = ahead_x * side_cosine - ahead_y * side_sine
            left_y = ahead_y * side_cosine + ahead_x * side_sine
            ahead = to_walls(x, y, ahead_x, ahead_y, court.side, beyond)
            right = to_walls(x, y, right_x, right_y, court.side, beyond)
            left = to_walls(x, y, left_x, left_y, court.side, beyond)
            for number in range(count):
                k = in_sight[number]
                dx = posts[i, k, 0] - x
                dy = posts[i, k, 1] - y
                along = dx * ahead_x + dy * ahead_y
                across = abs(dx * ahead_y - dy * ahead_x)
                # Elsewhere the post is outside the sector between the outer rays.
                if across - radius <= slope * (along + radius) and along < sight:
                    ahead = to_post(dx, dy, ahead_x, ahead_y, radius, ahead)
                    right = to_post(dx, dy, right_x, right_y, radius, right)
                    left = to_post(dx, dy, left_x, left_y, radius, left)
            value = response(right, infrared) + response(ahead, infrared)
            value += response(left, infrared) - 2.0 * response(ahead / side_cosine, infrared)
            value += infrared.noise * noise[i, s]
            readings[i, s] = min(max(value, 0.0), infrared.peak, infrared.full) / infrared.full


def _to_walls_of(robots: np.ndarray, distances: np.ndarray, court: Court) -> None:
    """Fill the distances (n,) of robots from the walls that they head for."""
    farthest = 2.0 * court.side
    for i in range(len(robots)):
        cosine = math.cos(robots[i, HEADING])
        sine = math.sin(robots[i, HEADING])
        free = to_walls(robots[i, X], robots[i, Y], cosine, sine, court.side, farthest)
        distances[i] = free - court.radius


drive = compile_cached(_drive, notice="the motion of a robot among posts (5 s)")
read = compile_cached(_read, notice="infrared sensors (5 s)")
to_walls_of = compile_cached(_to_walls_of)
