import os
import socket
import time

import cv2
import numpy as np
import pytest
from arena_laboratories import SMALL
from robot_bodies import PublicClient

from turing_learning.robots import (
    ArenaService,
    Calibration,
    Capture,
    EPuck,
    LinkError,
    Model,
    Tracker,
    load_laboratory,
    open_link,
)
from turing_learning.robots.emulation import obey, usage
from turing_learning.robots.emulation._service import CameraStream, encode

FAST = 10.0


@pytest.fixture(params=["terminal", "tcp"])
def service(request):
    with ArenaService(SMALL, lines=request.param, speed=FAST) as served:
        yield served


@pytest.fixture(scope="module")
def shared():
    with ArenaService(SMALL, lines="tcp", speed=FAST) as served:
        yield served


def connect(address):
    """Return a file descriptor, with nothing of this project's own between it and the robot."""
    if address.startswith("socket://"):
        host, port = address.removeprefix("socket://").split(":")
        return socket.create_connection((host, int(port)), timeout=60).detach()
    return os.open(address, os.O_RDWR | os.O_NOCTTY)


def test_a_public_client_drives_any_robot_and_hears_a_replica(service):
    agent, replica = (
        PublicClient(connect(service.addresses[name])) for name in ("agent-1", "replica-1")
    )
    for client in (agent, replica):
        if not service.addresses["agent-1"].startswith("socket://"):
            assert [client.line()[-6:] for _ in range(2)] == ["e-Puck", "r help"]
        assert (client.ask("V"), client.line()) == ("v,Version 1.2.2 emulated", "HW version: 102")
        readings = client.ask("N").split(",")
        assert (readings[0], len(readings)) == ("n", 9)
    before = service.laboratory.poses()[0, 2]
    assert agent.ask("D,300,-300") == "d"
    assert agent.ask("E") == "e,300,-300"
    deadline = time.monotonic() + 60
    while service.laboratory.poses()[0, 2] == before:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert replica.ask("X,M,17,-7000,-10000,10000,-10000*D1F2") == "x,M,17*11FC"
    obey(service.laboratory, "remote")
    assert replica.line().startswith("x,STOP,0,-1*")
    assert replica.line().startswith("x,START,1,17*")
    for client in (agent, replica):
        os.close(client.descriptor)


def test_the_driver_sends_a_model_and_a_lost_link_comes_back(service):
    with open_link(service.addresses["replica-2"]) as link:
        robot = EPuck(link, timeout_s=10.0)
        robot.send_model(Model(4, (0.1, 0.2, 0.3, 0.4)))
        assert robot.status().waiting == 4
        obey(service.laboratory, "lose-link replica-2")
        with pytest.raises(LinkError):
            EPuck(link, timeout_s=0.1, retries=0).version()
        obey(service.laboratory, "reset-link replica-2")
        assert robot.version() == "Version 1.2.2 emulated"


def test_the_stream_is_opened_as_any_camera_and_shows_the_robots(shared):
    laboratory = shared.laboratory
    tracker = Tracker(laboratory.markers, laboratory.calibration, laboratory.labels)
    with Capture(shared.camera_url) as capture:
        images = [capture.take() for _ in range(2)]
    assert not np.array_equal(*images)
    assert sorted(tracker.detect(images[1]).labels) == sorted(laboratory.labels)


def test_what_is_not_the_camera_is_not_found(shared):
    import urllib.error
    import urllib.request

    with pytest.raises(urllib.error.HTTPError, match="404") as refused:
        urllib.request.urlopen(shared.camera_url.replace(".mjpg", ".avi"), timeout=60)
    refused.value.close()


def test_half_a_request_does_not_hold_a_thread_for_ever(monkeypatch):
    monkeypatch.setattr("turing_learning.robots.emulation._service._Handler.timeout", 0.2)
    stream = CameraStream(lambda last: (last, None))
    host, port = stream.url.removeprefix("http://").partition("/")[0].split(":")
    with socket.create_connection((host, int(port)), timeout=60) as line:
        line.sendall(b"GET /camera")
        assert line.recv(100) == b""  # hung up
    stream.close()


def test_markers_survive_the_compression(shared):
    laboratory = shared.laboratory
    tracker = Tracker(laboratory.markers, laboratory.calibration, laboratory.labels)
    with laboratory.lock:
        image, poses = laboratory.camera.snapshot(), laboratory.poses()
    seen = tracker.detect(cv2.imdecode(np.frombuffer(encode(image), np.uint8), cv2.IMREAD_COLOR))
    assert len(seen.positions) == 5
    for position, heading in zip(seen.positions, seen.headings, strict=True):
        nearest = np.argmin(np.linalg.norm(poses[:, :2] - position, axis=1))
        assert np.linalg.norm(poses[nearest, :2] - position) < 0.2
        assert abs(np.angle(np.exp(1j * (heading - poses[nearest, 2])))) < 0.1


def test_time_passes_at_the_given_speed(shared):
    before, began = shared.laboratory.clock.now(), time.monotonic()
    passed = elapsed = 0.0
    while elapsed < 0.3 or passed != pytest.approx(FAST * elapsed, rel=0.5):
        assert elapsed < 60.0, f"{passed} s in {elapsed} s"
        time.sleep(0.1)
        with shared.laboratory.lock:
            passed, elapsed = shared.laboratory.clock.now() - before, time.monotonic() - began


def test_its_file_describes_a_laboratory_that_loads(shared, tmp_path):
    path = shared.write(tmp_path / "lab")
    laboratory = load_laboratory(path)
    assert [robot.name for robot in laboratory.setup.agents] == ["agent-1", "agent-2", "agent-3"]
    assert [robot.address for robot in laboratory.setup.replicas] == [
        shared.addresses["replica-1"],
        shared.addresses["replica-2"],
    ]
    assert laboratory.setup.labels == shared.laboratory.labels
    assert laboratory.setup.camera.source == shared.camera_url
    assert laboratory.setup.timing.loop_s == pytest.approx(18 / FAST)
    scenario = laboratory.configuration.scenario
    assert scenario.control_steps == 50
    assert scenario.robot.maximum_speed_cm_s == pytest.approx(12.8 * FAST)
    assert (scenario.arena.width_cm, scenario.arena.height_cm) == (90.0, 100.0)
    loaded = Calibration.load(laboratory.setup.camera.calibration)
    np.testing.assert_allclose(loaded.position_cm, shared.laboratory.calibration.position_cm)


def test_a_folder_with_a_laboratory_is_left_alone(shared, tmp_path):
    path = shared.write(tmp_path)
    path.write_text("mine")
    with pytest.raises(FileExistsError, match=r"`out` must be a new file; got .*lab\.toml"):
        shared.write(tmp_path)
    assert path.read_text() == "mine"
    shared.write(tmp_path, force=True)
    assert path.read_text() != "mine"


def test_a_laboratory_is_replaced_whole_or_not_at_all(shared, tmp_path, monkeypatch):
    path = shared.write(tmp_path)
    before = {each.name: each.read_text() for each in tmp_path.iterdir()}

    def full(self, *arguments, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(type(path), "write_text", full)
    with pytest.raises(OSError, match="No space left"):
        shared.write(tmp_path, force=True)
    assert {each.name: each.read_text() for each in tmp_path.iterdir()} == before


def test_lines_and_speeds_that_do_not_exist_are_refused():
    with pytest.raises(ValueError, match="`lines` must be one of terminal, tcp; got 'bluetooth'"):
        ArenaService(SMALL, lines="bluetooth")
    with pytest.raises(ValueError, match="`speed` must be a finite number above 0; got 0"):
        ArenaService(SMALL, speed=0)


def test_every_fault_and_every_hand_has_a_command_with_a_meaning(shared):
    told = dict(usage(shared.laboratory))
    assert told["remote"] == "Let all robots begin their loops."
    assert {
        "carry NAME X_CM Y_CM HEADING",
        "cover NAME",
        "freeze-camera",
        "repair",
        "replace-battery NAME",
    } <= told.keys()
    assert all(meaning.endswith(".") for meaning in told.values())


def test_spoken_commands_are_obeyed_with_their_numbers(shared):
    obey(shared.laboratory, "stick agent-2")
    obey(shared.laboratory, "carry agent-2 60 70")
    np.testing.assert_allclose(shared.laboratory.poses()[1], (60, 70, 0.0), atol=1e-9)
    assert shared.laboratory.stuck == {1}
    obey(shared.laboratory, "repair")
    assert shared.laboratory.stuck == set()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("dance", "`command` must be one of .*remote.*; got 'dance'"),
        ("cover", "`cover` must be followed by NAME; got 'cover'"),
        ("remote now", "`remote` must be followed by nothing; got 'remote now'"),
        ("carry agent-1 a b", "`x_cm` must be a number; got 'a'"),
        ("cover agent-77", "`name` must be one of agent-1, .*; got 'agent-77'"),
    ],
)
def test_spoken_commands_that_make_no_sense_are_refused(shared, text, message):
    with pytest.raises(ValueError, match=message):
        obey(shared.laboratory, text)
