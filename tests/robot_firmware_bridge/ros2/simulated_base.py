"""A ROS 2 base in its own process, written from what rmw_zenoh does and without a line of our driver: its oracle.

`python -m tests.robot_firmware_bridge.ros2.simulated_base ENDPOINT NAMESPACE Twist|TwistStamped`

Messages and type hashes are those of `rosbags`. Like a Create 3 it stops by itself 0.5 s after the last command. It
prints `wheels LEFT RIGHT at TIME because REASON` (m/s, and s of the monotonic clock) when they change, and reads lines:
`wall BEARING_DEG DISTANCE_M`, `battery PERCENTAGE`, `garbage` (malformed odometry), `silent 1` (no odometry, until
`silent 0`).
"""

import json
import math
import os
import struct
import sys
import threading
import time
from typing import Any

import numpy as np
import zenoh
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
TRACK_M, PERIOD_S, WATCHDOG_S = 0.233, 0.02, 0.5
SCAN_RAYS = 360


def ros(name: str, *values: Any) -> Any:
    """Return a message of rosbags, as in `ros("std_msgs/msg/String", "text")`."""
    return STORE.types[name](*values)


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0, kind: str = "Vector3") -> Any:
    return ros(f"geometry_msgs/msg/{kind}", x, y, z)


def header(frame: str) -> Any:
    now_ns = time.time_ns()
    stamp = ros("builtin_interfaces/msg/Time", now_ns // 10**9, now_ns % 10**9)
    return ros("std_msgs/msg/Header", stamp, frame)


def odometry(ahead_m_s: float, turn_rad_s: float) -> Any:
    """Return what a base says that moves so."""
    zeros = np.zeros(36)
    pose = ros(
        "geometry_msgs/msg/Pose",
        vector(kind="Point"),
        ros("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0),
    )
    twist = ros("geometry_msgs/msg/Twist", vector(ahead_m_s), vector(z=turn_rad_s))
    return ros(
        "nav_msgs/msg/Odometry",
        header("odom"),
        "base_link",
        ros("geometry_msgs/msg/PoseWithCovariance", pose, zeros),
        ros("geometry_msgs/msg/TwistWithCovariance", twist, zeros),
    )


class Base:
    """A node with its topics, and a base that is two numbers."""

    def __init__(self, endpoint: str, namespace: str, command: str) -> None:
        settings = {
            "mode": "peer",
            "connect": {"endpoints": [endpoint], "timeout_ms": -1, "exit_on_failure": False},
            "listen": {"endpoints": ["tcp/127.0.0.1:0"]},
            "scouting": {"multicast": {"enabled": False}},
        }
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        self.namespace = namespace
        self.command_type = f"geometry_msgs/msg/{command}"
        self.ids = 0
        self.tokens = [self.declare_token("NN")]
        self.lock = threading.Lock()
        self.twist = (0.0, 0.0)
        self.commanded_s = -math.inf
        self.wall: tuple[float, float] | None = None
        self.battery = 0.8
        self.is_silent = False
        self.subscriber = self.session.declare_subscriber(
            self.key("cmd_vel", self.command_type), self.obey
        )
        self.tokens.append(self.declare_token("MS", "cmd_vel", self.command_type))
        self.publishers = {
            topic: self.declare_publisher(topic, kind)
            for topic, kind in (
                ("odom", "nav_msgs/msg/Odometry"),
                ("scan", "sensor_msgs/msg/LaserScan"),
                ("battery_state", "sensor_msgs/msg/BatteryState"),
                ("range/left", "sensor_msgs/msg/Range"),
            )
        }

    def key(self, topic: str, kind: str) -> str:
        """`<domain>/<topic>/<type>/<hash>`."""
        return f"0/{self.namespace}/{topic}/{dds(kind)}/{STORE.hash_rihs01(kind)}"

    def declare_token(self, entity: str, topic: str = "", kind: str = "") -> Any:
        """`@ros2_lv/<domain>/<session>/<node>/<id>/<entity>/<enclave>/<namespace>/<name>`, then the topic's."""
        token = f"@ros2_lv/0/{self.session.zid()}/0/{self.ids}/{entity}/%/%{self.namespace}/motion"
        if topic:
            token += f"/%{self.namespace}%{topic}/{dds(kind)}/{STORE.hash_rihs01(kind)}/::,:,:,:,,"
        self.ids += 1
        return self.session.liveliness().declare_token(token)

    def declare_publisher(self, topic: str, kind: str) -> tuple[zenoh.Publisher, str]:
        self.tokens.append(self.declare_token("MP", topic, kind))
        return self.session.declare_publisher(self.key(topic, kind)), kind

    def publish(self, topic: str, message: Any) -> None:
        publisher, kind = self.publishers[topic]
        self.put(publisher, bytes(STORE.serialize_cdr(message, kind)))

    def put(self, publisher: zenoh.Publisher, data: bytes) -> None:
        beside = struct.pack("<qqB16s", 1, time.time_ns(), 16, os.urandom(16))
        publisher.put(data, attachment=beside)

    def obey(self, sample: zenoh.Sample) -> None:
        """Take a command, if it has what rmw_zenoh insists on beside it."""
        assert sample.attachment is not None
        assert len(sample.attachment.to_bytes()) == 33
        message = STORE.deserialize_cdr(sample.payload.to_bytes(), self.command_type)
        twist: Any = message.twist if hasattr(message, "twist") else message
        self.commanded_s = time.monotonic()
        self.turn(twist.linear.x, twist.angular.z, "commanded")

    def turn(self, ahead_m_s: float, turn_rad_s: float, reason: str) -> None:
        with self.lock:
            if (ahead_m_s, turn_rad_s) != self.twist:
                self.twist = (ahead_m_s, turn_rad_s)
                left, right = (ahead_m_s + side * turn_rad_s * TRACK_M / 2 for side in (-1, 1))
                now_s = time.monotonic()
                print(f"wheels {left:.4f} {right:.4f} at {now_s:.4f} because {reason}", flush=True)

    def run(self) -> None:
        """Move and measure until the process ends."""
        tick, due_s = 0, time.monotonic()
        while True:
            if time.monotonic() - self.commanded_s > WATCHDOG_S:
                self.turn(0.0, 0.0, "watchdog")
            if not self.is_silent:
                self.publish("odom", odometry(*self.twist))
            if tick % 5 == 0:
                self.publish("scan", self.scan())
                self.publish("range/left", self.range())
                self.publish("battery_state", self.battery_state())
            if tick == 0:
                print("ready", flush=True)
            tick += 1
            due_s = max(due_s + PERIOD_S, time.monotonic())
            time.sleep(due_s - time.monotonic() if due_s > time.monotonic() else 0.0)

    def scan(self) -> Any:
        step = 2 * math.pi / SCAN_RAYS
        ranges = np.full(SCAN_RAYS, math.inf, np.float32)
        if self.wall is not None:
            bearing_deg, distance_m = self.wall
            ranges[round(bearing_deg + 180.0) % SCAN_RAYS] = distance_m
        angles = (-math.pi, math.pi - step, step)
        nothing = np.zeros(0, np.float32)
        return ros(
            "sensor_msgs/msg/LaserScan",
            *(header("lidar"), *angles, 0.0, 0.1, 0.1, 12.0, ranges, nothing),
        )

    def range(self) -> Any:
        return ros("sensor_msgs/msg/Range", header("left"), 1, 0.3, 0.02, 0.5, 0.123, 0.0)

    def battery_state(self) -> Any:
        nan, nothing = math.nan, np.zeros(0, np.float32)
        values = (14.4, 25.0, -0.5, nan, nan, 26.0, self.battery, 2, 1, 2, True)
        return ros(
            "sensor_msgs/msg/BatteryState", header("battery"), *values, nothing, nothing, "", "B7"
        )

    def follow(self, line: str) -> None:
        """Do what a test asks for."""
        word, *values = line.split()
        numbers = [float(value) for value in values]
        if word == "wall":
            self.wall = (numbers[0], numbers[1])
        elif word == "battery":
            self.battery = numbers[0]
        elif word == "silent":
            self.is_silent = numbers == [1.0]
        elif word == "garbage":
            publisher, kind = self.publishers["odom"]
            data = bytes(STORE.serialize_cdr(odometry(*self.twist), kind))
            for bad in (b"", data[:100], data + bytes(8), os.urandom(len(data))):
                self.put(publisher, bad)
            publisher.put(data[:-1])


def dds(kind: str) -> str:
    package, _, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


def main() -> None:
    """Be a base."""
    base = Base(*sys.argv[1:4])
    threading.Thread(target=base.run, daemon=True).start()
    for line in sys.stdin:
        base.follow(line)
    os._exit(0)


if __name__ == "__main__":
    main()
