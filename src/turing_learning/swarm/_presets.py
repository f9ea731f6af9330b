"""The paper's case studies as scenarios."""

import math
from dataclasses import replace

from ._scenario import Objects, Scenario, Sensor, Trial

AGGREGATION = Scenario(
    name="aggregation",
    title="Aggregation",
    description="Robots that see other robots gather in one place (paper, section 3.2.1).",
    controller=(-0.7, -1.0, 1.0, -1.0),
    agents=10,
    replicas=1,
    trial=Trial(start_side_cm=331.66),
)
"""The paper's first case study: robots gather."""

OBJECT_CLUSTERING = Scenario(
    name="object-clustering",
    title="Object clustering",
    description="Robots that see objects and robots push the objects together (paper, section 3.2.1).",
    controller=(0.5, 1.0, 1.0, 0.5, 0.1, 0.5),
    agents=4,
    replicas=1,
    objects=Objects(count=10),
    sensor=Sensor(readings=("background", "object", "robot")),
    trial=Trial(start_side_cm=100.0),
)
"""The paper's second case study: robots push objects together."""

AGGREGATION_VIEW_0 = replace(
    AGGREGATION,
    name="aggregation-field-of-view-0",
    title="Aggregation, field of view 0",
    description="As aggregation; the field of view of the sensor is inferred too, and is 0 (paper, section 4.6.1).",
    representation="morphology",
    trial=replace(AGGREGATION.trial, duration_s=100.0),
)
"""Aggregation where the field of view is inferred too, and is 0 (paper, section 4.6.1)."""

AGGREGATION_VIEW_60 = replace(
    AGGREGATION_VIEW_0,
    name="aggregation-field-of-view-60",
    title="Aggregation, field of view 60 degrees",
    description="As aggregation; the field of view of the sensor is inferred too, and is pi / 3 (paper, section 4.6.1).",
    controller=(-0.7, -1.0, 1.0, 0.0),
    sensor=Sensor(field_of_view=math.pi / 3),
)
"""The same with a field of view of 60 degrees. The paper does not print this controller; it was found by
`turing_learning.search.search_controller`, see experiments/4.6.1."""

SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario for scenario in (AGGREGATION, OBJECT_CLUSTERING, AGGREGATION_VIEW_0, AGGREGATION_VIEW_60)
}
"""The scenarios by their names, as commands and files of configuration use them."""
