"""Errors of what robots infer of their sensors, and the configurations of their forms."""

import numpy as np
import pytest

from turing_learning.interaction import STIMULATED
from turing_learning.reproduction._experiment import Work
from turing_learning.reproduction.experiments import EXPERIMENTS, sensors

INFRARED = STIMULATED["infrared-sensors"]


def test_errors_of_angles_are_taken_around_the_circle_and_averaged_over_the_sensors():
    models = np.array([INFRARED.true, INFRARED.true])
    # 142 degrees and -178 are 40 degrees apart.
    models[0, 4] = np.radians(-178.0)
    models[1, 8] += 0.16
    errors = sensors._errors(INFRARED, models)
    assert errors[0, 4] == pytest.approx(np.radians(40.0))
    grouped = sensors._grouped(INFRARED, errors)
    assert list(grouped) == ["angle", "displacement"]
    expected = [[np.radians(40.0) / 8, 0], [0, 0.02]]
    np.testing.assert_allclose(grouped, expected, atol=1e-12)


@pytest.mark.parametrize(("form", "inputs"), [("interactive", 8), ("own", 8), ("random", 10)])
def test_only_who_watches_under_commands_by_chance_sees_the_wheels(form, inputs, tmp_path):
    work = Work(tmp_path, EXPERIMENTS["sensors"].fast)
    configuration = sensors.configuration_of(work, INFRARED, form, 1)
    assert len(configuration.system.signals) == inputs
    assert configuration.models.start == "middle"
    assert configuration.coevolution.archive == 0
