"""The paper's case studies as scenarios."""

from ._scenario import Objects, Scenario, Sensor, Trial

AGGREGATION = Scenario(
    name="aggregation",
    title="Aggregation",
    description="11 robots that see other robots gather in one place (paper, section 3.2.1).",
    controller=(-0.7, -1.0, 1.0, -1.0),
    agents=10,
    replicas=1,
    trial=Trial(start_side_cm=331.66),
)

OBJECT_CLUSTERING = Scenario(
    name="object-clustering",
    title="Object clustering",
    description="5 robots that see objects and robots push 10 objects together (paper, section 3.2.1).",
    controller=(0.5, 1.0, 1.0, 0.5, 0.1, 0.5),
    agents=4,
    replicas=1,
    objects=Objects(count=10),
    sensor=Sensor(readings=("background", "object", "robot")),
    trial=Trial(start_side_cm=100.0),
)

SCENARIOS: dict[str, Scenario] = {scenario.name: scenario for scenario in (AGGREGATION, OBJECT_CLUSTERING)}
