"""The paper's scenarios, what a scenario says, and where its swarm starts."""

import math
import re
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

from turing_learning.models import REPRESENTATIONS, Settings

from ..errors import brief, choice, integer, nearest, number, refuse, require
from ..models import FULL_VIEW, ReactiveModel

ITEM_KINDS = ("background", "robot", "object")
"""What a sensor may tell apart in every scenario; the background is what it reads where it sees no
item."""

MOST_STATES = 100
"""Of a sensor: a recorded reading has 8 bits."""

MOBILITIES = ("fixed", "pushed", "seen")
"""How bodies of a type of one's own behave: see `Item`."""

LONGEST_LAG = 1000
"""Control cycles; a longer lag would leave robots at rest."""

ENKI_GRAVITY = 9.81
"""Acceleration of gravity (cm/s^2) that Enki writes into its world of centimetres."""


EARTH_GRAVITY = 981.0
"""Acceleration of gravity on earth (cm/s^2)."""


@dataclass(frozen=True)
class Start:
    """What starts in a trial, and the rectangle in which centers are drawn."""

    #: (number, radius in cm) of what needs room there: robots, then objects and items of one's own
    disks: tuple[tuple[int, float], ...]
    corner_cm: float  #: x and y of the corner of the rectangle
    sides_cm: tuple[float, float]  #: Its width and height
    #: Number of bodies that need no room there: placed elsewhere, or only seen
    others: int = 0

    @property
    def bodies(self) -> int:
        """Number of robots, objects and items."""
        return sum(number for number, _ in self.disks) + self.others

    @property
    def crowd(self) -> str:
        """Which bodies have no room side by side, in words; empty if nothing speaks against it."""
        for _, radius_cm in self.disks:
            # Disks of one size are compared with what has room; larger ones count as if they had
            # this size.
            numbers = [number for number, other_cm in self.disks if other_cm >= radius_cm]
            count = sum(numbers)
            room = most_disks(self.sides_cm, radius_cm)
            if count > room:
                or_more = " or more" if len(numbers) > 1 else ""
                size = f"radius {radius_cm:g} cm{or_more}"
                return f"at most {math.floor(room)} of {count} bodies of {size} have room"
        return ""


def most_disks(sides_cm: tuple[float, float], radius_cm: float) -> float:
    """Return a number that disks in a rectangle cannot exceed; fewer may fit.

    The centers lie in the rectangle, and no two disks overlap.

    Source: N. Oler, An inequality in the geometry of numbers, Acta Mathematica 105 (1961) 19:
    points of a convex region of area A and perimeter P, no two closer than 1, are at most 2 A /
    sqrt(3) + P / 2 + 1.
    """
    width = sides_cm[0] / (2 * radius_cm)
    height = sides_cm[1] / (2 * radius_cm)
    bound = 2 / math.sqrt(3) * width * height + width + height + 1
    # Rounding never refuses a body
    return bound * (1 + 1e-9)


@dataclass(frozen=True)
class Robot(Settings):
    """A differential-wheeled robot, a disk: the e-puck as modeled by Enki (paper, section 4.1)."""

    radius_cm: float = 3.5  #: Of the body (cm)
    mass_g: float = 150.0  #: Of all of it (g)
    wheel_distance_cm: float = 5.1  #: Between the wheels (cm)
    maximum_speed_cm_s: float = 12.8  #: Of a wheel whose speed is 1 (cm/s)
    #: In each control cycle the speed of each wheel is multiplied by a number uniform in 1 -
    #: wheel_noise to 1 + wheel_noise; 0 to below 1
    wheel_noise: float = 0.05
    #: Whether wheels turn no faster than the maximum, also if a controller or the noise asks for it
    clamp_wheel_speeds: bool = False
    #: Control cycles that pass between a reading and the wheel speeds that answer it; before the
    #: first, robots rest
    actuation_lag_cycles: int = 0
    #: The speed of each wheel is multiplied by a number uniform in 1 - wheel_scale_spread to 1 +
    #: wheel_scale_spread that stays the same throughout a trial; 0 to below 1
    wheel_scale_spread: float = 0.0
    #: Largest share of a wheel's speed that is lost on the ground: in each control cycle a number
    #: uniform in 0 to slip
    slip: float = 0.0

    def __post_init__(self) -> None:
        for name in ("radius_cm", "mass_g", "wheel_distance_cm", "maximum_speed_cm_s"):
            number(f"robot.{name}", getattr(self, name), above=0)
        for name in ("wheel_noise", "wheel_scale_spread", "slip"):
            number(f"robot.{name}", getattr(self, name), least=0, below=1)
        integer("robot.actuation_lag_cycles", self.actuation_lag_cycles, 0, LONGEST_LAG)


@dataclass(frozen=True)
class Objects(Settings):
    """Movable disks with dry friction (paper, section 4.1)."""

    count: int = 0  #: Number O of objects in a trial
    radius_cm: float = 5.0  #: Of each (cm)
    mass_g: float = 35.0  #: Of each (g)
    #: Coefficient of dry friction on the ground, without unit; what it does is in docs/physics.md
    friction: float = 0.58
    #: Acceleration of gravity (cm/s^2) that presses objects on the ground: 9.81 in Enki, 981 on
    #: earth
    gravity_cm_s2: float = ENKI_GRAVITY

    def __post_init__(self) -> None:
        integer("objects.count", self.count, 0)
        number("objects.radius_cm", self.radius_cm, above=0)
        number("objects.mass_g", self.mass_g, above=0)
        number("objects.friction", self.friction, least=0)
        number("objects.gravity_cm_s2", self.gravity_cm_s2, least=0)


@dataclass(frozen=True)
class Item(Settings):
    """A type of item of one's own, such as a landmark or a light: disks that sensors may tell apart by its name.

    Source: paper, section 3.2.1: a line-of-sight sensor tells n types of items apart.
    """

    count: int = 1  #: Number of them in a trial, whatever the number of robots
    radius_cm: float = 5.0  #: Of each (cm), as touched and as seen
    #: "fixed": robots and objects bump into it, and it stays; "pushed": it moves as objects do;
    #: "seen": nothing touches it, as a light
    mobility: Literal["fixed", "pushed", "seen"] = "fixed"
    mass_g: float = 35.0  #: Of each (g), if it is pushed
    #: Coefficient of dry friction on the ground, if it is pushed; gravity is that of the objects
    friction: float = 0.58
    #: x and y (cm) of each at the beginning of every trial, in the coordinates of the arena or of
    #: the start square; if there are none, they are drawn anew for each trial, as those of robots
    centers_cm: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        integer("count", self.count, 0)
        number("radius_cm", self.radius_cm, above=0)
        choice("mobility", self.mobility, MOBILITIES)
        number("mass_g", self.mass_g, above=0)
        number("friction", self.friction, least=0)
        centers = self.centers_cm
        if not centers:
            return
        fits = all(len(center) == 2 and all(map(math.isfinite, center)) for center in centers)
        require(fits, "centers_cm", "be pairs of finite numbers, x and y", brief(centers))
        rule = f"be {len(centers)}, as so many centers are stated, or be left out"
        require(self.count in (1, len(centers)), "count", rule, self.count)
        object.__setattr__(self, "count", len(centers))

    @property
    def touched(self) -> bool:
        """Whether other bodies bump into it."""
        return self.mobility != "seen"


@dataclass(frozen=True)
class Arena(Settings):
    """The ground: unbounded, or a rectangle of walls with one corner at the origin."""

    width_cm: float | None = None  #: Side along x (cm); None for both without walls
    height_cm: float | None = None  #: Side along y (cm)

    def __post_init__(self) -> None:
        sides = (self.width_cm, self.height_cm)
        names = "arena.width_cm and arena.height_cm"
        fits = sides.count(None) != 1
        require(fits, names, "be both given or both left out", brief(sides))
        if self.width_cm is not None:
            number("arena.width_cm", self.width_cm, above=0)
        if self.height_cm is not None:
            number("arena.height_cm", self.height_cm, above=0)

    @property
    def bounded(self) -> bool:
        """Whether there are walls."""
        return self.width_cm is not None


@dataclass(frozen=True)
class Sensor(Settings):
    """A sensor of unlimited range: the reading I is the place of the nearest visible item's kind in `readings`.

    An item is visible if any part of its disk lies in view. Source: paper, sections 3.2.1 and
    4.6.1.
    """

    #: "background", reading 0, then what the sensor tells apart: "robot", "object", and names of the
    #: scenario's own items. What is not listed is invisible: the sensor looks through it
    readings: tuple[str, ...] = ("background", "robot")
    #: Of the agents (rad), 0 to 2 pi, centered on the heading; 0 is a line of sight
    field_of_view: float = 0.0
    #: Probability that a reading is wrong in a control cycle: any of the other states, all equally
    #: likely
    mistakes: float = 0.0

    def __post_init__(self) -> None:
        # Which names there are, only the scenario knows.
        names = self.readings
        fits = names[:1] == ("background",) and len(set(names)) == len(names) <= MOST_STATES
        rule = f"be 'background', then any of the items, each once, {MOST_STATES} at most"
        require(fits, "sensor.readings", rule, brief(names))
        fits = 0 <= self.field_of_view <= FULL_VIEW
        rule = "be an angle from 0 to 2 pi = 6.283185 (rad)"
        require(fits, "sensor.field_of_view", rule, self.field_of_view)
        number("sensor.mistakes", self.mistakes, least=0, most=1)

    @property
    def states(self) -> int:
        """Number of sensor states n."""
        return len(self.readings)

    def reading_of(self, item: str) -> int:
        """Return the reading I that an item gives: "robot", "object", or one of the scenario's own.

        0 if the sensor does not see it.
        """
        if item in self.readings:
            return self.readings.index(item)
        return 0


@dataclass(frozen=True)
class Trial(Settings):
    """How long individuals are observed, how time is cut, where they start (paper, sections 4.1 and 4.2)."""

    duration_s: float = 10.0  #: Of a trial (s), a whole number of control intervals
    #: Of a control cycle (s), in which a robot reads its sensor once; also the time step of the
    #: samples
    control_interval_s: float = 0.1
    physics_steps: int = 10  #: Steps of the physics in a control cycle
    #: Side (cm) of the square in which all start where there are no walls
    start_side_cm: float = 331.66

    def __post_init__(self) -> None:
        for name in ("duration_s", "control_interval_s", "start_side_cm"):
            number(f"trial.{name}", getattr(self, name), above=0)
        integer("trial.physics_steps", self.physics_steps, 1)
        self.steps_of(self.duration_s, "trial.duration_s")

    def steps_of(self, duration_s: float, name: str) -> int:
        """Return the number of control cycles in a duration.

        Reject it, by its name, if it is not a whole number.
        """
        cycles = duration_s / self.control_interval_s
        is_whole = (
            math.isfinite(cycles) and round(cycles) >= 1 and abs(cycles - round(cycles)) < 1e-6
        )
        rule = f"be a whole number of control intervals of {self.control_interval_s} s"
        require(is_whole, name, rule, duration_s)
        return round(cycles)


@dataclass(frozen=True)
class Tracking(Settings):
    """What measures the robots' speeds: images of their poses, one in each control cycle, perfect by default.

    A laboratory has a tracker of its own; what the camera of an emulated one shows has this noise
    and delay.
    """

    #: Standard deviation (cm) of x and of y in an image
    position_noise_cm: float = 0.0
    #: Standard deviation (rad) of the heading in an image
    heading_noise_rad: float = 0.0
    #: How old the poses are that an image shows (s); before the trial, robots rest
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("position_noise_cm", "heading_noise_rad", "delay_s"):
            number(f"tracker.{name}", getattr(self, name), least=0)

    @property
    def perfect(self) -> bool:
        """Whether there is neither noise nor delay."""
        return self == Tracking()


WORLDS: dict[str, dict[str, dict[str, Any]]] = {
    "enki": {"objects": {"gravity_cm_s2": ENKI_GRAVITY}, "robot": {"actuation_lag_cycles": 0}},
    "paper": {"objects": {"gravity_cm_s2": EARTH_GRAVITY}, "robot": {"actuation_lag_cycles": 1}},
}
"""Named worlds, and what a scenario has in them: "enki" is exactly the paper's simulator as it is
published, "paper" the world in which the printed numbers come out (docs/decisions/0036)."""


@dataclass(frozen=True)
class Scenario(Settings):
    """A swarm to be inferred: agents that execute `controller`, and replicas that execute models.

    `robot`, `objects`, `arena`, `sensor` and `trial` say what moves, where, what it senses, and for
    how long;
    `tracker` how well that is observed.
    """

    name: str  #: By which it is called
    title: str  #: A heading
    description: str  #: A sentence for reports
    #: The agents' parameters (2 n), left and right wheel speed for each sensor state, fractions of
    #: the maximum
    controller: tuple[float, ...]
    agents: int = 10  #: Their number in a trial
    #: Their number; they come after the agents, objects after all robots
    replicas: int = 1
    #: "mixed": replicas move among the agents. "separated": agents and replicas never meet; both
    #: have trials of their own, in groups of agents + replicas individuals (paper, section 4.6.3)
    grouping: Literal["mixed", "separated"] = "mixed"
    robot: Robot = field(default_factory=Robot)
    objects: Objects = field(default_factory=Objects)
    arena: Arena = field(default_factory=Arena)
    sensor: Sensor = field(default_factory=Sensor)
    trial: Trial = field(default_factory=Trial)
    tracker: Tracking = field(default_factory=Tracking)
    #: Own types of items by their names; in arrays they come last, in this order
    items: dict[str, Item] = field(default_factory=dict, hash=False)
    #: What a model is: "reactive" for the wheel speeds alone, "morphology" for the field of view
    #: as well. Models of which the agents are none, networks, are up to the configuration
    representation: str = "reactive"
    #: Whether `controller` is what the agents execute, so that models are compared with it. False
    #: for robots in a laboratory whose rule nobody knows: then it is that of a rehearsal's agents
    #: only
    known: bool = True

    def __post_init__(self) -> None:
        choice("scenario.representation", self.representation, REPRESENTATIONS)
        integer("scenario.agents", self.agents, 1)
        integer("scenario.replicas", self.replicas, 1)
        choice("scenario.grouping", self.grouping, ("mixed", "separated"))
        states = self.sensor.states
        speeds = self.controller
        rule = f"be {2 * states} wheel speeds, two for each of the {states} sensor states"
        require(len(speeds) == 2 * states, "scenario.controller", rule, brief(speeds))
        fits = all(map(math.isfinite, speeds))
        require(fits, "scenario.controller", "be finite wheel speeds", brief(speeds))
        self._check_items()
        start = self.start()
        rule = f"be more than the diameter of what moves in it, {2 * start.corner_cm:g}"
        width_cm, height_cm = start.sides_cm
        require(width_cm > 0, "scenario.arena.width_cm", rule, self.arena.width_cm)
        require(height_cm > 0, "scenario.arena.height_cm", rule, self.arena.height_cm)
        self._require_room(start)

    def _check_items(self) -> None:
        """Reject items that have no name of their own, readings of none, and walls in the way."""
        for name, item in self.items.items():
            fits = re.fullmatch(r"[A-Za-z0-9_-]+", name) and name not in ITEM_KINDS
            rule = f"have names of letters, digits, - and _, other than {ITEM_KINDS}"
            require(fits, "scenario.items", rule, brief(name))
            if not (item.touched and self.arena.bounded):
                continue
            size = (self.arena.width_cm, self.arena.height_cm)
            rule = f"lie inside the arena of {size[0]} x {size[1]} cm, and touch no wall"
            for center in item.centers_cm:
                for position, side in zip(center, size, strict=True):
                    fits = item.radius_cm <= position <= (side or 0.0) - item.radius_cm
                    require(fits, f"scenario.items.{name}.centers_cm", rule, brief(center))
        names = (*ITEM_KINDS, *self.items)
        for name in self.sensor.readings:
            rule = f"hold 'background', then any of {(*ITEM_KINDS[1:], *self.items)}"
            remedy = f"Describe it below [scenario.items.{name}]. {nearest(name, names)}"
            require(name in names, "scenario.sensor.readings", rule, repr(name), remedy)

    def _require_room(self, start: Start) -> None:
        """Reject a place that is too small for the bodies that start in it."""
        if not start.crowd:
            return
        name = "scenario.trial.start_side_cm"
        size = f"{self.trial.start_side_cm:g}"
        if self.arena.bounded:
            name = "scenario.arena"
            size = f"{self.arena.width_cm:g} x {self.arena.height_cm:g}"
        rule = "have room for the bodies that start in it"
        bodies = "fewer or smaller bodies (scenario.agents, scenario.robot.radius_cm)"
        refuse(name, rule, f"{size} cm, where {start.crowd}", f"Enlarge it, or take {bodies}.")

    def start(self, robots: int | None = None, side_cm: float | None = None) -> Start:
        """Return what starts where: within the walls, else in the start square.

        Parameters
        ----------
        robots
            Number of robots; objects and the area of the square grow in proportion, items do not.
            None takes the scenario's.
        side_cm
            Side of a square in which all start instead.
        """
        if robots is None:
            robots = self.individuals
        growth = robots / self.individuals
        disks = [(robots, self.robot.radius_cm)]
        objects = round(self.objects.count * growth)
        if objects:
            disks.append((objects, self.objects.radius_cm))
        others = 0
        for item in self.items.values():
            if item.centers_cm or not item.touched:
                others += item.count
            elif item.count:
                disks.append((item.count, item.radius_cm))
        width, height = self.arena.width_cm, self.arena.height_cm
        if width is None or height is None or side_cm is not None:
            if side_cm is None:
                side_cm = self.trial.start_side_cm * math.sqrt(growth)
            return Start(tuple(disks), 0.0, (side_cm, side_cm), others)
        # All centers keep the largest radius from the walls.
        margin = max(radius for _, radius in disks)
        return Start(tuple(disks), margin, (width - 2 * margin, height - 2 * margin), others)

    @property
    def world(self) -> str:
        """Name of the world whose settings these are, "own" if it has none."""
        for name in WORLDS:
            if self.in_world(name) == self:
                return name
        return "own"

    def in_world(self, name: str) -> Self:
        """Return the scenario in one of `WORLDS`; all else stays."""
        choice("world", name, WORLDS, noun="world")
        changed = {}
        for section, settings in WORLDS[name].items():
            changed[section] = replace(getattr(self, section), **settings)
        return replace(self, **changed)

    @property
    def bodies(self) -> int:
        """Number of robots, objects and items in a trial."""
        return self.individuals + self.objects.count + self.own_bodies

    @property
    def own_bodies(self) -> int:
        """Number of items of one's own in a trial."""
        return sum(item.count for item in self.items.values())

    @property
    def individuals(self) -> int:
        """Number of robots in a trial, agents and replicas."""
        return self.agents + self.replicas

    @property
    def model(self) -> ReactiveModel:
        """What agents and models are: their parameters, and what a robot with them executes."""
        return REPRESENTATIONS[self.representation](self.sensor.states)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters that agents and models have."""
        return self.model.parameter_names

    @property
    def parameter_labels(self) -> tuple[str, ...]:
        """Names of the parameters, with units where they have any, for figures."""
        labels = []
        for name, unit in zip(self.model.parameter_names, self.model.parameter_units, strict=True):
            labels.append(f"{name} ({unit})" if unit else name)
        return tuple(labels)

    @property
    def truth(self) -> tuple[float, ...] | None:
        """The agents' parameters; None if they are not known."""
        if not self.known:
            return None
        return self.model.truth(self.controller, self.sensor.field_of_view)

    @property
    def control_steps(self) -> int:
        """Number of control cycles T in a trial."""
        return self.trial.steps_of(self.trial.duration_s, "trial.duration_s")

    @property
    def input_scale(self) -> tuple[float, float]:
        """Largest linear (cm/s) and angular speed (rad/s) of the robot, by which the classifiers' inputs are divided."""
        speed = self.robot.maximum_speed_cm_s
        return (speed, 2 * speed / self.robot.wheel_distance_cm)


AGGREGATION = Scenario(
    name="aggregation", title="Aggregation",
    description="Robots that see other robots gather in one place (paper, section 3.2.1).",
    controller=(-0.7, -1.0, 1.0, -1.0), agents=10, replicas=1, trial=Trial(start_side_cm=331.66),
)  # fmt: skip
"""The paper's first case study: robots gather."""

OBJECT_CLUSTERING = Scenario(
    name="object-clustering", title="Object clustering",
    description="Robots that see objects and robots push the objects together (paper, section 3.2.1).",
    controller=(0.5, 1.0, 1.0, 0.5, 0.1, 0.5), agents=4, replicas=1, objects=Objects(count=10),
    sensor=Sensor(readings=("background", "object", "robot")), trial=Trial(start_side_cm=100.0),
)  # fmt: skip
"""The paper's second case study: robots push objects together."""

AGGREGATION_VIEW_0 = replace(
    AGGREGATION, name="aggregation-field-of-view-0", title="Aggregation, field of view 0",
    description="As aggregation; the field of view of the sensor is inferred too, and is 0 (paper, section 4.6.1).",
    representation="morphology", trial=replace(AGGREGATION.trial, duration_s=100.0),
)  # fmt: skip
"""Aggregation where the field of view is inferred too, and is 0 (paper, section 4.6.1)."""

AGGREGATION_VIEW_60 = replace(
    AGGREGATION_VIEW_0, name="aggregation-field-of-view-60", title="Aggregation, field of view 60 degrees",
    description="As aggregation; the field of view of the sensor is inferred too, and is pi / 3 (paper, section 4.6.1).",
    controller=(-0.7, -1.0, 1.0, 0.0), sensor=Sensor(field_of_view=math.pi / 3),
)  # fmt: skip
"""The same with a field of view of 60 degrees. The paper does not print this controller; it was
found by experiments/4.6.1/search/search.py."""

SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (AGGREGATION, OBJECT_CLUSTERING, AGGREGATION_VIEW_0, AGGREGATION_VIEW_60)
}
"""The scenarios by their names, as commands and files of configuration use them."""
