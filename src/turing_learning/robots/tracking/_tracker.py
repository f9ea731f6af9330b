"""Who is where: markers found in images become tracks of individuals."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from turing_learning._files import whole
from turing_learning.arrays import array
from turing_learning.errors import integer, number, refuse, require
from turing_learning.swarm import Arena, Robot
from turing_learning.trajectories import compute_signals, wrap

from ._camera import Calibration, refuse_taken, require_image
from ._markers import Detections, Markers

FROZEN, MISSING, LOST, CARRIED, SURPLUS = (
    "frozen camera",
    "marker missing",
    "lost",
    "carried away",
    "surplus marker",
)
IRREGULAR = "irregular images"
"""Kinds of faults."""
SIDE_CM, WHEEL_CM, PUSH_CM, SCATTER, LATE = 0.2, 0.2, 0.7, 10.0, 0.5
"""How much farther than it can drive a robot, and each of its wheels, may be seen to move sideways, and along,
between two images; how much more where others, or walls, push it; how often more what is usually seen sideways:
experiments/laboratory/carried.py. And how late an image may be (intervals), as for a camera."""


@dataclass(frozen=True)
class Fault:
    """Something that a track should not have."""

    frame: int  #: Where it began, counted from 0
    #: "frozen camera", "marker missing", "lost" (missing for too long), "carried away" (farther than the robot can
    #: have moved, or turned), "surplus marker" or "irregular images" (late, or left out)
    kind: str
    text: str  #: What happened, for the operator


@dataclass(frozen=True, eq=False)
class Sighting:
    """What one image shows."""

    #: (A, 3): x, y (cm), heading (rad, in [-pi, pi)); of an individual that is not present the last one seen, 0 before
    poses: np.ndarray
    present: np.ndarray  #: (A,): Whether the individual was seen in this image
    faults: tuple[Fault, ...]  #: Faults that begin in this image


@dataclass(frozen=True, eq=False)
class Track:
    """Poses of A individuals in T + 1 images."""

    #: (T + 1, A, 3): x, y (cm), heading (rad, in [-pi, pi)). Where an individual is not present its last pose is
    #: repeated: it is no observation. Headings are 0 where markers do not show them.
    poses: np.ndarray
    present: np.ndarray  #: (T + 1, A): Whether the individual was seen
    labels: tuple[str, ...]  #: Label of each individual's marker
    interval_s: float  #: Time between images
    faults: tuple[Fault, ...] = ()  #: In the order of their beginning
    has_headings: bool = True  #: Whether the markers show headings

    @property
    def lost(self) -> np.ndarray:
        """Which images (T + 1,) were lost, each alone: nobody was seen in them, and everybody in those before and after."""
        detected = self.present.sum(axis=1)
        lost = np.zeros(len(detected), bool)
        lost[1:-1] = (
            (detected[1:-1] == 0)
            & (detected[:-2] == len(self.labels))
            & (detected[2:] == len(self.labels))
        )
        return lost

    @property
    def complete(self) -> bool:
        """Whether everybody was seen in every image that was not `lost`."""
        return bool((self.present.all(axis=1) | self.lost).all())

    def bridged(self) -> "Track":
        """Return it with everybody midway between the poses before and after a single lost image."""
        # Never two in a row
        poses, frames = self.poses.copy(), np.flatnonzero(self.lost)
        displacement = poses[frames + 1] - poses[frames - 1]
        displacement[..., 2] = wrap(displacement[..., 2])
        poses[frames] = poses[frames - 1] + displacement / 2
        poses[frames, :, 2] = wrap(poses[frames, :, 2])
        return replace(self, poses=poses)

    def speeds(self) -> np.ndarray:
        """Return the samples (A, T, 2): linear speed (cm/s), angular speed (rad/s); see `signed_speeds`.

        Where an image was lost alone, the two samples around it are both what was seen over twice the interval.
        A track with other gaps, or without headings, is rejected: a sample is never made of guesses.
        """
        rule = "show headings for speeds to be signed"
        require(self.has_headings, "markers", rule, "positions alone")
        if not self.complete:
            frame, who = map(int, np.argwhere(~self.present)[0])
            gap = f"no sight of {_named(self.labels)[who]} at frame {frame}"
            refuse("track", "be complete", gap, "Repeat the trial.")
        return signed_speeds(self.bridged().poses, self.interval_s)


def _named(labels: Sequence[str]) -> list[str]:
    return [f"individual {who} ({label})" for who, label in enumerate(labels)]


def impossible(track: Track, robot: Robot, arena: Arena | None = None) -> tuple[Fault, ...]:
    """Return a fault for each individual of a track that is not always seen, or that moves as a robot on two
    wheels cannot: these turn only so fast, and it moves sideways only by turns between two images. Without an
    arena all may push each other always.
    """
    positions = track.poses[..., :2]
    everybody = range(len(track.labels))
    names = _named(track.labels)
    gaps = ~track.present & ~track.lost[:, None]
    faults = []
    for who in np.flatnonzero(gaps.any(axis=0)).tolist():
        text = f"{names[who]} is out of sight. Look after it."
        faults.append(Fault(int(np.argmax(gaps[:, who])), MISSING, text))
    room = room_around(positions, robot, arena)
    sights = []
    for individual in everybody:
        for frames in pairwise(np.flatnonzero(track.present[:, individual])):
            sights.append((individual, *frames))
    if not sights:
        return tuple(faults)
    who, before, after = np.array(sights).T
    steps = track.poses[after, who] - track.poses[before, who]
    times = (after - before) * track.interval_s
    turned = wrap(steps[:, 2])
    from_middle = robot.wheel_distance_cm / 2
    reach = robot.maximum_speed_cm_s * (times + LATE * track.interval_s)
    middle = track.poses[before, who, 2] + turned / 2
    if not track.has_headings:
        middle = np.arctan2(steps[:, 1], steps[:, 0])
    aside = np.abs(steps[:, 1] * np.cos(middle) - steps[:, 0] * np.sin(middle))
    along = np.abs(steps[:, 0] * np.cos(middle) + steps[:, 1] * np.sin(middle)) / np.sinc(
        turned / (2 * np.pi)
    )
    pushed = np.minimum(room[before, who], room[after, who]) <= reach
    # what the tracker's noise makes, by the steps that nobody can have disturbed
    scatter = 0.0
    if not pushed.all():
        scatter = SCATTER * np.median(aside[~pushed])
    slack = PUSH_CM * pushed + scatter
    # Turns between two images move a robot aside, by their sagitta at most
    sideways = aside > reach * reach / from_middle / 8 + SIDE_CM + slack
    wrong = sideways | (along + np.abs(turned) * from_middle > reach + WHEEL_CM + slack)
    for step in sorted({int(np.argmax(wrong & (who == individual))) for individual in who[wrong]}):
        how = f"{np.hypot(*steps[step, :2]):.1f} cm and turned {np.degrees(turned[step]):.0f} degrees like this"
        text = f"{names[who[step]]} cannot have moved {how}: it was carried, or turned by hand. Repeat the trial."
        faults.append(Fault(int(after[step]), CARRIED, text))
    return tuple(faults)


def room_around(positions: np.ndarray, robot: Robot, arena: Arena | None = None) -> np.ndarray:
    """Return how far (cm) robots at positions (T, A, 2) are from the next one, or a wall: there they can be pushed.

    Without an arena all may be pushed always.
    """
    if arena is None:
        return np.full(positions.shape[:2], -math.inf)
    everybody = range(positions.shape[1])
    between = np.linalg.norm(positions[:, :, None] - positions[:, None], axis=-1)
    between[:, everybody, everybody] = math.inf
    room = np.asarray(between.min(axis=-1) - 2 * robot.radius_cm)
    if arena.width_cm and arena.height_cm:
        sides = np.array([arena.width_cm, arena.height_cm])
        walls = np.minimum(positions, sides - positions).min(axis=-1) - robot.radius_cm
        room = np.minimum(room, walls)
    return room


def signed_speeds(poses: np.ndarray, interval_s: float) -> np.ndarray:
    """Return the samples (A, T, 2) of poses (T + 1, A, 3), x, y (cm), heading (rad, anticlockwise): linear
    (cm/s), angular speed (rad/s). See `trajectories.compute_signals`; the sign is that of the footnote in the
    paper's section 3.2.3.
    """
    poses = array("poses", poses, "T+1 A 3")
    require(len(poses) >= 2, "poses", "be of shape (T + 1, A, 3) with T >= 1", poses.shape)
    fps = 1 / number("interval_s", interval_s, above=0)
    signals = compute_signals(
        poses[..., :2], fps=fps, names=("speed", "turn"), headings=poses[..., 2]
    )
    return signals.values.transpose(1, 0, 2)


def write_table(track: Track, path: Path, *, force: bool = False) -> None:
    """Write a table: frame, x, y (cm), id from 1, agents first, and heading (rad) where markers show it; a row where it was seen.

    Read it with ``load_trajectories(path, fps=..., pixels_per_cm=1, y_axis="up")``. Raise FileExistsError for a
    file that exists, unless `force`.
    """
    refuse_taken(path, name="out", force=force)
    sightings = np.argwhere(track.present)
    x, y, heading = track.poses[track.present].T
    names = ["frame", "x", "y", "id"]
    formats = ["%d", "%.4f", "%.4f", "%d"]
    columns = [sightings[:, 0], x, y, sightings[:, 1] + 1]
    if track.has_headings:
        names.append("heading")
        formats.append("%.5f")
        columns.append(heading)
    rows = np.column_stack(columns)
    with whole(path) as temporary:
        np.savetxt(
            temporary, rows, formats, ",", header=",".join(names), comments="", encoding="utf-8"
        )


def compare_labels(labels: Sequence[str], seen: Iterable[str]) -> list[str]:
    """Return what is wrong with the markers in sight: fewer or more of a label than expected, or unexpected ones."""
    expected = Counter(labels)
    counts = Counter(seen)
    complaints = []
    for label in sorted(expected | counts):
        if counts[label] != expected[label]:
            numbers = f"{counts[label]} {label} markers in sight, {expected[label]} expected"
            complaints.append(numbers)
    return complaints


class Tracker:
    """Follow individuals from image to image.

    Individuals with the same label are told apart by where they were: detections are assigned to individuals so
    that the sum of distances is smallest, and nobody moves farther than the robot can. In the first image
    they are numbered by x, then y.

    Parameters
    ----------
    markers, calibration
        The kind of marker; the camera.
    labels
        Label of each individual: agents first, then replicas.
    interval_s, maximum_speed_cm_s, maximum_turn_rad_s
        Time between images; of the robots.
    maximum_gap
        Number of images for which an individual may be out of sight and be recognized afterwards.
    """

    def __init__(
        self, markers: Markers, calibration: Calibration, labels: Sequence[str], *, interval_s: float = 0.1,
        maximum_speed_cm_s: float = 12.8, maximum_turn_rad_s: float = 2 * 12.8 / 5.1, maximum_gap: int = 5,
    ) -> None:  # fmt: skip
        for label in labels:
            markers.check_label(label)
        self.markers = markers
        self.calibration = calibration
        self.labels = tuple(labels)
        self.interval_s = number("interval_s", interval_s, above=0)
        speed = number("maximum_speed_cm_s", maximum_speed_cm_s, above=0)
        turn = number("maximum_turn_rad_s", maximum_turn_rad_s, above=0)
        self._robot = Robot(maximum_speed_cm_s=speed, wheel_distance_cm=2 * speed / turn)
        self._maximum_gap = integer("maximum_gap", maximum_gap)
        self._places = calibration.map_pixels(markers.height_cm)
        self.start()

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of its images (pixels)."""
        return self.calibration.lens.image_size

    def start(self) -> None:
        """Forget who is where: the next image begins a new track."""
        self._frame = -1
        self._poses = np.zeros((len(self.labels), 3))
        # Images since the last sight; -1: never seen
        self._gap = np.full(len(self.labels), -1)
        self._last_image: np.ndarray | None = None
        self._was_present = np.ones(len(self.labels), bool)
        self._lost = np.zeros(len(self.labels), bool)
        self._surplus: Counter[str] = Counter()
        self._frozen = False

    def detect(self, image: np.ndarray) -> Detections:
        """Find the markers in an image (H, W, 3), without following anybody."""
        require_image("image", image, self.image_size)
        return self.markers.detect(image, self._places)

    def follow(self, image: np.ndarray | None) -> Sighting:
        """Find everybody in the next image (H, W, 3); in one that was lost, None, is nobody."""
        self._frame += 1
        faults = []
        present = np.zeros(len(self.labels), bool)
        same = (
            image is not None
            and self._last_image is not None
            and np.array_equal(image, self._last_image)
        )
        if same and not self._frozen:
            text = f"the camera is frozen: image {self._frame} is that before it, to the last bit. Restart the camera."
            faults.append(Fault(self._frame, FROZEN, text))
        self._frozen = same or (self._frozen and image is None)
        if image is not None and not same:
            detections = self.detect(image)
            self._last_image = image
            present, free = self._assign(detections)
            faults += self._report(detections, present, free)
            self._was_present = present
        self._gap[~present & (self._gap >= 0)] += 1
        return Sighting(self._poses.copy(), present, tuple(faults))

    def track(self, images: Iterable[np.ndarray | None]) -> Track:
        """Follow everybody through the images of one trial, two or more: 51 for the paper's 50 samples."""
        self.start()
        sightings = list(map(self.follow, images))
        remedy = "Check that the camera gives frames."
        require(len(sightings) >= 2, "images", "be 2 or more", len(sightings), remedy)
        poses = np.array([sighting.poses for sighting in sightings])
        present = np.array([sighting.present for sighting in sightings])
        faults: list[Fault] = []
        for sighting in sightings:
            faults += sighting.faults
        track = Track(
            poses, present, self.labels, self.interval_s, has_headings=self.markers.has_heading
        )
        faults += [fault for fault in impossible(track, self._robot) if fault.kind == CARRIED]
        return replace(track, faults=tuple(sorted(faults, key=lambda fault: fault.frame)))

    def _assign(self, detections: Detections) -> tuple[np.ndarray, np.ndarray]:
        """Assign detections to individuals; return who is present (A,) and which detections (n,) are free."""
        present = np.zeros(len(self.labels), bool)
        free = np.ones(len(detections.labels), bool)
        worn = np.array(self.labels)
        detected = np.array(detections.labels)
        for label in dict.fromkeys(self.labels):
            (candidates,) = np.nonzero(detected == label)
            (tracked,) = np.nonzero(
                (worn == label) & (self._gap >= 0) & (self._gap <= self._maximum_gap)
            )
            (unplaced,) = np.nonzero((worn == label) & (self._gap < 0))
            apart = self._poses[tracked, None, :2] - detections.positions[None, candidates]
            distance = np.hypot(apart[..., 0], apart[..., 1])
            reach = (
                self._robot.maximum_speed_cm_s * self.interval_s * (self._gap[tracked] + 1 + LATE)
            )
            reachable = distance <= (reach + WHEEL_CM + PUSH_CM)[:, None]
            # The least sum of distances keeps identities where robots pass each other
            rows, columns = linear_sum_assignment(np.where(reachable, distance, 1e6))
            # What is beyond reach is matched by no robot: it was carried there, or is another marker
            pairs = []
            unassigned = candidates
            for i, j in zip(rows, columns, strict=True):
                if reachable[i, j]:
                    pairs.append((tracked[i], candidates[j]))
                    unassigned = unassigned[unassigned != candidates[j]]
            # nobody knows who was not yet seen: they are numbered by x, then y
            x, y = detections.positions[unassigned].T
            order = unassigned[np.lexsort((y, x))]
            for who, which in [*pairs, *zip(unplaced.tolist(), order.tolist(), strict=False)]:
                self._poses[who, :2] = detections.positions[which]
                if detections.headings is not None:
                    self._poses[who, 2] = detections.headings[which]
                self._gap[who] = 0
                present[who] = True
                free[which] = False
        return present, free

    def _report(
        self, detections: Detections, present: np.ndarray, free: np.ndarray
    ) -> Iterator[Fault]:
        """Yield the faults that begin in this image; `free` are the detections (n,) that belong to nobody."""
        names = _named(self.labels)
        surplus = np.flatnonzero(free).tolist()
        for who in np.flatnonzero(~present & self._was_present).tolist():
            label = self.labels[who]
            x, y, _ = self._poses[who]
            away = []
            for k in surplus:
                if detections.labels[k] == label:
                    away.append(math.dist(detections.positions[k], (x, y)))
            if self._gap[who] < 0:
                count = f"{detections.labels.count(label)} {label} markers in the first image"
                text = f"{count}, {self.labels.count(label)} expected: {names[who]} is missing. Check its marker."
                yield Fault(self._frame, MISSING, text)
            elif away:
                how = f"{names[who]} cannot have moved {min(away):.1f} cm from x, y = {x:.1f}, {y:.1f} cm"
                yield Fault(self._frame, CARRIED, f"{how}: it was carried away. Repeat the trial.")
            else:
                message = f"{names[who]} is out of sight, last seen at x, y = {x:.1f}, {y:.1f} cm"
                yield Fault(
                    self._frame, MISSING, f"{message}: its marker is covered. Look after it."
                )
        # Said once, not in each image
        lost = ~present & (self._gap >= self._maximum_gap) & ~self._lost
        self._lost |= lost
        for who in np.flatnonzero(lost).tolist():
            text = f"{names[who]} was out of sight for more than {self._maximum_gap} images. Repeat the trial."
            yield Fault(self._frame, LOST, text)
        # Said when there are more than in the image before
        counts = Counter(detections.labels[k] for k in surplus)
        for label in sorted(counts):
            if counts[label] > self._surplus[label]:
                example = next(k for k in surplus if detections.labels[k] == label)
                x, y = detections.positions[example]
                text = f"{counts[label]} {label} markers belong to nobody, one at x, y = {x:.1f}, {y:.1f} cm"
                yield Fault(self._frame, SURPLUS, text + ". Check the markers.")
        self._surplus = counts
