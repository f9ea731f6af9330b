import math
import warnings

import numpy as np
import pytest

from turing_learning.models import REPRESENTATIONS, MorphologyModel, ReactiveModel


def test_a_reactive_model_is_its_genome():
    genomes = np.array([[0.1, -2.0, 3.0, 0.4]])
    model = ReactiveModel(2)
    assert model.to_units(genomes) is genomes
    behavior = model.behavior(genomes)
    assert behavior.wheel_speeds is genomes
    assert behavior.field_of_view is None
    assert behavior.weights is None
    assert model.described(genomes) is genomes
    assert model.parameter_names == ("vl0", "vr0", "vl1", "vr1")
    assert model.jumps.groups == ((0, 1), (2, 3))


@pytest.mark.parametrize(
    ("x", "theta"), [(0.0, math.pi), (math.log(3), 1.5 * math.pi), (-math.log(3), 0.5 * math.pi)]
)
def test_the_field_of_view_is_two_pi_times_the_sigmoid(x, theta):
    parameters = MorphologyModel(2).to_units(np.array([0.1, 0.2, 0.3, 0.4, x]))
    np.testing.assert_allclose(parameters, [0.1, 0.2, 0.3, 0.4, theta], rtol=1e-15)


def test_numbers_of_any_size_are_fields_of_view_without_a_warning():
    genomes = np.zeros((6, 5))
    genomes[:, 4] = [-1e12, -800, -40, 40, 800, 1e12]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        theta = MorphologyModel(2).to_units(genomes)[:, 4]
    assert (theta[:2] == 0).all()
    assert theta[2] == pytest.approx(2 * math.pi * math.exp(-40), rel=1e-12)
    assert (theta[3:] == 2 * math.pi).all()


def test_genomes_are_left_as_they_are():
    genomes = np.ones((2, 5))
    MorphologyModel(2).to_units(genomes)
    assert (genomes == 1).all()


def test_a_model_with_a_view_is_executed_with_it():
    behavior = MorphologyModel(2).behavior(
        np.array([[0.1, 0.2, 0.3, 0.4, 1.5], [0.0, 0.0, 0.0, 0.0, 6.0]])
    )
    np.testing.assert_array_equal(behavior.wheel_speeds, [[0.1, 0.2, 0.3, 0.4], [0, 0, 0, 0]])
    np.testing.assert_array_equal(behavior.field_of_view, [1.5, 6.0])


def test_the_field_of_view_is_the_last_parameter_in_rad_and_belongs_to_no_sensor_state():
    model = MorphologyModel(2)
    assert model.parameter_names == ("vl0", "vr0", "vl1", "vr1", "theta")
    assert model.parameter_units == ("", "", "", "", "rad")
    assert model.jumps.groups == ((0, 1), (2, 3))
    assert model.jumps.dependent == (4,)
    assert model.saturation == ((4, 10.0),)
    assert model.truth((1.0, 2.0, 3.0, 4.0), 0.5) == (1.0, 2.0, 3.0, 4.0, 0.5)


def test_jumps_of_the_field_of_view_reach_nearly_none_and_nearly_all():
    model = MorphologyModel(2)
    assert model.jumps.reach == (1.0, 1.0, 1.0, 1.0, 5.0)
    narrow, wide = np.degrees(
        model.to_units(np.array([[0, 0, 0, 0, -5.0], [0, 0, 0, 0, 5.0]]))[:, 4]
    )
    assert narrow < 3
    assert wide > 357


@pytest.mark.parametrize("name", REPRESENTATIONS)
def test_names_units_and_maps_of_a_representation_fit_each_other(name):
    model = REPRESENTATIONS[name](3)
    genomes = np.random.default_rng(1).normal(size=(4, len(model.parameter_names)))
    assert len(model.parameter_units) == len(model.parameter_names)
    assert model.to_units(genomes).shape == genomes.shape
    parameters = model.to_units(genomes)
    assert model.behavior(parameters).wheel_speeds.shape == (4, 6)
    np.testing.assert_array_equal(model.described(parameters), parameters)
    assert len(model.truth((0.0,) * 6, 1.0)) == len(model.parameter_names)
