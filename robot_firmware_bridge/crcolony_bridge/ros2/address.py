"""Where a ROS 2 robot is, as one text: a Zenoh router, the robot's namespace, and what its base is like.

tcp/10.0.0.5:7447/robot1
tcp/10.0.0.5:7447/robot1?model=turtlebot4
tcp/[fe80::1]:7447?domain=3&track_m=0.16&radius_m=0.105&max_speed_m_s=0.22&ranges=range/left:45,range/front:0
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from crcolony.body.settings import WHEEL_LIMIT_M_S
from crcolony.errors import did_you_mean
from crcolony.transport.endpoint import DATAGRAMS, STREAMS, parse_endpoint
from crcolony.transport.interface import NetworkError
from crcolony_bridge.errors import DeviceError

_EXAMPLE = "expected ENDPOINT[/NAMESPACE][?OPTION=VALUE&…], as in tcp/10.0.0.5:7447/robot1"
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_MAX_DOMAIN = 232


@dataclass(frozen=True)
class Base:
    """What a differential-drive base is like: nothing of this is in its messages."""

    model: str
    track_m: float
    radius_m: float
    max_speed_m_s: float
    watchdog_s: float
    """It stops by itself so long after the last command; 0: it does not"""
    scan_yaw_rad: float = 0.0
    """How far to the left of ahead the laser scanner's own direction 0 is"""


# From the makers' descriptions of their robots, not measured. The speed is that of `safety_override: none`.
CREATE3 = Base("Create 3", 0.233, 0.17, 0.306, 0.5)
BASES = {
    "create3": CREATE3,
    "turtlebot4": replace(CREATE3, model="TurtleBot 4", scan_yaw_rad=math.pi / 2),
}


@dataclass(frozen=True)
class RangeSensor:
    """A topic of single distances, and where its sensor looks."""

    topic: str
    bearing_rad: float


@dataclass(frozen=True)
class Ros2Address:
    """A robot's place."""

    endpoint: str
    """Of the Zenoh router, as Zenoh writes it"""
    namespace: str
    """Empty, or begins with a slash"""
    domain: int
    base: Base
    ranges: tuple[RangeSensor, ...] = ()

    @property
    def uid(self) -> str:
        """What the robot is called: its namespace, or where it is if it has none."""
        return self.namespace.strip("/") or self.endpoint.partition("/")[2]

    def topic(self, name: str) -> str:
        """Return the full name of a topic of this robot."""
        return f"{self.namespace}/{name}"


def parse_address(text: str) -> Ros2Address:
    """Return the address that a text means; raises DeviceError, with one line, for what is none."""
    place, _, options = text.partition("?")
    protocol, *rest = place.split("/")
    if protocol not in STREAMS | DATAGRAMS or not rest:
        raise DeviceError(f"{text}: {_EXAMPLE}")
    endpoint, names = f"{protocol}/{rest[0]}", rest[1:]
    try:
        parse_endpoint(endpoint)
    except NetworkError as error:
        raise DeviceError(str(error)) from None
    if not all(map(_NAME.fullmatch, names)):
        raise DeviceError(f"{text}: {'/'.join(names)} is no namespace of ROS 2; {_EXAMPLE}")
    namespace = "".join(f"/{name}" for name in names)
    given = _options(text, options)
    base = given.pop("model", CREATE3)
    domain, ranges = given.pop("domain", 0), given.pop("ranges", ())
    sensors = tuple(RangeSensor(f"{namespace}/{topic}", bearing) for topic, bearing in ranges)
    return Ros2Address(endpoint, namespace, domain, replace(base, **given), sensors)


def _options(text: str, options: str) -> dict[str, Any]:
    """Return the options by their names, those of a base by the names of its fields."""
    values: dict[str, Any] = {}
    for option in filter(None, options.split("&")):
        name, _, value = option.partition("=")
        if name not in _OPTIONS:
            raise DeviceError(
                f"{text}: no option is called {name}{did_you_mean(name, _OPTIONS)};"
                f" there are {', '.join(_OPTIONS)}"
            )
        field, parse = _OPTIONS[name]
        try:
            values[field] = parse(value)
        except ValueError as error:
            raise DeviceError(f"{text}: {name}={value}: {error}") from None
    return values


def _model(value: str) -> Base:
    if value not in BASES:
        raise ValueError(f"known are {', '.join(BASES)}")
    return BASES[value]


def _domain(value: str) -> int:
    if not (value.isascii() and value.isdigit() and int(value) <= _MAX_DOMAIN):
        raise ValueError(f"expected ROS_DOMAIN_ID, from 0 to {_MAX_DOMAIN}")
    return int(value)


def _number(low: float, high: float, unit: str) -> Callable[[str], float]:
    def parse(value: str) -> float:
        expected = f"expected {low:g} to {high:g} {unit}"
        try:
            number = float(value)
        except ValueError:
            raise ValueError(expected) from None
        if not low <= number <= high:  # nor is NaN
            raise ValueError(expected)
        return number

    return parse


def _bearing_rad(value: str) -> float:
    return math.radians(_number(-180.0, 180.0, "degrees to the left of ahead")(value))


def _ranges(value: str) -> tuple[tuple[str, float], ...]:
    sensors = []
    for sensor in value.split(","):
        topic, colon, bearing = sensor.partition(":")
        if not colon or not all(map(_NAME.fullmatch, topic.split("/"))):
            raise ValueError("expected TOPIC:DEGREES,…, as in range/left:45,range/front:0")
        sensors.append((topic, _bearing_rad(bearing)))
    return tuple(sensors)


_OPTIONS: dict[str, tuple[str, Callable[[str], Any]]] = {
    "domain": ("domain", _domain),
    "model": ("model", _model),
    "track_m": ("track_m", _number(0.01, 2.0, "m")),
    "radius_m": ("radius_m", _number(0.01, 2.0, "m")),
    "max_speed_m_s": ("max_speed_m_s", _number(0.01, WHEEL_LIMIT_M_S, "m/s")),
    "watchdog_s": ("watchdog_s", _number(0.0, 1.0, "s; 0: the base does not stop by itself")),
    "scan_yaw_deg": ("scan_yaw_rad", _bearing_rad),
    "ranges": ("ranges", _ranges),
}
"""Every option: the field that it sets, and how its text is read."""
