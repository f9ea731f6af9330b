"""Robots that speak ROS 2: a replica for any that takes a Twist, and poses from topics, motion capture or tf.

On each robot, or anywhere in its network (see docs/robots/any-robot.md):

    python ros2_robot.py robot_3 10.0.0.1 5003                        # a replica, at TCP port 5003, for the PC 10.0.0.1
    python ros2_robot.py robot_1 10.0.0.1 5001 -0.7 -1.0 1.0 -1.0     # an agent with the paper's controller

It subscribes to /robot_3/proximity0 ... proximity7 (sensor_msgs/Range, from the front right one clockwise) and /robot_3/sight
(std_msgs/Bool: a robot is ahead), each again and again, and publishes /robot_3/cmd_vel (geometry_msgs/Twist). A robot whose sensors
are silent stands.

The PC needs the poses alone. `tracker` in the laboratory's file is one of

    ros2_robot:PoseTopics      /robot_3/pose, geometry_msgs/PoseStamped, for each robot
    ros2_robot:PlainPoses      /robot_3/pose, geometry_msgs/Pose, for each robot
    ros2_robot:RigidBodies     /rigid_bodies, mocap4r2_msgs/RigidBodies, as of mocap4ros2: bodies have the robots' names
    ros2_robot:Transforms      /tf, tf2_msgs/TFMessage: child_frame_id is the robot's name
"""

import math
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Twist
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Range
from std_msgs.msg import Bool

from turing_learning.robots import LaboratorySetup, Track, live

# Of the robot, as [scenario.robot] in the laboratory's file: at full speed, between its wheels.
SPEED_CM_S = 12.8
AXLE_CM = 5.1

# What the loop takes for a wall: a reading as of an e-puck, half as bright at this distance (m).
BRIGHT = 3800
DARK = 60
HALF_M = 0.0075

# Of the poses: cm in their unit (ROS: m), and which of their axes are x and y of the arena, seen from above, and which points
# up. ("x", "y", "z") is ROS's own; a motion capture with y up has ("z", "x", "y"). Any right-handed choice will do.
CM = 100.0
AXES = ("x", "y", "z")

SILENCE_S = 1.0  # after which sensors count as broken: a robot without them stands
PATIENCE_S = 10.0  # until all robots have been seen once


class Spinning:
    """A node whose callbacks run in a thread, until it is closed."""

    def __init__(self, name: str) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = Node(name, context=self._context)
        self._executor = rclpy.executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def subscribe(self, message: type, topic: str, take: Callable[[Any], None]) -> None:
        # Best effort: takes what any publisher sends.
        self.node.create_subscription(message, topic, take, qos_profile_sensor_data)

    def close(self) -> None:
        self._executor.shutdown()
        self._thread.join(timeout=5.0)
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


class RosBody:
    """A `RobotBody`: wheels that are a Twist, and sensors that are topics."""

    def __init__(self, name: str, ros: Spinning) -> None:
        self._twist = ros.node.create_publisher(Twist, f"/{name}/cmd_vel", 1)
        self._sight, self._ranges = False, [math.inf] * 8
        self._seen_s = self._felt_s = -math.inf
        ros.subscribe(Bool, f"/{name}/sight", self._see)
        for number in range(8):
            ros.subscribe(
                Range,
                f"/{name}/proximity{number}",
                lambda message, number=number: self._feel(message, number),
            )

    def _see(self, message: Bool) -> None:
        self._sight = message.data
        self._seen_s = time.monotonic()

    def _feel(self, message: Range, number: int) -> None:
        self._felt_s = time.monotonic()
        near = message.range < message.max_range
        self._ranges[number] = message.range if near else math.inf

    def set_speed(self, left: int, right: int) -> None:
        full_m_s = SPEED_CM_S / 100 / 1000  # of a step per second
        twist = Twist()
        twist.linear.x = full_m_s * (left + right) / 2
        twist.angular.z = full_m_s * (right - left) / (AXLE_CM / 100)
        self._twist.publish(twist)

    def proximity(self) -> tuple[int, ...]:
        if time.monotonic() - self._felt_s > SILENCE_S:
            raise ConnectionError("no proximity sensor says anything")
        return tuple(
            round(DARK + BRIGHT / (1 + (distance / HALF_M) ** 2)) for distance in self._ranges
        )

    def battery_ok(self) -> bool:
        return True

    def sight(self) -> int:
        if time.monotonic() - self._seen_s > SILENCE_S:
            raise ConnectionError("the line-of-sight sensor says nothing")
        return int(self._sight)


def pose_of(position: Point, turn: Quaternion) -> tuple[float, float, float]:
    """Return x, y (cm) and heading (rad) in the arena, of a robot whose own x axis points ahead when it lies in ROS's axes."""
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    columns = {
        "x": (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        "y": (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        "z": (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    }
    right, ahead, _ = ("xyz".index(axis) for axis in AXES)
    forward = columns[AXES[0]]  # the body's axes are named as those of the room
    place = (position.x, position.y, position.z)
    return CM * place[right], CM * place[ahead], math.atan2(forward[ahead], forward[right])


class Poses:
    """A `PoseSource` of stamped poses, more often than `camera.fps`; `subscribe` lets `take` be called with them."""

    def __init__(self, setup: LaboratorySetup) -> None:
        self._labels, self._interval_s = setup.labels, 1 / setup.camera.fps
        names = [robot.name for robot in (*setup.agents, *setup.replicas)]
        self._seen: dict[str, deque[tuple[float, ...]]] = {
            name: deque(maxlen=20_000) for name in names
        }
        self._ros = Spinning("turing_learning")
        self.subscribe(self._ros)
        deadline = time.monotonic() + PATIENCE_S
        while silent := [name for name, seen in self._seen.items() if not seen]:
            if time.monotonic() > deadline:
                self.close()
                raise ConnectionError(f"no poses come of {', '.join(silent)}")
            time.sleep(0.05)

    def subscribe(self, ros: Spinning) -> None:
        raise NotImplementedError

    def take(self, name: str, stamp: Any, position: Point, turn: Quaternion) -> None:
        pose = pose_of(position, turn)
        # Motion capture says NaN of what it has lost
        if name in self._seen and all(map(math.isfinite, pose)):
            stamp_s = stamp.sec + 1e-9 * stamp.nanosec
            self._seen[name].append((stamp_s, time.monotonic() - stamp_s, *pose))

    def track(self, begin_s: float, images: int) -> Track:
        due_s = begin_s + self._interval_s * np.arange(images)
        time.sleep(max(0.0, due_s[-1] + self._interval_s - time.monotonic()))
        poses = np.zeros((images, len(self._seen), 3))
        present = np.zeros((images, len(self._seen)), bool)
        for who, seen in enumerate(self._seen.values()):
            rows = np.array(seen)[-1000 - 10 * images :]
            times = (
                rows[:, 0] + rows[:, 1].min()
            )  # by this computer's clock: the fastest message has had no delay
            if len(times) < 2:
                continue
            after = np.clip(np.searchsorted(times, due_s), 1, len(times) - 1)
            around = (times[after - 1] <= due_s) & (times[after] >= due_s)
            present[:, who] = around & (times[after] - times[after - 1] < self._interval_s)
            for column, values in enumerate((rows[:, 2], rows[:, 3], np.unwrap(rows[:, 4]))):
                poses[:, who, column] = np.interp(due_s, times, values)
        return Track(poses, present, self._labels, self._interval_s)

    def close(self) -> None:
        self._ros.close()


class PoseTopics(Poses):
    """A topic of PoseStamped for each robot."""

    def subscribe(self, ros: Spinning) -> None:
        for name in self._seen:
            ros.subscribe(
                PoseStamped,
                f"/{name}/pose",
                lambda message, name=name: self._stamped(message, name),
            )

    def _stamped(self, message: PoseStamped, name: str) -> None:
        self.take(name, message.header.stamp, message.pose.position, message.pose.orientation)


class PlainPoses(Poses):
    """A topic of Pose for each robot. It has no stamp: the time is that of its arrival."""

    def subscribe(self, ros: Spinning) -> None:
        for name in self._seen:
            ros.subscribe(
                Pose,
                f"/{name}/pose",
                lambda message, name=name: self.take(
                    name, ros.node.get_clock().now().to_msg(), message.position, message.orientation
                ),
            )


class RigidBodies(Poses):
    """The topic of mocap4ros2, whose messages have to be installed."""

    def subscribe(self, ros: Spinning) -> None:
        from mocap4r2_msgs.msg import RigidBodies as Message

        ros.subscribe(Message, "/rigid_bodies", self.take_bodies)

    def take_bodies(self, message: Any) -> None:
        for body in message.rigidbodies:
            self.take(
                body.rigid_body_name,
                message.header.stamp,
                body.pose.position,
                body.pose.orientation,
            )


class Transforms(Poses):
    """The transforms of tf2."""

    def subscribe(self, ros: Spinning) -> None:
        from tf2_msgs.msg import TFMessage

        ros.subscribe(TFMessage, "/tf", self.take_transforms)

    def take_transforms(self, message: Any) -> None:
        for each in message.transforms:
            self.take(
                each.child_frame_id,
                each.header.stamp,
                each.transform.translation,
                each.transform.rotation,
            )


if __name__ == "__main__":
    robot, pc, port, *speeds = sys.argv[1:]
    controller = tuple(float(speed) for speed in speeds) or None
    live(
        RosBody(robot, Spinning(robot)),
        host="0.0.0.0",
        port=int(port),
        peers=[pc],
        controller=controller,
    )
