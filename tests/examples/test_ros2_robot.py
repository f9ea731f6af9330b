"""The example for ROS 2, with rclpy itself: robots in processes of their own, poses from topics. Skipped without rclpy.

    pip install ros-rclpy ros-rmw-fastrtps-cpp ros-geometry-msgs ros-sensor-msgs ros-std-msgs

Messages of tf2 and mocap4ros2 are no packages there: they are doubles, with the fields that their definitions have. Takes 80 s.
"""

import math
import os
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from turing_learning.runs import read_events, read_trials

pytest.importorskip("rclpy")

EXAMPLE = Path(__file__).parents[2] / "examples" / "ros2_robot.py"
NAMES = ("robot_1", "robot_2", "robot_3", "robot_4")
WORLD = """
import math, sys, time, rclpy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Range
from std_msgs.msg import Bool
rclpy.init()
node = rclpy.create_node("world")
class Robot:
    def __init__(self, name, x, y):
        self.x, self.y, self.heading, self.twist = x, y, 0.3, Twist()
        self.poses = node.create_publisher(PoseStamped, f"/{name}/pose", 10)
        self.sight = node.create_publisher(Bool, f"/{name}/sight", 1)
        self.front = node.create_publisher(Range, f"/{name}/proximity0", 1)
        node.create_subscription(Twist, f"/{name}/cmd_vel", lambda twist: setattr(self, "twist", twist), 1)
    def go(self, step):
        self.heading += step * self.twist.angular.z
        self.x += step * self.twist.linear.x * math.cos(self.heading)
        self.y += step * self.twist.linear.x * math.sin(self.heading)
        pose = PoseStamped()
        pose.header.stamp = node.get_clock().now().to_msg()
        pose.pose.position.x, pose.pose.position.y = self.x, self.y
        pose.pose.orientation.z, pose.pose.orientation.w = math.sin(self.heading / 2), math.cos(self.heading / 2)
        self.poses.publish(pose)
        self.sight.publish(Bool(data=False))
        self.front.publish(Range(range=1.0, max_range=0.5))
robots = [Robot(name, 2.5 + k, 2.5 + k) for k, name in enumerate(sys.argv[1:])]
before = time.monotonic()
while rclpy.ok():
    rclpy.spin_once(node, timeout_sec=0.005)
    now = time.monotonic()
    if now - before >= 0.02:
        for robot in robots: robot.go(now - before)
        before = now
"""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.fixture
def laboratory(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(EXAMPLE.parent), prepend=os.pathsep)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(os.getpid() % 100))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    ports = [free_port() for _ in NAMES]
    commands = [[sys.executable, "-c", WORLD, *NAMES]]
    text = 'tracker = "ros2_robot:PoseTopics"\n[camera]\nfps = 10.0\n[evaluation]\nrepeats = 0\n[models]\npopulation = 4\n'
    text += "[classifiers]\npopulation = 8\n[run]\ngenerations = 1\nthreads = 1\n"
    text += "[scenario.arena]\nwidth_cm = 1000.0\nheight_cm = 1000.0\n"
    for number, (name, port) in enumerate(zip(NAMES, ports, strict=True)):
        agent = number < 2
        controller = ("-0.7", "-1.0", "1.0", "-1.0") if agent else ()
        commands.append([sys.executable, str(EXAMPLE), name, "127.0.0.1", str(port), *controller])
        text += f'[[robots]]\nname = "{name}"\nrole = "{"agent" if agent else "replica"}"\nmarker = "{name}"\n'
        text += f'address = "socket://127.0.0.1:{port}"\n'
    (tmp_path / "lab.toml").write_text(text)
    with (tmp_path / "said.txt").open("w") as said, ExitStack() as running:
        for command in commands:
            process = running.enter_context(subprocess.Popen(command, stdout=said, stderr=said))
            running.callback(process.terminate)
        for port in ports:
            deadline = time.monotonic() + 120
            while True:
                try:
                    socket.create_connection(("127.0.0.1", port)).close()
                    break
                except OSError:
                    assert time.monotonic() < deadline, (tmp_path / "said.txt").read_text()
                    time.sleep(0.5)
        time.sleep(3.0)
        yield tmp_path / "lab.toml"


def test_robots_of_ros_2_are_started_observed_and_halted_like_epucks(laboratory):
    out = laboratory.parent / "run"
    for command in (["check"], ["run", "--out", str(out)]):
        asked = [
            sys.executable,
            "-m",
            "turing_learning",
            "robots",
            *command,
            "--config",
            str(laboratory),
            "--trust",
        ]
        done = subprocess.run(
            asked,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=240,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
    assert not [event for event in read_events(out) if event["asked"]]
    trials = read_trials(out, "generation-0000")
    speeds = trials.speeds()  # (trials, robots, 50, 2)
    assert speeds.shape == (2, 4, 50, 2)
    np.testing.assert_allclose(
        np.median(speeds[:, :2], axis=(0, 1, 2)), (-0.85 * 12.8, -0.3 * 12.8 / 5.1), atol=0.3
    )
    expected = 12.8 * trials.models[..., :2].mean(axis=-1)
    np.testing.assert_allclose(np.median(speeds[:, 2:, :, 0], axis=2), expected, atol=0.5)


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLE.parent))
    import ros2_robot

    return ros2_robot


@pytest.mark.parametrize("heading", [-3.0, -0.4, 0.0, 1.0, 2.5])
def test_axes_and_units_are_those_that_the_file_declares(example, heading, monkeypatch):
    half = heading / 2
    turn = SimpleNamespace(x=0.0, y=0.0, z=math.sin(half), w=math.cos(half))
    flat = SimpleNamespace(x=1.5, y=0.25, z=0.1)
    assert example.pose_of(flat, turn) == pytest.approx((150.0, 25.0, heading))
    monkeypatch.setattr(example, "AXES", ("z", "x", "y"))
    monkeypatch.setattr(example, "CM", 0.1)  # of millimetres
    turn = SimpleNamespace(x=0.0, y=math.sin(half), z=0.0, w=math.cos(half))
    upright = SimpleNamespace(x=250.0, y=100.0, z=1500.0)
    assert example.pose_of(upright, turn) == pytest.approx((150.0, 25.0, heading))


def test_rigid_bodies_and_transforms_become_poses(example):
    stamp = SimpleNamespace(sec=5, nanosec=250_000_000)
    place, turn = SimpleNamespace(x=1.0, y=2.0, z=0.0), SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0)
    header = SimpleNamespace(stamp=stamp)
    body = SimpleNamespace(
        rigid_body_name="a", pose=SimpleNamespace(position=place, orientation=turn)
    )
    frame = SimpleNamespace(
        header=header,
        child_frame_id="a",
        transform=SimpleNamespace(translation=place, rotation=turn),
    )
    for kind, take, message in (
        (example.RigidBodies, "take_bodies", SimpleNamespace(header=header, rigidbodies=[body])),
        (example.Transforms, "take_transforms", SimpleNamespace(transforms=[frame])),
    ):
        poses = object.__new__(kind)
        poses._seen = {"a": []}
        getattr(poses, take)(message)
        assert poses._seen["a"][0][2:] == pytest.approx((100.0, 200.0, 0.0))
        assert poses._seen["a"][0][0] == 5.25


def test_poses_without_stamps_are_taken_when_they_come_and_lost_ones_are_left_out(example):
    takes = []
    stamp = SimpleNamespace(sec=7, nanosec=0)
    clock = SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: stamp))
    ros = SimpleNamespace(
        node=SimpleNamespace(get_clock=lambda: clock),
        subscribe=lambda message, topic, take: takes.append((topic, take)),
    )
    poses = object.__new__(example.PlainPoses)
    poses._seen = {"a": [], "b": []}
    poses.subscribe(ros)
    assert [topic for topic, _ in takes] == ["/a/pose", "/b/pose"]
    turn = SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0)
    for x in (1.0, math.nan):
        takes[1][1](SimpleNamespace(position=SimpleNamespace(x=x, y=2.0, z=0.0), orientation=turn))
    assert not poses._seen["a"]
    ((stamp_s, _, *pose),) = poses._seen["b"]
    assert (stamp_s, *pose) == pytest.approx((7.0, 100.0, 200.0, 0.0))


def test_sensors_that_are_silent_cannot_be_read(example, monkeypatch):
    takes = {}
    ros = SimpleNamespace(
        node=SimpleNamespace(create_publisher=lambda *_: None),
        subscribe=lambda message, topic, take: takes.update({topic: take}),
    )
    body = example.RosBody("robot_3", ros)
    for read in (body.sight, body.proximity):
        with pytest.raises(OSError, match="says"):
            read()
    takes["/robot_3/sight"](SimpleNamespace(data=True))
    takes["/robot_3/proximity7"](SimpleNamespace(range=0.1, max_range=0.5))
    assert body.sight() == 1
    assert body.proximity()[0] == example.DARK
    monkeypatch.setattr(example, "SILENCE_S", -1.0)
    with pytest.raises(OSError, match="says nothing"):
        body.sight()
