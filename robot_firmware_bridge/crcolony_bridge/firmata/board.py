"""How a robot with Firmata is wired and what it measures: a TOML file, of which `boards/` has examples."""

from collections.abc import Iterator
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from crcolony.body import contract
from crcolony.body.settings import WHEEL_LIMIT_M_S
from crcolony.errors import did_you_mean
from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.firmata.protocol import BAUD, MAX_CHANNEL, MAX_PIN

DEFAULT_BOARD = "uno_motor_shield"
_SUFFIX = ".toml"
_SERIAL_PINS = (0, 1)
"""The host is at them"""

Pin = Annotated[int, Meta(ge=0, le=MAX_PIN)]
Channel = Annotated[int, Meta(ge=0, le=MAX_CHANNEL)]
Volts = Annotated[float, Meta(ge=0.0, le=100.0)]
Metres = Annotated[float, Meta(ge=0.0, le=10.0)]
Length = Annotated[float, Meta(gt=0.0, le=2.0)]


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table of the file; a key that it does not know is refused."""


class Motor(Part, frozen=True):
    """A motor on an H-bridge: how fast by PWM, and in which direction by one pin or two."""

    pwm: Pin
    ahead: Pin | None = None
    """High to drive ahead"""
    back: Pin | None = None
    """High to drive back"""

    def __post_init__(self) -> None:
        if self.ahead is None and self.back is None:
            raise ValueError("`ahead` or `back` is missing")

    @property
    def pins(self) -> tuple[int, ...]:
        """All of its pins, that of PWM first."""
        return (self.pwm, *self.directions)

    @property
    def directions(self) -> tuple[int, ...]:
        """The pins of its direction."""
        return tuple(pin for pin in (self.ahead, self.back) if pin is not None)


class Sensor(Part, frozen=True):
    """A proximity sensor."""

    analog: Channel
    column: Annotated[int, Meta(ge=0, lt=contract.PROXIMITY_SENSORS)]
    """Where it is among the proximity sensors of an observation: 0 is rightmost, 3 is ahead"""
    bearing_rad: Annotated[float, Meta(ge=-3.15, le=3.15)]


class Proximity(Part, frozen=True):
    """Proximity sensors of one kind, and which distance a voltage means: lines between points."""

    sensors: tuple[Sensor, ...]
    volts: Annotated[tuple[Volts, ...], Meta(min_length=2)]
    """Rising"""
    metres: tuple[Metres, ...]
    """For each of `volts`"""

    def __post_init__(self) -> None:
        if any(low >= high for low, high in pairwise(self.volts)):
            raise ValueError("`volts` must rise from one to the next")
        if len(self.metres) != len(self.volts):
            raise ValueError("`metres` must be as many as `volts`")
        if max(self.metres) <= 0.0:
            raise ValueError("`metres` must not all be 0")
        if len({sensor.column for sensor in self.sensors}) < len(self.sensors):
            raise ValueError("`sensors` must have different columns")


class Battery(Part, frozen=True):
    """A battery that is measured through a divider."""

    analog: Channel
    volts_per_volt: Annotated[float, Meta(gt=0.0, le=100.0)]
    """Of the battery, for one at the channel"""
    empty_v: Volts
    full_v: Volts
    low_v: Volts

    def __post_init__(self) -> None:
        if self.full_v <= self.empty_v:
            raise ValueError("`full_v` must be above `empty_v`")


class Board(Part, frozen=True):
    """A robot as it is wired."""

    model: Annotated[str, Meta(min_length=1, max_length=80)]
    left: Motor
    right: Motor
    track_m: Length
    radius_m: Length
    max_speed_m_s: Annotated[float, Meta(gt=0.0, le=WHEEL_LIMIT_M_S)]
    """Of a wheel at full PWM"""
    least_duty: Annotated[float, Meta(ge=0.0, le=0.9)] = 0.0
    """The share of full PWM below which the motors do not turn; speeds are spread over the rest"""
    at_rest: Literal["coast", "brake"] = "coast"
    """What a motor does without PWM: `coast` has its pins of direction low, `brake` has both high"""
    reference_v: Annotated[float, Meta(gt=0.0, le=10.0)] = 5.0
    """What an analog channel reports as its highest value"""
    proximity: Proximity | None = None
    battery: Battery | None = None
    baud: Annotated[int, Meta(ge=300, le=2_000_000)] = BAUD

    def __post_init__(self) -> None:
        if len(set(self.pins)) < len(self.pins):
            raise ValueError("`left` and `right`: a pin is used twice")
        if any(pin in _SERIAL_PINS for pin in self.pins):
            raise ValueError("`left` and `right`: pins 0 and 1 are those of the serial line")
        if self.at_rest == "brake" and any(len(m.directions) < 2 for m in (self.left, self.right)):
            raise ValueError('`at_rest`: "brake" needs both `ahead` and `back` of each motor')
        if len(set(self.channels)) < len(self.channels):
            raise ValueError("`analog`: a channel is used twice")

    @property
    def pins(self) -> tuple[int, ...]:
        """All pins of the motors."""
        return self.left.pins + self.right.pins

    @property
    def channels(self) -> tuple[int, ...]:
        """All analog channels that are measured."""
        sensors = self.proximity.sensors if self.proximity is not None else ()
        battery = (self.battery.analog,) if self.battery is not None else ()
        return (*(sensor.analog for sensor in sensors), *battery)

    def describe(self, uid: str, period_s: float) -> RobotDescription:
        """Return what this robot is; nothing in it stops its wheels."""
        proximity, battery = self.proximity, self.battery
        bearings = [s.bearing_rad for s in proximity.sensors] if proximity is not None else ()
        return RobotDescription(
            model=self.model,
            uid=uid,
            track_m=self.track_m,
            radius_m=self.radius_m,
            max_speed_m_s=self.max_speed_m_s,
            proximity_bearings_rad=tuple(bearings),
            proximity_range_m=max(proximity.metres) if proximity is not None else 0.3,
            battery_empty_v=battery.empty_v if battery is not None else 0.0,
            battery_full_v=battery.full_v if battery is not None else 0.0,
            watchdog="none",
            period_s=period_s,
        )


def shipped_boards() -> list[str]:
    """Return the names of the boards of this package."""
    return sorted(_shipped())


def load_board(name: str) -> Board:
    """Return a board of this package, or that of a file whose name ends in `.toml`; raises DeviceError."""
    try:
        if name.endswith(_SUFFIX):
            data = Path(name).read_bytes()
        else:
            data = (
                resources.files(__package__)
                .joinpath(f"boards/{_known(name)}{_SUFFIX}")
                .read_bytes()
            )
        return msgspec.toml.decode(data, type=Board)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise DeviceError(f"{name}: {error}") from None
    except OSError as error:
        raise DeviceError(f"{name}: {error.strerror}") from None


def _known(name: str) -> str:
    names = shipped_boards()
    if name in names:
        return name
    raise DeviceError(
        f"no board is called {name}{did_you_mean(name, names)};"
        f" there are {', '.join(names)}, and files whose names end in {_SUFFIX}"
    )


def _shipped() -> Iterator[str]:
    for file in resources.files(__package__).joinpath("boards").iterdir():
        if file.name.endswith(_SUFFIX):
            yield file.name.removesuffix(_SUFFIX)
