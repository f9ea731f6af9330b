"""What a replay shows: swarms in motion, plain data."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning._files import whole
from turing_learning.arrays import array
from turing_learning.errors import integer, number, optional, require
from turing_learning.figures.style import BLUE, INK, ORANGE, RULE

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

VIEW_MARGIN = 0.04
"""Around everything that moves, as a share of the longer side of the view."""
NARROWEST_VIEW = 0.6
"""Shorter side of the view, relative to the longer one, at least."""

PAPER = "#ffffff"
MUTED = "#5f6a75"
GREEN = "#4dbb9d"
PALE_BLUE = "#b3d4e8"
PALE_ORANGE = "#f2cfb3"

ITEM_COLORS = {"amber": "#d9ae4a", "purple": "#c48fb2", "sky": "#8fc7ea"}
"""Of the first, the second and the third type of items, and so on in turn, by their names on
pages."""
ITEM_LOOKS = tuple(ITEM_COLORS)

PANEL_WIDTH = 480
"""Width of one swarm (pixels)."""
HEAD_HEIGHT = 30
"""Height of the line above it (pixels)."""
GAP = 12
"""Around every panel (pixels)."""
OVERSAMPLING = 2
"""Pictures are drawn so many times as large, then reduced, for smooth edges."""
TRAIL_S = 4.0
TRAIL_POINTS = 24


@dataclass(frozen=True, eq=False)
class Swarm:
    """One swarm in motion.

    Parameters
    ----------
    label
        What the swarm is, for example "agents".
    poses : (F, A + O, 3)
        x, y (cm), heading (rad, anticlockwise) in each of F frames; robots first, then objects, then
        items.
    robots
        Number of robots A.
    replica_mask : (A,) bool
        Which robots execute a model; none by default.
    """

    label: str
    poses: np.ndarray
    robots: int
    replica_mask: np.ndarray | None = None

    def __post_init__(self) -> None:
        poses = array("poses", self.poses, "F B 3")
        integer("robots", self.robots, 0, poses.shape[1])
        mask = self.replica_mask
        if mask is None:
            mask = np.zeros(self.robots, bool)
        mask = array("replica_mask", mask, "A", dtype=bool, empty=True, A=self.robots)
        object.__setattr__(self, "poses", poses)
        object.__setattr__(self, "replica_mask", mask)

    @property
    def is_replica(self) -> np.ndarray:
        """Which robots execute a model: (A,) bool."""
        return np.asarray(self.replica_mask)

    @property
    def objects(self) -> int:
        """Number of objects and items O."""
        return self.poses.shape[1] - self.robots


@dataclass(frozen=True)
class ShownItems:
    """Items of a type of the user's own, which come last in the poses of every swarm."""

    name: str
    count: int
    radius_cm: float
    #: Whether a line of sight ends at them
    visible: bool = True


@dataclass(frozen=True, eq=False)
class Replay:
    """Swarms that move side by side, in the same view.

    Parameters
    ----------
    title
        What is seen.
    robot_radius_cm, object_radius_cm
        Radii (cm).
    interval_s
        Time between two frames (s).
    swarms
        One or more swarms with the same number of frames.
    walls_cm
        Left, bottom, right, and top of the arena (cm); None where it is unbounded.
    robotic
        Whether robots are shown, which look along a line of sight.
    items
        What each swarm has beside robots and objects.
    """

    title: str
    robot_radius_cm: float
    object_radius_cm: float
    interval_s: float
    swarms: tuple[Swarm, ...]
    walls_cm: tuple[float, float, float, float] | None = None
    robotic: bool = True
    items: tuple[ShownItems, ...] = ()

    def __post_init__(self) -> None:
        for name in ("robot_radius_cm", "object_radius_cm", "interval_s"):
            number(name, getattr(self, name), above=0)
        require(self.swarms, "swarms", "hold at least one swarm", "none")
        frames = [len(swarm.poses) for swarm in self.swarms]
        require(len(set(frames)) == 1, "swarms", "all have the same number of frames", frames)
        if self.walls_cm is not None:
            left, bottom, right, top = array("walls_cm", self.walls_cm, "4")
            rule = "be left < right and bottom < top"
            require(left < right and bottom < top, "walls_cm", rule, self.walls_cm)
        of_items = sum(item.count for item in self.items)
        fewest = min(swarm.objects for swarm in self.swarms)
        rule = f"be at most the {fewest} bodies after the robots"
        require(fewest >= of_items, "items", rule, of_items)
        object.__setattr__(self, "swarms", tuple(self.swarms))
        object.__setattr__(self, "items", tuple(self.items))

    def objects_of(self, swarm: Swarm) -> int:
        """Return the number of a swarm's bodies that are neither robots nor items."""
        return swarm.objects - sum(item.count for item in self.items)

    def radii_cm(self, swarm: Swarm) -> np.ndarray:
        """Return the radii (O,) in cm of a swarm's bodies after the robots."""
        radii = [self.object_radius_cm] * self.objects_of(swarm)
        for item in self.items:
            radii += [item.radius_cm] * item.count
        return np.array(radii)

    @property
    def frames(self) -> int:
        """Number of frames F."""
        return len(self.swarms[0].poses)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame (s)."""
        return (self.frames - 1) * self.interval_s

    @cached_property
    def view_cm(self) -> tuple[float, float, float, float]:
        """Left, bottom, right, and top (cm) of a view that holds every swarm at any time."""
        points = np.concatenate([swarm.poses[:, :, :2].reshape(-1, 2) for swarm in self.swarms])
        radii = [item.radius_cm for item in self.items]
        radius = max(self.robot_radius_cm, self.object_radius_cm, *radii)
        low = points.min(axis=0) - radius
        high = points.max(axis=0) + radius
        if self.walls_cm is not None:
            low = np.minimum(low, self.walls_cm[:2])
            high = np.maximum(high, self.walls_cm[2:])
        sides = high - low
        size = np.maximum(sides, NARROWEST_VIEW * sides.max()) + 2 * VIEW_MARGIN * sides.max()
        center = (low + high) / 2
        left, bottom = (center - size / 2).tolist()
        right, top = (center + size / 2).tolist()
        return left, bottom, right, top


def write_gif(
    replay: Replay, path: str | Path, *, speed: float = 1.0, frames_per_second: int = 20
) -> Path:
    """Write a replay as GIF that repeats forever.

    Parameters
    ----------
    replay
        What to show.
    path
        The file, in an existing folder; one that exists is replaced. It appears complete or not at
        all.
    speed
        Seconds of the swarm's time in one second of film, > 0.
    frames_per_second
        Frames per second, 1 to 50 (GIF knows hundredths of a second only, and viewers slow shorter
        frames down).

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    from PIL.Image import Dither

    number("speed", speed, above=0)
    integer("frames_per_second", frames_per_second, 1, 50)
    pictures = _pictures(replay, speed, frames_per_second)
    opening = next(pictures)
    # All frames have the colors of the first one.
    how: dict[str, Any] = {"palette": opening.quantize(64), "dither": Dither.NONE}
    later = (picture.quantize(**how) for picture in pictures)
    milliseconds = 10 * round(100 / frames_per_second)
    film: dict[str, Any] = {
        "save_all": True,
        "append_images": later,
        "duration": milliseconds,
        "loop": 0,
    }
    with whole(Path(path)) as temporary:
        opening.quantize(**how).save(temporary, format="GIF", **film)
    return Path(path)


def write_mp4(
    replay: Replay, path: str | Path, *, speed: float = 1.0, frames_per_second: int = 30
) -> Path:
    """Write a replay as MP4 (H.264); needs the extra ``video``.

    Parameters
    ----------
    replay, path, speed
        As for `write_gif`.
    frames_per_second
        Frames per second, 1 to 120.

    Raises
    ------
    MissingExtraError
        If the extra is not installed.
    OSError
        If the file cannot be written.
    """
    number("speed", speed, above=0)
    integer("frames_per_second", frames_per_second, 1, 120)
    av = optional("av", "av", "video")
    options = {"movflags": "faststart"}
    with (
        whole(Path(path)) as temporary,
        av.open(str(temporary), "w", format="mp4", options=options) as film,
    ):
        stream = film.add_stream("libx264", rate=Fraction(frames_per_second))
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": "20"}
        stream.width, stream.height = _size(replay)
        for picture in _pictures(replay, speed, frames_per_second):
            film.mux(stream.encode(av.VideoFrame.from_image(picture)))
        film.mux(stream.encode())
    return Path(path)


def _size(replay: Replay) -> tuple[int, int]:
    left, bottom, right, top = replay.view_cm
    height = round(PANEL_WIDTH * (top - bottom) / (right - left))
    width = len(replay.swarms) * (PANEL_WIDTH + GAP) + GAP
    height += HEAD_HEIGHT + GAP
    # Sides of films are even.
    return width + width % 2, height + height % 2


def _pictures(replay: Replay, speed: float, frames_per_second: int) -> Iterator["Image"]:
    from PIL import Image, ImageDraw, ImageFont

    width, height = _size(replay)
    font = ImageFont.load_default(14)
    edges = [GAP + k * (PANEL_WIDTH + GAP) for k in range(len(replay.swarms))]
    for step in range(int(replay.duration_s / speed * frames_per_second + 1e-9) + 1):
        time_s = step * speed / frames_per_second
        canvas = Image.new("RGB", (OVERSAMPLING * width, OVERSAMPLING * height), PAPER)
        for edge, swarm in zip(edges, replay.swarms, strict=True):
            panel = Image.new(
                "RGB",
                (OVERSAMPLING * PANEL_WIDTH, OVERSAMPLING * (height - HEAD_HEIGHT - GAP)),
                PAPER,
            )
            _draw_swarm(ImageDraw.Draw(panel), panel.size, replay, swarm, time_s)
            canvas.paste(panel, (OVERSAMPLING * edge, OVERSAMPLING * HEAD_HEIGHT))
        picture = canvas.resize((width, height), Image.Resampling.BOX)
        pen = ImageDraw.Draw(picture)
        for edge, swarm in zip(edges, replay.swarms, strict=True):
            pen.text((edge, HEAD_HEIGHT / 2), swarm.label, fill=INK, font=font, anchor="lm")
        pen.text(
            (edges[-1] + PANEL_WIDTH, HEAD_HEIGHT / 2),
            f"{time_s:.1f} s",
            fill=MUTED,
            font=font,
            anchor="rm",
        )
        yield picture


def poses_at(replay: Replay, swarm: Swarm, time_s: float) -> np.ndarray:
    """Return the poses (A + O, 3) at a time (s) between two frames, headings along the shorter arc."""
    frame = min(max(time_s / replay.interval_s, 0.0), replay.frames - 1.0)
    before = int(frame)
    after = min(before + 1, replay.frames - 1)
    change = swarm.poses[after] - swarm.poses[before]
    # From just below a full turn to just above 0, a heading goes forward.
    change[:, 2] = (change[:, 2] + np.pi) % (2 * np.pi) - np.pi
    return swarm.poses[before] + (frame - before) * change


def _draw_swarm(
    pen: "ImageDraw", size: tuple[int, int], replay: Replay, swarm: Swarm, time_s: float
) -> None:
    left, bottom, right, _ = replay.view_cm
    scale = size[0] / (right - left)

    def on_panel(poses: np.ndarray) -> np.ndarray:
        x = (poses[..., 0] - left) * scale
        y = size[1] - (poses[..., 1] - bottom) * scale
        return np.stack([x, y], axis=-1)

    pen.rectangle((0, 0, size[0] - 1, size[1] - 1), outline=RULE, width=OVERSAMPLING)
    if replay.walls_cm is not None:
        # Pixels count from the top.
        (west, south), (east, north) = on_panel(np.reshape(replay.walls_cm, (2, 2)))
        pen.rectangle((west, north, east, south), outline=MUTED, width=OVERSAMPLING)
    times = np.linspace(max(0.0, time_s - TRAIL_S), time_s, TRAIL_POINTS)
    trails = on_panel(
        np.stack([poses_at(replay, swarm, time) for time in times])[:, : swarm.robots]
    )
    for k, replica in enumerate(swarm.is_replica):
        color = PALE_ORANGE if replica else PALE_BLUE
        pen.line(list(map(tuple, trails[:, k])), fill=color, width=OVERSAMPLING)
    poses = poses_at(replay, swarm, time_s)
    centers = on_panel(poses)
    colors = [GREEN] * replay.objects_of(swarm)
    for k, item in enumerate(replay.items):
        colors += [ITEM_COLORS[ITEM_LOOKS[k % len(ITEM_LOOKS)]]] * item.count
    bodies = zip(centers[swarm.robots :], replay.radii_cm(swarm), colors, strict=True)
    for center, radius_cm, color in bodies:
        pen.circle(tuple(center), radius_cm * scale, fill=color)
    radius = max(replay.robot_radius_cm * scale, 2.0 * OVERSAMPLING)
    # Robots come first.
    for center, heading, replica in zip(centers, poses[:, 2], swarm.is_replica, strict=False):
        if replica:
            pen.circle(
                tuple(center), radius, fill=PALE_ORANGE, outline=ORANGE, width=round(0.28 * radius)
            )
        else:
            pen.circle(tuple(center), radius, fill=BLUE)
        tip = center + radius * np.array([np.cos(heading), -np.sin(heading)])
        pen.line(
            [tuple(center), tuple(tip)],
            fill=INK if replica else PAPER,
            width=max(1, round(0.25 * radius)),
        )
