"""Robots that run ROS 2 Jazzy over Zenoh (rmw_zenoh): TurtleBot 4, Create 3, and other differential-drive bases.

No ROS is needed on this machine. A robot is given as

    ros2@ENDPOINT[/NAMESPACE][?OPTION=VALUE&…]        ros2@tcp/10.0.0.5:7447/robot1?model=turtlebot4

ENDPOINT is the Zenoh router of the robots (rmw_zenohd), NAMESPACE the robot's own. Options: `domain` (ROS_DOMAIN_ID),
`model` (create3, which is the default, or turtlebot4), and for other bases `track_m`, `radius_m`, `max_speed_m_s`,
`watchdog_s`, `scan_yaw_deg` (where the scanner's direction 0 is, left of ahead), `ranges` (`TOPIC:DEGREES,…`: single
distance sensors and where they look). Used are `cmd_vel` (Twist, or TwistStamped where the robot subscribes to that),
`odom`, and if they are published `scan`, `battery_state` and those ranges.

What stops the wheels: this process, when the time to live of a command is over; and the base itself, `watchdog_s` after
the last command (0.5 s for a Create 3). When this machine is frozen or dead, only the base's own watchdog does. It
cannot be tested from here whether a base has one: for one without, say `watchdog_s=0`.

ROS 2 has no emergency stop that all bases have: the latch is on this side. While it is held, the base is told again and
again to stand still, and a stop is confirmed once its odometry has said for 0.1 s that it does. Whoever else publishes
`cmd_vel`, as a joystick does, can still move it: then a stop is not confirmed.
"""

import math
import time
from typing import cast

import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony_bridge.driver import (
    PROXIMITY_BEARINGS_RAD,
    DriverState,
    Reading,
    RobotDescription,
    limited_action,
)
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.reconnecting_driver import ReconnectingDriver
from crcolony_bridge.ros2 import keys, senses
from crcolony_bridge.ros2.address import Ros2Address, parse_address
from crcolony_bridge.ros2.messages import (
    BatteryState,
    LaserScan,
    Odometry,
    Range,
    Twist,
    TwistStamped,
    Vector3,
)
from crcolony_bridge.ros2.session import Received, Ros2Session
from crcolony_bridge.ros2.wheel_commands import WheelCommands

MAX_TTL_S = 0.5
CONNECT_TIMEOUT_S = 1.0
_SETTLE_S = 0.1
"""A base that has stood still for so long since a stop has obeyed it; for a moment it may between two commands."""
_STANDING_M_S = 0.01
_FORGET_S = 1.0
"""Distances that are older are not observed any more."""
_BATTERY_LOW, _BATTERY_CRITICAL = 0.2, 0.05
_WITHOUT = slice(contract.JAW, contract.BEACON + 1)
"""What these robots do not have."""


class Ros2Robot(ReconnectingDriver):
    """A robot that runs ROS 2. Raises DeviceError for what is no address of one."""

    def __init__(self, address: str) -> None:
        self._address = parse_address(address)
        super().__init__(describe(self._address))
        self._max_ttl_s = min(self._address.base.watchdog_s or MAX_TTL_S, MAX_TTL_S)
        self._session: Ros2Session | None = None
        self._commands: WheelCommands | None = None
        self._odometry_number = 0
        self._moved_s = 0.0
        """When odometry last said that a wheel turns"""
        self._started_s: float | None = None
        """The robot's own time of its first odometry"""

    def write(self, action: FloatArray) -> FloatArray:
        """See `Driver`."""
        is_active = self._state is DriverState.ACTIVE
        applied = limited_action(action, self._description, self._max_ttl_s, may_move=is_active)
        applied[_WITHOUT] = 0.0
        commands = self._commands
        if is_active and commands is not None:  # another controller may drive it otherwise
            left, right = applied[contract.WHEEL_LEFT], applied[contract.WHEEL_RIGHT]
            motion = senses.twist_of(float(left), float(right), self._address.base)
            commands.drive(*motion, ttl_s=float(applied[contract.TTL]))
        return applied

    def send_ir(self, message: bytes) -> bool:
        """See `Driver`."""
        return False

    # The network ------------------------------------------------------------------------------------------------------

    def _connect(self) -> None:
        """Join the robot's network, and wait until the robot is there and says how it moves."""
        address = self._address
        session = Ros2Session(address.endpoint, address.domain, address.namespace)
        self._session = session
        self._subscribe(session)
        if not session.wait_until(lambda: bool(self._command_types()), CONNECT_TIMEOUT_S):
            raise DeviceLostError(f"{self._where}: {self._whom_is_there()}")
        ros_type = self._command_type()
        publisher = session.publisher(address.topic("cmd_vel"), ros_type)
        is_stamped = ros_type is keys.TWIST_STAMPED
        self._commands = WheelCommands(
            lambda ahead_m_s, turn_rad_s: publisher.put(
                command(ahead_m_s, turn_rad_s, is_stamped=is_stamped)
            ),
            is_latched=self._is_held,
        )
        self._commands.stand_still()
        self._odometry_number = 0
        # A robot whose battery is low must not be observed with a full one until its first message.
        session.wait_until(lambda: all(map(self._newest, self._published())), CONNECT_TIMEOUT_S)
        if self._newest("odom") is None:
            raise DeviceLostError(f"{self._where}: nothing is published on {address.topic('odom')}")

    def _subscribe(self, session: Ros2Session) -> None:
        topic = self._address.topic
        session.subscribe(
            topic("odom"),
            keys.ODOMETRY,
            Odometry,
            lambda odometry: senses.is_finite(odometry.twist.twist),
        )
        session.subscribe(topic("scan"), keys.LASER_SCAN, LaserScan)
        session.subscribe(topic("battery_state"), keys.BATTERY_STATE, BatteryState)
        for sensor in self._address.ranges:
            session.subscribe(sensor.topic, keys.RANGE, Range)

    def _disconnect(self) -> None:
        commands, self._commands = self._commands, None
        if commands is not None:
            commands.close()
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def _stand_still(self) -> None:
        if (commands := self._commands) is not None:
            commands.stand_still()

    def _send_stop(self) -> None:
        if (commands := self._commands) is not None:
            commands.latch()

    def _send_clear(self) -> None:
        if (commands := self._commands) is not None:
            commands.release()

    def _read(self, timeout_s: float) -> Reading | None:
        session = self._session
        if session is None:
            return None

        def has_changed() -> bool:
            odometry = self._newest("odom")
            is_new = odometry is not None and odometry.number != self._odometry_number
            return is_new or not self._command_types()

        if not session.wait_until(has_changed, timeout_s):
            return None
        if not self._command_types():
            raise DeviceLostError(f"{self._where}: it has left the network")
        odometry = self._newest("odom")
        if odometry is None or odometry.number == self._odometry_number:
            return None
        self._odometry_number = odometry.number
        return self._reading_of(odometry)

    # What arrives -----------------------------------------------------------------------------------------------------

    def _reading_of(self, received: Received) -> Reading:
        base, odometry = self._address.base, cast(Odometry, received.message)
        scan = self._recent("scan")
        seen = (
            senses.distances_of_scan(cast(LaserScan, scan), base) if scan else senses.NO_DISTANCES
        )
        ranges = [(s.bearing_rad, self._recent_on(s.topic)) for s in self._address.ranges]
        single = senses.distances_of_ranges(
            (bearing_rad, cast(Range, found)) for bearing_rad, found in ranges if found
        )
        received_battery = self._newest("battery_state")
        battery = cast(BatteryState, received_battery.message) if received_battery else None
        level = senses.battery_level(battery) if battery else None
        voltage_v = battery.voltage if battery else 0.0
        return Reading(
            self._time_s(odometry),
            senses.observe(odometry, np.concatenate([seen, single]), level, base),
            battery_v=voltage_v if math.isfinite(voltage_v) else 0.0,
            is_battery_low=level is not None and level < _BATTERY_LOW,
            is_battery_critical=level is not None and level < _BATTERY_CRITICAL,
            is_stopped=self._is_stop_seen(received),
        )

    def _is_stop_seen(self, received: Received) -> bool:
        """Return whether the latch is held and the base has stood still since."""
        wheels = senses.wheel_speeds_m_s(cast(Odometry, received.message), self._address.base)
        if max(map(abs, wheels)) >= _STANDING_M_S:
            self._moved_s = received.received_s
        latched_s = self._commands.latched_s if self._commands is not None else None
        if latched_s is None:
            return False
        return received.received_s - max(latched_s, self._moved_s) >= _SETTLE_S

    def _time_s(self, odometry: Odometry) -> float:
        stamp = odometry.header.stamp
        time_s = stamp.sec + stamp.nanosec * 1e-9
        if self._started_s is None:
            self._started_s = time_s
        return time_s - self._started_s

    def _newest(self, name: str) -> Received | None:
        return self._newest_on(self._address.topic(name))

    def _newest_on(self, topic: str) -> Received | None:
        session = self._session
        return session.newest(topic) if session is not None else None

    def _recent(self, name: str) -> object | None:
        return self._recent_on(self._address.topic(name))

    def _recent_on(self, topic: str) -> object | None:
        received = self._newest_on(topic)
        if received is None or time.monotonic() - received.received_s > _FORGET_S:
            return None
        return received.message

    # Who is there -----------------------------------------------------------------------------------------------------

    @property
    def _where(self) -> str:
        return f"{self._address.endpoint}{self._address.namespace}"

    def _command_types(self) -> list[keys.Endpoint]:
        """Return who subscribes to this robot's commands, whatever their type."""
        topic, session = self._address.topic("cmd_vel"), self._session
        found = session.endpoints() if session is not None else []
        return [endpoint for endpoint in found if endpoint.kind == "MS" and endpoint.topic == topic]

    def _published(self) -> list[str]:
        """Return the topics that this robot publishes, of those that it is known by; odometry is always one."""
        session = self._session
        found = session.endpoints() if session is not None else []
        topics = {endpoint.topic for endpoint in found if endpoint.kind == "MP"}
        others = [name for name in ("scan", "battery_state") if self._address.topic(name) in topics]
        return ["odom", *others]

    def _command_type(self) -> keys.RosType:
        """Return the type of the commands that this robot wants, TwistStamped if it takes both."""
        found = self._command_types()
        for ros_type in (keys.TWIST_STAMPED, keys.TWIST):
            if any(e.has_type(ros_type) and e.type_hash == ros_type.hash for e in found):
                return ros_type
        types = ", ".join(sorted({endpoint.type_key for endpoint in found}))
        raise DeviceError(
            f"{self._where}: cmd_vel is {types} there, not Twist or TwistStamped of ROS 2 Jazzy"
        )

    def _whom_is_there(self) -> str:
        """Say why there is no robot, by what else is there."""
        topic, session = self._address.topic("cmd_vel"), self._session
        found = session.endpoints() if session is not None else []
        others = {e.topic for e in found if e.kind == "MS" and e.topic.endswith("/cmd_vel")}
        if others:
            return f"nobody subscribes to {topic}; there are {', '.join(sorted(others))}"
        return f"nobody subscribes to {topic} (ROS_DOMAIN_ID {self._address.domain}, rmw_zenoh)"


def command(ahead_m_s: float, turn_rad_s: float, *, is_stamped: bool) -> Twist | TwistStamped:
    """Return the message that commands a motion.

    A stamp stays 0, which ros2_control takes for now: the robot's clock may differ from ours, and it drops what is old.
    """
    twist = Twist(Vector3(x=ahead_m_s), Vector3(z=turn_rad_s))
    return TwistStamped(twist=twist) if is_stamped else twist


def describe(address: Ros2Address) -> RobotDescription:
    """Return what a robot is, by its address."""
    base = address.base
    return RobotDescription(
        model=f"{base.model} (ROS 2)",
        uid=address.uid,
        track_m=base.track_m,
        radius_m=base.radius_m,
        max_speed_m_s=base.max_speed_m_s,
        proximity_bearings_rad=PROXIMITY_BEARINGS_RAD,
        proximity_range_m=senses.PROXIMITY_RANGE_M,
        watchdog_s=base.watchdog_s,
        watchdog="robot's own base" if base.watchdog_s > 0.0 else "none",
        period_s=0.05,
    )
