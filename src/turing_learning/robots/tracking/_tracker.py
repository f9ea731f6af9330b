"""Who is where: markers found in images become tracks of individuals."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from ._calibration import Calibration
from ._markers import Detections, Markers
from ._motion import signed_speeds
from ._opencv import require_image

FROZEN, MISSING, LOST, CARRIED, SURPLUS = "frozen camera", "marker missing", "lost", "carried away", "surplus marker"
"""Kinds of faults."""


@dataclass(frozen=True)
class Fault:
    """Something that a track should not have.

    Attributes
    ----------
    frame
        Where it began, counted from 0.
    kind
        "frozen camera", "marker missing", "lost" (missing for too long), "carried away" (farther than the robot can have
        moved) or "surplus marker".
    text
        What happened, for the operator.
    """

    frame: int
    kind: str
    text: str


@dataclass(frozen=True, eq=False)
class Sighting:
    """What one image shows.

    Attributes
    ----------
    poses : (A, 3)
        x, y (cm), heading (rad, in [-pi, pi)); of an individual that is not present the last one seen, 0 before.
    present : (A,)
        Whether the individual was seen in this image.
    faults
        Faults that begin in this image.
    """

    poses: np.ndarray
    present: np.ndarray
    faults: tuple[Fault, ...]


@dataclass(frozen=True, eq=False)
class Track:
    """Poses of A individuals in T + 1 images.

    Attributes
    ----------
    poses : (T + 1, A, 3)
        x, y (cm), heading (rad, in [-pi, pi)). Where an individual is not present its last pose is repeated: it is no
        observation. Headings are 0 where markers do not show them.
    present : (T + 1, A)
        Whether the individual was seen.
    labels
        Label of each individual's marker.
    interval_s
        Time between images.
    faults
        In the order of their beginning.
    has_headings
        Whether the markers show headings.
    """

    poses: np.ndarray
    present: np.ndarray
    labels: tuple[str, ...]
    interval_s: float
    faults: tuple[Fault, ...] = ()
    has_headings: bool = True

    @property
    def complete(self) -> bool:
        """Whether everybody was seen in every image."""
        return bool(self.present.all())

    def speeds(self) -> np.ndarray:
        """Return the samples (A, T, 2): linear speed (cm/s), angular speed (rad/s); see `signed_speeds`.

        Raises
        ------
        ValueError
            If somebody is not present all the time, or headings are not known: a sample is never made of guesses.
        """
        if not self.has_headings:
            raise ValueError("`markers` must show headings for speeds to be signed; got positions alone.")
        if not self.complete:
            frame, individual = (int(k) for k in np.argwhere(~self.present)[0])
            raise ValueError(
                f"`track` must be complete; got no sight of individual {individual} ({self.labels[individual]}) at frame "
                f"{frame}. Repeat the trial."
            )
        return signed_speeds(self.poses, self.interval_s)


def compare_labels(labels: Sequence[str], seen: Iterable[str]) -> list[str]:
    """Return what is wrong with the markers in sight: fewer or more of a label than expected, or unexpected ones."""
    expected, found = Counter(labels), Counter(seen)
    return [
        f"{found[label]} {label} markers in sight, {expected[label]} expected"
        for label in sorted(expected | found)
        if found[label] != expected[label]
    ]


class Tracker:
    """Follow individuals from image to image.

    Individuals that wear the same label are told apart by where they were: detections are assigned to individuals so
    that the sum of distances is smallest, and nobody moves farther than the robot can. In the first image
    they are numbered by x, then y.

    Parameters
    ----------
    markers
        The kind of marker.
    calibration
        Of the camera.
    labels
        Label of each individual: agents first, then replicas.
    interval_s
        Time between images.
    maximum_speed_cm_s
        Of the robots.
    maximum_gap
        Images for which an individual may be out of sight and be recognized after.
    """

    def __init__(
        self,
        markers: Markers,
        calibration: Calibration,
        labels: Sequence[str],
        *,
        interval_s: float = 0.1,
        maximum_speed_cm_s: float = 12.8,
        maximum_gap: int = 5,
    ) -> None:
        for label in labels:
            markers.check_label(label)
        for name, value in (("interval_s", interval_s), ("maximum_speed_cm_s", maximum_speed_cm_s)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"`{name}` must be a finite number above 0; got {value}.")
        if maximum_gap < 0:
            raise ValueError(f"`maximum_gap` must be 0 or more; got {maximum_gap}.")
        self.markers, self.labels, self.interval_s = markers, tuple(labels), float(interval_s)
        self.calibration = calibration
        self._places = calibration.map_pixels(markers.height_cm)
        self._step = maximum_speed_cm_s * interval_s
        self._maximum_gap = maximum_gap
        self.start()

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of its images (pixels)."""
        return self.calibration.lens.image_size

    def start(self) -> None:
        """Forget who is where: the next image begins a new track."""
        self._frame = -1
        self._poses = np.zeros((len(self.labels), 3))
        self._gap = np.full(len(self.labels), -1)  # images since the last sight; -1: never seen
        self._last_image: np.ndarray | None = None
        self._was_present = np.ones(len(self.labels), bool)
        self._lost = np.zeros(len(self.labels), bool)
        self._surplus: dict[str, int] = {}
        self._frozen = False

    def detect(self, image: np.ndarray) -> Detections:
        """Find the markers in an image (H, W, 3), without following anybody."""
        require_image("image", image, self.image_size)
        return self.markers.detect(image, self._places)

    def follow(self, image: np.ndarray) -> Sighting:
        """Find everybody in the next image (H, W, 3).

        Raises
        ------
        ValueError
            If the image is not of the calibration's size, or not in color.
        """
        require_image("image", image, self.image_size)
        self._frame += 1
        if self._is_frozen(image):
            self._gap[self._gap >= 0] += 1
            return Sighting(self._poses.copy(), np.zeros(len(self.labels), bool), self._report_frozen())
        self._frozen, self._last_image = False, image
        detections = self.markers.detect(image, self._places)
        present, free = self._assign(detections)
        faults = self._report(detections, present, free)
        self._gap[~present & (self._gap >= 0)] += 1
        self._was_present = present
        return Sighting(self._poses.copy(), present, faults)

    def track(self, images: Iterable[np.ndarray]) -> Track:
        """Follow everybody through images of one trial: 51 for the paper's 50 samples.

        Raises
        ------
        ValueError
            If there are fewer than two images.
        """
        self.start()
        sightings = [self.follow(image) for image in images]
        if len(sightings) < 2:
            raise ValueError(f"`images` must be 2 or more; got {len(sightings)}. Check that the camera gives frames.")
        return Track(
            np.array([sighting.poses for sighting in sightings]),
            np.array([sighting.present for sighting in sightings]),
            self.labels,
            self.interval_s,
            tuple(fault for sighting in sightings for fault in sighting.faults),
            self.markers.has_heading,
        )

    def _is_frozen(self, image: np.ndarray) -> bool:
        return self._last_image is not None and np.array_equal(image, self._last_image)

    def _report_frozen(self) -> tuple[Fault, ...]:
        if self._frozen:
            return ()
        self._frozen = True
        text = f"the camera is frozen: image {self._frame} is that before it, to the last bit. Restart the camera."
        return (Fault(self._frame, FROZEN, text),)

    def _assign(self, detections: Detections) -> tuple[np.ndarray, np.ndarray]:
        """Give detections to individuals; return who is present (A,) and which detections (n,) are left."""
        present, free = np.zeros(len(self.labels), bool), np.ones(len(detections.labels), bool)
        worn, seen = np.array(self.labels), np.array(detections.labels)
        for label in dict.fromkeys(self.labels):
            (found,) = np.nonzero(seen == label)
            (known,) = np.nonzero((worn == label) & (self._gap >= 0) & (self._gap <= self._maximum_gap))
            pairs = self._nearest(known, detections.positions[found])
            new = np.nonzero((worn == label) & (self._gap < 0))[0]
            for individual, which in pairs:
                self._see(individual, detections, found[which], present, free)
            left = found[free[found]]
            order = left[np.lexsort((detections.positions[left, 1], detections.positions[left, 0]))]
            for individual, which in zip(new.tolist(), order.tolist(), strict=False):
                self._see(individual, detections, which, present, free)
        return present, free

    def _see(self, individual: int, detections: Detections, which: int, present: np.ndarray, free: np.ndarray) -> None:
        self._poses[individual, :2] = detections.positions[which]
        if detections.headings is not None:
            self._poses[individual, 2] = detections.headings[which]
        self._gap[individual], present[individual], free[which] = 0, True, False

    def _gates(self, individuals: np.ndarray) -> np.ndarray:
        """Return how far (cm) individuals can be from where they were last seen: their way, and a push."""
        return self._step * (self._gap[individuals] + 1) + 1.0

    def _nearest(self, individuals: np.ndarray, positions: np.ndarray) -> list[tuple[int, int]]:
        """Return pairs of individual and row of `positions` (n, 2) with the smallest sum of distances, within gates."""
        distance = np.hypot(*(self._poses[individuals, None, :2] - positions[None]).transpose(2, 0, 1))
        gates = self._gates(individuals)[:, None]
        rows, columns = linear_sum_assignment(np.where(distance <= gates, distance, 1e6))
        return [(individuals[i], j) for i, j in zip(rows, columns, strict=True) if distance[i, j] <= gates[i]]

    def _report(self, detections: Detections, present: np.ndarray, free: np.ndarray) -> tuple[Fault, ...]:
        """Return the faults that begin with this image."""
        gone = np.nonzero(~present & self._was_present)[0]
        faults = [self._explain(individual, detections, free) for individual in gone.tolist()]
        lost = ~present & (self._gap >= self._maximum_gap) & ~self._lost
        self._lost |= lost
        for individual in np.nonzero(lost)[0].tolist():
            text = f"{self._name(individual)} was out of sight for more than {self._maximum_gap} images"
            faults.append(Fault(self._frame, LOST, text + ". Repeat the trial."))
        counts = Counter(label for label, left in zip(detections.labels, free, strict=True) if left)
        for label in sorted(counts):
            if counts[label] > self._surplus.get(label, 0):
                which = next(k for k in np.nonzero(free)[0] if detections.labels[k] == label)
                x, y = detections.positions[which]
                text = f"{counts[label]} {label} markers belong to nobody, one at x, y = {x:.1f}, {y:.1f} cm"
                faults.append(Fault(self._frame, SURPLUS, text + ". Check the markers."))
        self._surplus = dict(counts)
        return tuple(faults)

    def _explain(self, individual: int, detections: Detections, free: np.ndarray) -> Fault:
        """Return the fault that begins when an individual is not seen: its marker is covered, or far away."""
        who, label = self._name(individual), self.labels[individual]
        if self._gap[individual] < 0:
            seen = sum(1 for name in detections.labels if name == label)
            text = f"{seen} {label} markers in the first image, {self.labels.count(label)} expected"
            return Fault(self._frame, MISSING, f"{text}: {who} is missing. Check its marker.")
        x, y, _ = self._poses[individual]
        others = [k for k in np.nonzero(free)[0] if detections.labels[k] == label]
        if others:
            away = min(math.dist(detections.positions[k], (x, y)) for k in others)
            text = f"{who} cannot have moved {away:.1f} cm from x, y = {x:.1f}, {y:.1f} cm: it was carried away"
            return Fault(self._frame, CARRIED, text + ". Repeat the trial.")
        text = f"{who} is out of sight, last seen at x, y = {x:.1f}, {y:.1f} cm: its marker is covered"
        return Fault(self._frame, MISSING, text + ". Look after it.")

    def _name(self, individual: int) -> str:
        return f"individual {individual} ({self.labels[individual]})"
