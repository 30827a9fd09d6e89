"""CDR is that of ROS 2: byte for byte what the independent package `rosbags` makes of the same messages."""

import math
from contextlib import suppress
from dataclasses import is_dataclass
from typing import Any, get_type_hints

import numpy as np
import pytest
from crcolony_bridge.ros2 import messages
from crcolony_bridge.ros2.cdr import CdrError, Numbers, decode, encode
from hypothesis import given
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES: dict[str, type] = {
    "geometry_msgs/msg/Twist": messages.Twist,
    "geometry_msgs/msg/TwistStamped": messages.TwistStamped,
    "nav_msgs/msg/Odometry": messages.Odometry,
    "sensor_msgs/msg/BatteryState": messages.BatteryState,
    "sensor_msgs/msg/LaserScan": messages.LaserScan,
    "sensor_msgs/msg/Range": messages.Range,
}
NUMBERS: dict[str, st.SearchStrategy[Any]] = {
    "?": st.booleans(),
    "B": st.integers(0, 2**8 - 1),
    "i": st.integers(-(2**31), 2**31 - 1),
    "I": st.integers(0, 2**32 - 1),
    "f": st.just(math.nan) | st.floats(width=32, allow_nan=False),
    "d": st.just(math.nan) | st.floats(allow_nan=False),
}
TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)


def messages_of(message_class: type) -> st.SearchStrategy[Any]:
    """Return a strategy for messages with any values in all fields."""
    hints = get_type_hints(message_class, include_extras=True)
    return st.builds(message_class, **{name: values_of(hint) for name, hint in hints.items()})


def values_of(hint: Any) -> st.SearchStrategy[Any]:
    if isinstance(hint, type) and is_dataclass(hint):
        return messages_of(hint)
    if hint is str:
        return TEXTS
    number_format = hint.__metadata__[0]
    if not isinstance(number_format, Numbers):
        return NUMBERS[number_format]
    count, numbers = number_format.count, NUMBERS[number_format.format]
    if count is None:
        return st.lists(numbers, max_size=5).map(tuple)
    return st.tuples(*3 * [numbers]).map(lambda few: few * (count // 3))


def in_rosbags(name: str, message: Any) -> Any:
    """Return the same message as `rosbags` has it, by its own definition of the type."""
    values = {}
    for field, (node, detail) in STORE.fielddefs[name][1]:
        value = getattr(message, field)
        if node is Nodetype.NAME:
            value = in_rosbags(str(detail), value)
        elif node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            value = np.array(value, detail[0][1][0])
        values[field] = value
    return STORE.types[name](**values)


ANY_MESSAGE = st.sampled_from(sorted(TYPES)).flatmap(
    lambda name: st.tuples(st.just(name), messages_of(TYPES[name]))
)


@given(ANY_MESSAGE)
def test_messages_are_encoded_as_ros_encodes_them(named: tuple[str, Any]) -> None:
    """Every type that we know, with any values."""
    name, message = named
    assert encode(message) == bytes(STORE.serialize_cdr(in_rosbags(name, message), name))


@given(ANY_MESSAGE)
def test_what_ros_encodes_is_decoded(named: tuple[str, Any]) -> None:
    """To the same values: encoded again it is the same."""
    name, message = named
    data = bytes(STORE.serialize_cdr(in_rosbags(name, message), name))
    decoded: Any = decode(TYPES[name], data)
    assert repr(decoded) == repr(message)  # NaN is not equal to itself
    assert encode(decoded) == data


@given(ANY_MESSAGE, st.data())
def test_damaged_bytes_raise_one_error(named: tuple[str, Any], data: st.DataObject) -> None:
    """A message with bytes changed, cut off or added is another message, or CdrError, and nothing else."""
    name, message = named
    damaged = bytearray(encode(message))
    for _ in range(data.draw(st.integers(0, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    end = data.draw(st.integers(0, len(damaged)))
    tail = data.draw(st.binary(max_size=9))
    decode_or_refuse(TYPES[name], bytes(damaged[:end]) + tail)


@given(st.sampled_from(list(TYPES.values())), st.binary(max_size=500))
def test_random_bytes_raise_one_error(message_class: type, data: bytes) -> None:
    """With a right header or without."""
    decode_or_refuse(message_class, data)
    decode_or_refuse(message_class, bytes((0, 1, 0, 0)) + data)


def decode_or_refuse(message_class: type, data: bytes) -> None:
    with suppress(CdrError):
        decode(message_class, data)


def test_every_message_that_is_cut_short_is_refused() -> None:
    """Wherever it is cut."""
    data = encode(messages.LaserScan(ranges=(1.0, 2.0), intensities=(3.0,)))
    for size in range(len(data)):
        with pytest.raises(CdrError):
            decode(messages.LaserScan, data[:size])


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "not plain CDR"),
        (b"\0\0\0\0" + bytes(48), "not plain CDR, little-endian"),
        (b"\0\1\0\0" + bytes(56), "8 bytes too many"),
        (b"\0\1\0\0" + bytes(47), "cut short"),
    ],
)
def test_what_is_wrong_is_said(data: bytes, reason: str) -> None:
    """Big-endian bytes and other lengths are not taken for a Twist; a little padding is."""
    with pytest.raises(CdrError, match=reason):
        decode(messages.Twist, data)
    assert decode(messages.Twist, b"\0\1\0\0" + bytes(51)) == messages.Twist()


def test_a_length_that_is_a_lie_allocates_nothing() -> None:
    """Four thousand million distances in a message of a hundred bytes."""
    scan = bytearray(encode(messages.LaserScan()))
    scan[-8:-4] = b"\xff\xff\xff\xff"
    with pytest.raises(CdrError, match="cut short"):
        decode(messages.LaserScan, bytes(scan))


@pytest.mark.parametrize(
    ("frame", "reason"), [(b"\2\0\0\0ab", "without an end"), (b"\2\0\0\0\xff\0", "not UTF-8")]
)
def test_strings_end_and_are_text(frame: bytes, reason: str) -> None:
    """A frame's name that is neither is refused."""
    with pytest.raises(CdrError, match=reason):
        decode(messages.TwistStamped, b"\0\1\0\0" + bytes(8) + frame + bytes(50))
