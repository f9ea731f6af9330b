import numpy as np
import pytest
from robot_scenes import LABELS, moving

from turing_learning.robots import EmulatedCamera, Tracker, TriangleMarkers, overhead_camera


@pytest.fixture(scope="session")
def true_camera():
    return overhead_camera()


@pytest.fixture(scope="session")
def camera(true_camera):
    return EmulatedCamera(true_camera, TriangleMarkers(), LABELS)


@pytest.fixture(scope="session")
def shared_tracker(true_camera):
    return Tracker(TriangleMarkers(), true_camera, LABELS)


@pytest.fixture
def tracker(shared_tracker):
    shared_tracker.start()
    return shared_tracker


@pytest.fixture(scope="session")
def poses():
    """Ten robots (T + 1, A, 3), apart by 7.4 cm or more at the start, numbered by x within a label."""
    return moving(np.random.default_rng(3), 12)
