"""The example for ROS 1, through a real ROS master: robots in processes of their own, poses from topics. Skipped without ROS.

On Debian 12: apt install python3-rospy python3-roslaunch python3-rosmaster python3-geometry-msgs python3-sensor-msgs, and Python
3.11 with /usr/lib/python3/dist-packages at the end of PYTHONPATH. Takes 80 s, in real time.
"""

import os
import shutil
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from turing_learning.runs import read_events, read_trials

EXAMPLE = Path(__file__).parents[2] / "examples" / "ros_robot.py"
NAMES = ("robot_1", "robot_2", "robot_3", "robot_4")
WORLD = """
import math, sys, time, rospy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Range
from std_msgs.msg import Bool
rospy.init_node("world")
robots = {}
class Robot:
    def __init__(self, name, x, y):
        self.x, self.y, self.heading, self.twist = x, y, 0.3, Twist()
        self.poses = rospy.Publisher(f"/{name}/pose", PoseStamped, queue_size=10)
        self.sight = rospy.Publisher(f"/{name}/sight", Bool, queue_size=1)
        self.front = rospy.Publisher(f"/{name}/proximity0", Range, queue_size=1)
        rospy.Subscriber(f"/{name}/cmd_vel", Twist, lambda twist: setattr(self, "twist", twist))
    def go(self, step):
        self.x += step * self.twist.linear.x * math.cos(self.heading)
        self.y += step * self.twist.linear.x * math.sin(self.heading)
        self.heading += step * self.twist.angular.z
        pose = PoseStamped()
        pose.header.stamp = rospy.Time.now()
        pose.pose.position.x, pose.pose.position.y = self.x, self.y
        pose.pose.orientation.z, pose.pose.orientation.w = math.sin(self.heading / 2), math.cos(self.heading / 2)
        self.poses.publish(pose)
        self.sight.publish(Bool(False))
        self.front.publish(Range(range=1.0, max_range=0.5))
robots = [Robot(name, 0.5 + k, 0.5 + k) for k, name in enumerate(sys.argv[1:])]
rate, before = rospy.Rate(50), time.monotonic()
while not rospy.is_shutdown():
    now = time.monotonic()
    for robot in robots: robot.go(now - before)
    before = now
    rate.sleep()
"""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.fixture
def laboratory(tmp_path, monkeypatch):
    if shutil.which("rosmaster") is None or find_spec("rospy") is None:
        pytest.skip("there is no ROS")
    master, ports = free_port(), [free_port() for _ in NAMES]
    for name, value in {
        "ROS_MASTER_URI": f"http://127.0.0.1:{master}",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(tmp_path),
    }.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("PYTHONPATH", str(EXAMPLE.parent), prepend=os.pathsep)
    commands = [[shutil.which("rosmaster"), "--core", "-p", str(master)]]
    commands += [[sys.executable, "-c", WORLD, *NAMES]]
    for k, (name, port) in enumerate(zip(NAMES, ports, strict=True)):
        commands.append(
            [
                sys.executable,
                str(EXAMPLE),
                name,
                "127.0.0.1",
                str(port),
                *(("-0.7", "-1.0", "1.0", "-1.0") if k < 2 else ()),
            ]
        )
    text = 'tracker = "ros_robot:PoseTopics"\n[camera]\nfps = 10.0\n[evaluation]\nrepeats = 0\n[models]\npopulation = 4\n'
    text += "[classifiers]\npopulation = 8\n[run]\ngenerations = 1\nthreads = 1\n"
    text += "[scenario.arena]\nwidth_cm = 1000.0\nheight_cm = 1000.0\n"
    for k, (name, port) in enumerate(zip(NAMES, ports, strict=True)):
        role = "agent" if k < 2 else "replica"
        text += f'[[robots]]\nname = "{name}"\nrole = "{role}"\nmarker = "{name}"\naddress = "socket://127.0.0.1:{port}"\n'
    (tmp_path / "lab.toml").write_text(text)
    with (tmp_path / "said.txt").open("w") as said, ExitStack() as running:
        for command in commands:
            process = running.enter_context(subprocess.Popen(command, stdout=said, stderr=said))
            running.callback(process.terminate)
        for port in (master, *ports):
            deadline = time.monotonic() + 120
            while True:
                try:
                    socket.create_connection(("127.0.0.1", port)).close()
                    break
                except OSError:
                    assert time.monotonic() < deadline, (tmp_path / "said.txt").read_text()
                    time.sleep(0.5)
        time.sleep(5.0)
        yield tmp_path / "lab.toml"


def test_robots_of_ros_are_started_observed_and_halted_like_epucks(laboratory):
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
        np.median(speeds[:, :2], axis=2), [[[-0.85 * 12.8, -0.3 * 12.8 / 5.1]] * 2] * 2, rtol=0.03
    )
    left, right = trials.models[:, :, 0], trials.models[:, :, 1]
    expected = np.stack([12.8 * (left + right) / 2, 12.8 * (right - left) / 5.1], axis=-1)
    np.testing.assert_allclose(np.median(speeds[:, 2:], axis=2), expected, atol=0.15)
