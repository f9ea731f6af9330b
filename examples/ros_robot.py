"""Robots that speak ROS 1: a replica for any that takes a Twist, and poses from topics, as of motion capture.

On each robot, or anywhere in its network (see docs/robots/any-robot.md):

    python ros_robot.py robot_3 10.0.0.1 5003                         # a replica, at TCP port 5003, for the PC 10.0.0.1
    python ros_robot.py robot_1 10.0.0.1 5001 -0.7 -1.0 1.0 -1.0      # an agent with the paper's controller

It subscribes to /robot_3/proximity0 ... proximity7 (sensor_msgs/Range, from the front right one clockwise) and /robot_3/sight
(std_msgs/Bool: a robot is ahead), and publishes /robot_3/cmd_vel (geometry_msgs/Twist). The PC needs the poses alone, /robot_3/pose
(geometry_msgs/PoseStamped): `tracker = "ros_robot:PoseTopics"`.
"""

import math
import sys
import time
from collections import deque
from typing import Any

import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Range
from std_msgs.msg import Bool

from turing_learning.robots import LaboratorySetup, Track, live

SPEED_CM_S, AXLE_CM = (
    12.8,
    5.1,
)  # of the robot: at full speed, between its wheels; as [scenario.robot] in the laboratory's file
BRIGHT, DARK, HALF_M = (
    3800,
    60,
    0.0075,
)  # what the loop takes for a wall: a reading as of an e-puck, half as bright at this distance


SILENCE_S = 1.0  # after which sensors count as broken: a robot without them stands


class RosBody:
    """A `RobotBody`: wheels that are a Twist, and sensors that are topics."""

    def __init__(self, name: str) -> None:
        self._twist = rospy.Publisher(f"/{name}/cmd_vel", Twist, queue_size=1)
        self._sight, self._ranges = False, [math.inf] * 8
        self._seen_s = self._felt_s = -math.inf
        rospy.Subscriber(f"/{name}/sight", Bool, self._see)
        for k in range(8):
            rospy.Subscriber(f"/{name}/proximity{k}", Range, self._feel, callback_args=k)

    def _see(self, message: Bool) -> None:
        self._sight = message.data
        self._seen_s = time.monotonic()

    def _feel(self, message: Range, number: int) -> None:
        self._felt_s = time.monotonic()
        self._ranges[number] = message.range if message.range < message.max_range else math.inf

    def set_speed(self, left: int, right: int) -> None:
        full = SPEED_CM_S / 100 / 1000  # m/s of a step per second
        twist = Twist()
        twist.linear.x, twist.angular.z = (
            full * (left + right) / 2,
            full * (right - left) / (AXLE_CM / 100),
        )
        self._twist.publish(twist)

    def proximity(self) -> tuple[int, ...]:
        if time.monotonic() - self._felt_s > SILENCE_S:
            raise ConnectionError("no proximity sensor says anything")
        return tuple(round(DARK + BRIGHT / (1 + (far / HALF_M) ** 2)) for far in self._ranges)

    def battery_ok(self) -> bool:
        return True

    def sight(self) -> int:
        if time.monotonic() - self._seen_s > SILENCE_S:
            raise ConnectionError("the line-of-sight sensor says nothing")
        return int(self._sight)


class PoseTopics:
    """A `PoseSource`: for each robot a topic of PoseStamped (m), more often than `camera.fps`; time is that of the stamps."""

    def __init__(self, setup: LaboratorySetup, topic: str = "/{}/pose") -> None:
        self._labels, self._interval_s = setup.labels, 1 / setup.camera.fps
        rospy.init_node("turing_learning", anonymous=True, disable_signals=True)
        self._seen: list[deque[tuple[float, ...]]] = []
        self._topics = []
        for robot in (*setup.agents, *setup.replicas):
            self._seen.append(deque(maxlen=20000))
            self._topics.append(
                rospy.Subscriber(
                    topic.format(robot.name), PoseStamped, self._take, callback_args=self._seen[-1]
                )
            )
        deadline = time.monotonic() + 10
        while silent := [
            each.resolved_name
            for each, seen in zip(self._topics, self._seen, strict=True)
            if not seen
        ]:
            if time.monotonic() > deadline:
                raise ConnectionError(f"no poses come from {', '.join(silent)}")
            time.sleep(0.05)

    def _take(self, message: PoseStamped, seen: Any) -> None:
        stamp_s, at, turn = (
            message.header.stamp.to_sec(),
            message.pose.position,
            message.pose.orientation,
        )
        heading = math.atan2(
            2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y**2 + turn.z**2)
        )
        # a tracker that lost a robot may say so by a pose that is no number
        if math.isfinite(at.x + at.y + heading):
            seen.append((stamp_s, time.monotonic() - stamp_s, 100 * at.x, 100 * at.y, heading))

    def track(self, begin_s: float, images: int) -> Track:
        due_s = begin_s + self._interval_s * np.arange(images)
        time.sleep(max(0.0, due_s[-1] + self._interval_s - time.monotonic()))
        poses, present = (
            np.zeros((images, len(self._seen), 3)),
            np.zeros((images, len(self._seen)), bool),
        )
        for who, seen in enumerate(self._seen):
            rows = np.array(seen)[-1000 - 10 * images :] if len(seen) else np.full((1, 5), math.nan)
            times = (
                rows[:, 0] + rows[:, 1].min()
            )  # by this computer's clock: the fastest message has had no delay
            after = (
                np.clip(np.searchsorted(times, due_s), 1, len(times) - 1)
                if len(times) > 1
                else np.zeros(images, int)
            )
            present[:, who] = (
                (times[after - 1] <= due_s)
                & (times[after] >= due_s)
                & (times[after] - times[after - 1] < self._interval_s)
            )
            for k, values in enumerate((rows[:, 2], rows[:, 3], np.unwrap(rows[:, 4]))):
                poses[:, who, k] = np.nan_to_num(np.interp(due_s, times, values))
        return Track(poses, present, self._labels, self._interval_s)

    def close(self) -> None:
        for topic in self._topics:
            topic.unregister()


if __name__ == "__main__":
    robot, pc, port, *speeds = sys.argv[1:]
    controller = tuple(float(speed) for speed in speeds) or None
    rospy.init_node(robot)
    reached = {"host": "0.0.0.0", "port": int(port), "peers": [pc]}
    live(RosBody(robot), **reached, controller=controller, ended=rospy.is_shutdown)
