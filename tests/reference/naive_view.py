"""A slow, plain twin of the sensor with a field of view, in angles."""

import math


def nearest_visible(ahead, off, radius, field_of_view):
    """Return the distance of the nearest visible point of a disk, None if no part of it is in view."""
    if field_of_view == 0:
        visible = ahead > 0 and abs(off) <= radius
        return ahead - math.sqrt(radius**2 - off**2) if visible else None
    distance, bearing = math.hypot(ahead, off), abs(math.atan2(off, ahead))
    beyond = bearing - field_of_view / 2
    if beyond <= 0:
        return distance - radius
    if distance > radius and beyond > math.asin(radius / distance):
        return None
    depth = math.sqrt(max(radius**2 - (distance * math.sin(beyond)) ** 2, 0.0))
    return distance * math.cos(beyond) - depth


def read(i, x, y, heading, bodies, field_of_view):
    """Return the reading of robot i among bodies, (radius, reading) each; 0 is invisible."""
    seen = []
    c, s = math.cos(heading[i]), math.sin(heading[i])
    for j, (radius, reading) in enumerate(bodies):
        if j == i or reading == 0:
            continue
        dx, dy = x[j] - x[i], y[j] - y[i]
        distance = nearest_visible(dx * c + dy * s, dx * s - dy * c, radius, field_of_view)
        if distance is not None:
            seen.append((distance, j, reading))
    return min(seen)[2] if seen else 0
