"""Contacts of disks with each other and with walls. Source: the equations of Enki, see docs/physics.md."""

import math

import numpy as np

from .compile import inlined
from .party import LANES, Lanes, Party
from .world import World

RESTITUTION = 0.9
"""Coefficient of every body; a contact uses the product of two."""

X_A, Y_A, VX_A, VY_A, TURN_A, RADIUS_A, MASS_A, INERTIA_A = range(0, 8 * LANES, LANES)
X_B, Y_B, VX_B, VY_B, TURN_B, RADIUS_B, MASS_B, INERTIA_B = range(8 * LANES, 16 * LANES, LANES)
"""Where in `Party.lane` the numbers of the first lane are; those of the others follow."""

Motion = tuple[float, float, float, float, float]
Disk = tuple[float, float, float]


@inlined
def overlap(i: int, j: int, party: Party) -> bool:
    """Return whether the disks of two members overlap."""
    dx = party.x[i] - party.x[j]
    dy = party.y[i] - party.y[j]
    reach = party.radius[i] + party.radius[j]
    return dx * dx + dy * dy < reach * reach


@inlined
def push_apart(i: int, j: int, party: Party) -> None:
    """Resolve the contact of members i < j, whose disks overlap."""
    (
        (party.x[i], party.y[i], party.vx[i], party.vy[i], party.turn[i]),
        (party.x[j], party.y[j], party.vx[j], party.vy[j], party.turn[j]),
    ) = after_contact(
        (party.x[i], party.y[i], party.vx[i], party.vy[i], party.turn[i]),
        (party.x[j], party.y[j], party.vx[j], party.vy[j], party.turn[j]),
        (party.radius[i], party.inverse_mass[i], party.inverse_inertia[i]),
        (party.radius[j], party.inverse_mass[j], party.inverse_inertia[j]),
    )


@inlined
def after_contact(a: Motion, b: Motion, disk_a: Disk, disk_b: Disk) -> tuple[Motion, Motion]:
    """Return the motion (x, y, vx, vy, turn rate) of two overlapping disks (radius, inverse mass and inertia) after their contact.

    They are pushed apart, and exchange an impulse along the normal (nx, ny), from b to a, at the contact point on the boundary of
    b; also when they already separate.
    """
    x_a, y_a, vx_a, vy_a, turn_a = a
    x_b, y_b, vx_b, vy_b, turn_b = b
    radius_a, mass_a, inertia_a = disk_a
    radius_b, mass_b, inertia_b = disk_b
    dx, dy = x_a - x_b, y_a - y_b
    distance = math.sqrt(dx * dx + dy * dy)
    nx = dx / distance if distance > 0.0 else 1.0
    ny = dy / distance if distance > 0.0 else 0.0
    shift = (radius_a + radius_b - distance) / (mass_a + mass_b)
    x_a, y_a = x_a + nx * shift * mass_a, y_a + ny * shift * mass_a
    x_b, y_b = x_b - nx * shift * mass_b, y_b - ny * shift * mass_b
    contact_x, contact_y = x_b + nx * radius_b, y_b + ny * radius_b
    ax, ay = contact_x - x_a, contact_y - y_a
    bx, by = contact_x - x_b, contact_y - y_b
    relative_x = (vx_a - turn_a * ay) - (vx_b - turn_b * by)
    relative_y = (vy_a + turn_a * ax) - (vy_b + turn_b * bx)
    cross_a = ax * ny - ay * nx
    cross_b = bx * ny - by * nx
    impulse = (
        -(1.0 + RESTITUTION * RESTITUTION)
        * (relative_x * nx + relative_y * ny)
        / (mass_a + mass_b + cross_a * cross_a * inertia_a + cross_b * cross_b * inertia_b)
    )
    return (
        (x_a, y_a, vx_a + impulse * nx * mass_a, vy_a + impulse * ny * mass_a, turn_a + impulse * cross_a * inertia_a),
        (x_b, y_b, vx_b - impulse * nx * mass_b, vy_b - impulse * ny * mass_b, turn_b - impulse * cross_b * inertia_b),
    )


@inlined
def push_all_apart(hits: int, party: Party, lanes: Lanes) -> None:
    """Resolve the contacts of the first `hits` pairs in `lanes.hit`, each of another trial, side by side."""
    lane = lanes.number
    for c in range(hits):
        i, j = np.uint64(lanes.hit[c, 0]), np.uint64(lanes.hit[c, 1])
        lane[X_A + c], lane[Y_A + c], lane[VX_A + c], lane[VY_A + c] = party.x[i], party.y[i], party.vx[i], party.vy[i]
        lane[X_B + c], lane[Y_B + c], lane[VX_B + c], lane[VY_B + c] = party.x[j], party.y[j], party.vx[j], party.vy[j]
        lane[TURN_A + c], lane[TURN_B + c] = party.turn[i], party.turn[j]
        lane[RADIUS_A + c], lane[RADIUS_B + c] = party.radius[i], party.radius[j]
        lane[MASS_A + c], lane[MASS_B + c] = party.inverse_mass[i], party.inverse_mass[j]
        lane[INERTIA_A + c], lane[INERTIA_B + c] = party.inverse_inertia[i], party.inverse_inertia[j]
    for c in range(LANES):
        a, b = after_contact(
            (lane[X_A + c], lane[Y_A + c], lane[VX_A + c], lane[VY_A + c], lane[TURN_A + c]),
            (lane[X_B + c], lane[Y_B + c], lane[VX_B + c], lane[VY_B + c], lane[TURN_B + c]),
            (lane[RADIUS_A + c], lane[MASS_A + c], lane[INERTIA_A + c]),
            (lane[RADIUS_B + c], lane[MASS_B + c], lane[INERTIA_B + c]),
        )
        lane[X_A + c], lane[Y_A + c], lane[VX_A + c], lane[VY_A + c], lane[TURN_A + c] = a
        lane[X_B + c], lane[Y_B + c], lane[VX_B + c], lane[VY_B + c], lane[TURN_B + c] = b
    for c in range(hits):
        i, j = np.uint64(lanes.hit[c, 0]), np.uint64(lanes.hit[c, 1])
        party.x[i], party.y[i], party.vx[i], party.vy[i] = lane[X_A + c], lane[Y_A + c], lane[VX_A + c], lane[VY_A + c]
        party.x[j], party.y[j], party.vx[j], party.vy[j] = lane[X_B + c], lane[Y_B + c], lane[VX_B + c], lane[VY_B + c]
        party.turn[i], party.turn[j] = lane[TURN_A + c], lane[TURN_B + c]


@inlined
def bounced(position: float, speed: float, radius: float, length: float) -> tuple[float, float]:
    """Return position and speed along one side of the arena, walls at 0 and `length`."""
    if position < radius:
        return radius, -RESTITUTION * speed if speed < 0.0 else speed
    if position > length - radius:
        return length - radius, -RESTITUTION * speed if speed > 0.0 else speed
    return position, speed


@inlined
def keep_inside(i: int, world: World, party: Party) -> None:
    """Put a member that crosses a wall back to touch it and reflect its velocity towards the wall."""
    radius = party.radius[i]
    party.x[i], party.vx[i] = bounced(party.x[i], party.vx[i], radius, world.width)
    party.y[i], party.vy[i] = bounced(party.y[i], party.vy[i], radius, world.height)
