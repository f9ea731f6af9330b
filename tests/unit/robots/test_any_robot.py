"""Robots that are no e-pucks before no camera: the page's robot, which speaks JSON, and poses that come as datagrams."""

import json
import socket
import sys
import threading
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.robots import (
    ArucoMarkers,
    EmulatedLaboratory,
    Fault,
    Track,
    as_emulated,
    inspect,
    load_laboratory,
    real_equipment,
    rehearse,
)
from turing_learning.robots._link import PARAMETER_UNIT, opened, sealed
from turing_learning.robots.emulation._lines import Line
from turing_learning.robots.tracking._tracker import impossible
from turing_learning.runs import (
    read_events,
    read_post_evaluation,
    read_trials,
    resume_laboratory,
    start_laboratory,
)
from turing_learning.swarm import Arena, Robot

SPEED = 6.0
EXAMPLES = Path(__file__).parents[3] / "examples"


class JsonLine(Line):
    """The robot's end of the page's protocol."""

    def __init__(self, robot):
        super().__init__(robot)
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = f"127.0.0.1:{self._listening.getsockname()[1]}"
        self._client = None
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self):
        while True:
            try:
                self._client, _ = self._listening.accept()
            except OSError:  # closed
                return
            with suppress(OSError), self._client, self._client.makefile() as lines:
                for line in lines:
                    self._say(self._answer(json.loads(line)))
            self._client = None

    def stay(self):
        """Let the robot know that its PC is there, as long as it is connected."""
        if self._client is not None:
            self._tell(sealed("X,A"))

    def _answer(self, message):
        did, told = message["do"], {}
        if did == "model":
            numbers = (round(value / PARAMETER_UNIT) for value in message["parameters"])
            self._tell(sealed(f"X,M,{message['sequence']},{','.join(map(str, numbers))}"))
        elif did == "status":
            _, _, state, ms, waiting, executing, battery = opened(self._tell(sealed("X,Q"))).split(
                ","
            )
            told = {
                "state": state,
                "in_state_s": int(ms) / 1000,
                "waiting": int(waiting),
                "executing": int(executing),
            }
            told["battery_ok"] = battery == "1"
        elif did in ("start", "halt"):
            self._tell(sealed("X,G" if did == "start" else "X,H"))
        return {"did": did, "text": "JSON robot 1", **told}

    def _tell(self, text):
        return self.robot.receive(text.encode() + b"\r").decode().strip()

    def signal(self, kind):
        _, kind, trial, sequence = opened(self.robot.signal(kind).decode().strip()).split(",")
        self._say({"signal": kind, "trial": int(trial), "sequence": int(sequence)})

    def _say(self, message):
        with suppress(OSError):
            if self._client is not None:
                self._client.sendall(json.dumps(message).encode() + b"\n")

    def link(self):
        raise NotImplementedError

    drop = restore = link

    def _send(self, data):
        raise NotImplementedError

    def close(self):
        self._listening.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._listening.close()


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.fixture
def laboratory(tmp_path, monkeypatch):
    """Serve four robots and their poses, and write the laboratory's file and module; return the robots and the file."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    monkeypatch.syspath_prepend(str(tmp_path))
    from dataclasses import replace

    from turing_learning.robots import LABORATORY

    port, done = free_port(), threading.Event()
    (tmp_path / "my_laboratory.py").write_text(
        f"from any_robot import JsonRobot, UdpPoses\ndef open_poses(setup):\n    return UdpPoses(setup, {port})\n"
    )
    served = EmulatedLaboratory(
        replace(LABORATORY, agents=2), seed=3, make_line=lambda robot, _: JsonLine(robot)
    )
    served.clock.sleep(0.1)  # compiles, before anybody waits for poses

    def go():
        ahead = -SPEED * time.monotonic()
        while not done.is_set():
            with served.lock:
                served.clock.sleep_until(served.clock.now() + 0.05)
                poses = dict(zip(served.names, served.poses().tolist(), strict=True))
                now = served.clock.now()
                for name in served.names:
                    served.robot(name).line.stay()
            sender.sendto(
                json.dumps({"time": now / SPEED, "poses": poses}).encode(), ("127.0.0.1", port)
            )
            time.sleep(max(0.0, (now - ahead) / SPEED - time.monotonic()))

    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    thread = threading.Thread(target=go, daemon=True)
    thread.start()
    timing = {"wait_s": 1 / SPEED, "disperse_s": 8 / SPEED, "execute_s": 7 / SPEED}
    text = 'open_replica = "my_laboratory:JsonRobot"\ntracker = "my_laboratory:open_poses"\n'
    text += f"[camera]\nfps = {10 * SPEED}\n[interventions]\nbatteries_every = 0\n[evaluation]\nrepeats = 1\n"
    text += (
        "[timing]\n"
        + "".join(f"{name} = {value}\n" for name, value in timing.items())
        + "tolerance_s = 1.0\n"
    )
    for name in served.names:
        role = name.partition("-")[0]
        text += f'[[robots]]\nname = "{name}"\nrole = "{role}"\nmarker = "{name}"\naddress = "{served.robot(name).line.port}"\n'
    text += f"[scenario.robot]\nmaximum_speed_cm_s = {12.8 * SPEED}\n[scenario.trial]\nduration_s = {1 / SPEED}\n"
    text += "[models]\npopulation = 2\n[classifiers]\npopulation = 8\n[run]\ngenerations = 2\nthreads = 1\n"
    (tmp_path / "lab.toml").write_text(text)
    yield served, tmp_path / "lab.toml"
    done.set()
    thread.join()
    sender.close()
    served.close()
    for name in ("my_laboratory", "any_robot"):
        sys.modules.pop(name, None)


def test_robots_that_speak_json_are_started_observed_halted_and_resumed_like_epucks(
    laboratory, tmp_path
):
    served, file = laboratory
    loaded, out = load_laboratory(file), tmp_path / "run"
    found = {
        each.what: each
        for each in inspect(loaded.setup, loaded.configuration.swarm, real_equipment(loaded))
    }
    assert list(found) == [
        "agent agent-1",
        "agent agent-2",
        "replica replica-1",
        "replica replica-2",
        "tracker",
    ]
    assert all(each.fine for each in found.values()), found
    assert found["agent agent-1"].text == "JSON robot 1; battery good; state R0"
    result = start_laboratory(loaded, out, should_stop=lambda: True)
    assert result.generations == 1
    assert {served.robot(name).emulated.state for name in served.names} == {"R0"}
    assert resume_laboratory(out).complete  # by the names in the folder
    assert read_post_evaluation(out).complete
    assert not [event for event in read_events(out) if event["asked"]]
    trials = read_trials(out, "generation-0001")
    assert trials.poses.shape == (1, 11, 4, 3)
    assert np.ptp(trials.poses[:, :, :2, 2], axis=1).min() > 0.2  # agents turn


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            lambda poses, present: poses.__setitem__((slice(6, None), 1, 0), 7.0),
            "individual 1 (b) cannot have moved 7.0 cm and turned 0 degrees like this",
        ),
        (
            lambda poses, present: poses.__setitem__((slice(6, None), 0, 2), 3.1),
            "individual 0 (a) cannot have moved 0.0 cm and turned 178 degrees like this",
        ),
        (
            lambda poses, present: present.__setitem__((3, 1), False),
            "individual 1 (b) is out of sight",
        ),
    ],
)
def test_what_no_robot_can_do_is_noticed_in_the_poses_of_any_tracker(change, text):
    poses, present = np.zeros((11, 2, 3)), np.ones((11, 2), bool)
    robot = Robot()
    assert impossible(Track(poses, present, ("a", "b"), 0.1), robot) == ()
    change(poses, present)
    (fault,) = impossible(Track(poses, present, ("a", "b"), 0.1), robot)
    assert isinstance(fault, Fault)
    assert text in fault.text
    assert (
        impossible(
            Track(poses, np.ones((11, 2), bool), ("a", "b"), 0.1), Robot(maximum_speed_cm_s=100.0)
        )
        == ()
    )  # a faster robot


def track_of(step, heading=0.0, neighbor=100.0, noise=0.0):
    """Return the track of a robot on the floor's middle that moves by a step (2,) in the sixth image, and of one at its left."""
    poses = (
        np.zeros((11, 2, 3))
        + [50.0, 50.0, heading]
        + noise * np.random.default_rng(1).normal(size=(11, 2, 3))
    )
    poses[6:, 0, :2] += step
    poses[:, 1, 1] += neighbor
    return Track(poses, np.ones((11, 2), bool), ("a", "b"), 0.1)


@pytest.mark.parametrize(
    ("step", "options", "noticed"),
    [
        ((0.0, 0.3), {}, False),  # as errors of poses, and turns between two images, let it seem
        ((0.0, 0.6), {}, True),  # nobody drives sideways
        ((0.6, 0.0), {}, False),
        ((0.6, 0.0), {"heading": np.pi / 2}, True),
        ((-1.9, 0.0), {}, False),  # backward, and the image is late
        ((-2.2, 0.0), {}, True),
        ((0.0, 0.6), {"neighbor": 7.5}, False),  # pushed
        ((0.0, -1.2), {"neighbor": 7.5}, True),
        ((0.0, 0.6), {"noise": 0.05}, False),  # a tracker with large errors
        ((0.0, 2.0), {"noise": 0.05}, True),
    ],
)
def test_a_robot_moves_along_its_heading_unless_another_pushes_it(step, options, noticed):
    found = impossible(track_of(step, **options), Robot(), Arena(200.0, 225.0))
    assert [fault.kind for fault in found] == ["carried away"] * noticed
    assert all(fault.text.startswith("individual 0 (a)") and fault.frame == 6 for fault in found)
    assert impossible(track_of((0.0, 0.6)), Robot(), Arena(53.0, 225.0)) == ()  # a wall is as good
    along = track_of((0.0, 0.6))
    assert (
        impossible(replace(along, has_headings=False), Robot(), Arena()) == ()
    )  # where headings are not known


@pytest.mark.parametrize(
    ("markers", "labels"),
    [
        ('markers = "aruco"\nmarker_cm = 5.0', ("3", "17", "49", "5")),
        ('markers = "aruco"\ndictionary = "5X5_250"\nmarker_cm = 5.0', ("3", "17", "249", "5")),
        (
            'markers = "aruco"\ndictionary = "APRILTAG_16h5"\nmarker_cm = 5.0',
            ("3", "17", "29", "5"),
        ),
        ('markers = "triangles"\nmarker_cm = 4.2', ("green", "green", "red", "blue")),
    ],
)
def test_a_rehearsal_wears_the_markers_of_the_file(markers, labels, tmp_path):
    robots = [
        ("agent", "a1", ""),
        ("agent", "a2", ""),
        ("replica", "r1", 'address = "x"'),
        ("replica", "r2", 'address = "y"'),
    ]
    text = f'[camera]\ncalibration = "camera.json"\n{markers}\n[scenario.arena]\nwidth_cm = 80.0\nheight_cm = 90.0\n'
    for (role, name, address), label in zip(robots, labels, strict=True):
        text += f'[[robots]]\nname = "{name}"\nrole = "{role}"\nmarker = "{label}"\n{address}\n'
    (tmp_path / "lab.toml").write_text(text)
    with as_emulated(load_laboratory(tmp_path / "lab.toml")) as laboratory:
        track = rehearse(laboratory).open_tracker().track(0.0, 3)
    assert track.labels == labels
    assert track.complete
    assert track.faults == ()


def test_a_rehearsal_of_robots_that_no_camera_tracks_has_markers_of_its_own(tmp_path):
    text = 'tracker = "any_robot:UdpPoses"\n[scenario.arena]\nwidth_cm = 80.0\nheight_cm = 90.0\n'
    for role, name in (("agent", "a1"), ("agent", "a2"), ("replica", "r1")):
        text += (
            f'[[robots]]\nname = "{name}"\nrole = "{role}"\nmarker = "{name}"\naddress = "{name}"\n'
        )
    (tmp_path / "lab.toml").write_text(text)
    with as_emulated(load_laboratory(tmp_path / "lab.toml")) as laboratory:
        track = rehearse(laboratory).open_tracker().track(0.0, 3)
    assert track.labels == ("0", "1", "2")
    assert track.complete


def test_a_dictionary_that_does_not_exist_is_named():
    with pytest.raises(
        ValueError,
        match=r"`camera\.dictionary` must be a known dictionary; got '4X4_5'.*Did you mean",
    ):
        ArucoMarkers(dictionary="4X4_5").check_label("1")


def test_parts_have_names_in_an_installed_package_or_none_at_all(laboratory, tmp_path, monkeypatch):
    from any_robot import JsonRobot

    _, file = laboratory
    package, out = tmp_path / "my_parts-1.0.dist-info", tmp_path / "run"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: my-parts\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text(
        "[turing_learning.robots]\njson-robot = my_laboratory:JsonRobot\nudp-poses = my_laboratory:open_poses\n"
    )
    text = file.read_text().replace("my_laboratory:JsonRobot", "json-robot")
    file.write_text(text.replace("my_laboratory:open_poses", "udp-poses"))
    loaded = load_laboratory(file)
    assert real_equipment(loaded).open_replica is JsonRobot
    nameless = {"open_replica": lambda address: JsonRobot(address)}
    assert start_laboratory(loaded, out, **nameless, should_stop=lambda: True).generations == 1
    assert json.loads((out / "laboratory.json").read_text())["tracker"] == "udp-poses"
    monkeypatch.setattr("turing_learning.config.parts._objects", {})  # as in another process
    with pytest.raises(ConfigurationError, match="`open_replica` must be given again"):
        resume_laboratory(out)
    assert resume_laboratory(out, **nameless, should_stop=lambda: True).generations == 2
    assert not [event for event in read_events(out) if event["asked"]]
    (package / "entry_points.txt").write_text("")
    with pytest.raises(ConfigurationError, match=r"`open_replica` must .*json-robot"):
        real_equipment(loaded)


class Peer:
    """A robot that answers whatever is asked with bytes of a test's choice, again and again."""

    def __init__(self, data, times=10**9):
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listening.getsockname()[1]}"
        self._data, self._times = data, times
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        client, _ = self._listening.accept()
        with suppress(OSError), client:
            client.recv(100)
            for _ in range(self._times):
                client.sendall(self._data)
            time.sleep(60)

    def close(self):
        self._listening.close()


@pytest.mark.parametrize(
    ("data", "times", "error"),
    [
        (b"x" * 1000, 10**9, "a line of more than"),  # an endless line
        (b'{"did": "other"}\n', 10**9, "never stops sending|timed out"),  # a flood, fast or slow
        (b"not JSON\n", 1, "makes no sense"),
        (b'{"signal": "STOP"}\n', 1, "makes no sense"),
        (b"[" * 5000 + b"\n", 1, "makes no sense"),
        (b"[]\n", 1, "makes no sense"),
        (b'{"signal": "STOP", "trial": 1e999, "sequence": 1}\n', 1, "makes no sense"),
        (
            b'{"did": "status", "state": "R1", "in_state_s": 1'
            + b"0" * 400
            + b', "waiting": 1, "executing": 1, "battery_ok": 1}\n',
            1,
            "status makes no sense",
        ),
        (b'{"did": "status", "state": 1}\n', 1, "status makes no sense"),
        (b"", 1, "timed out"),
    ],
)
def test_a_robot_that_sends_nonsense_is_a_lost_link_within_its_time(
    data, times, error, monkeypatch
):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import any_robot

    monkeypatch.setattr(any_robot, "ANSWER_S", 0.5)
    peer, began = Peer(data, times), time.monotonic()
    robot = any_robot.JsonRobot(peer.address)
    with pytest.raises(OSError, match=error):
        robot.status()
    with suppress(OSError):
        robot.drop_signals()
    assert time.monotonic() - began < 5.0
    robot.close()
    peer.close()


def test_a_flood_of_signals_does_not_fill_the_memory(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import any_robot

    monkeypatch.setattr(any_robot, "ANSWER_S", 0.5)
    peer = Peer(b'{"signal": "START", "trial": 1, "sequence": 1}\n' * 200, 10**9)
    robot = any_robot.JsonRobot(peer.address)
    with pytest.raises(TimeoutError):
        robot.status()
    assert len(robot._signals) == any_robot.MOST_SIGNALS
    robot.close()
    peer.close()


def test_datagrams_that_make_no_sense_are_left_out_and_silence_is_a_lost_tracker(
    laboratory, monkeypatch
):
    _, file = laboratory
    import any_robot

    port = free_port()
    setup = load_laboratory(file).setup
    poses = any_robot.UdpPoses(setup, port)
    assert poses._socket.getsockname() == ("127.0.0.1", port)  # not every network
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    done = threading.Event()

    def send():
        nonsense = [b"\xff", b"[]", b'{"time": "x", "poses": {}}', b'{"time": NaN, "poses": {}}', b'{"time": 1, "poses": 3}',
                    b'{"time": 1e999, "poses": {}}', b"[" * 9000]  # fmt: skip
        begun = time.monotonic()
        while not done.wait(0.004):
            now_s = time.monotonic() - begun
            seen = {
                "agent-1": [1.0, 2.0, 0.5],
                "agent-2": [1.0, 2.0],
                "replica-1": [1.0, float("inf"), 0.0],
            }
            for data in [*nonsense, json.dumps({"time": now_s, "poses": seen}).encode()]:
                sender.sendto(data, ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    track = poses.track(time.monotonic() + 0.05, 8)
    done.set()
    thread.join()
    assert track.present.tolist() == [[True, False, False, False]] * 8
    monkeypatch.setattr(any_robot, "SILENCE_S", 0.2)
    for _ in range(1000):  # what waits in the socket is taken first
        try:
            poses.track(time.monotonic(), 8)
        except TimeoutError as error:
            assert "no poses come" in str(error)  # noqa: PT017 - how many are taken before is not known
            break
    else:
        pytest.fail("poses without end")
    poses.close()
    sender.close()
