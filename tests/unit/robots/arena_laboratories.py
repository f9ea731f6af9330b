"""Small emulated laboratories."""

from dataclasses import replace

from turing_learning import swarm
from turing_learning.robots import (
    LABORATORY,
    Conditions,
    EmulatedLaboratory,
    EPuck,
    overhead_camera,
)

SMALL = replace(LABORATORY, agents=3, arena=swarm.Arena(90.0, 100.0))
VIEW = overhead_camera(90.0, 100.0, above_cm=125.0, image_size=(640, 480))


def small_laboratory(*, seed=0, scenario=SMALL, **conditions):
    return EmulatedLaboratory(
        scenario, conditions=Conditions(**conditions), seed=seed, calibration=VIEW
    )


def replicas(laboratory):
    return [EPuck(laboratory.link(name)) for name in ("replica-1", "replica-2")]
