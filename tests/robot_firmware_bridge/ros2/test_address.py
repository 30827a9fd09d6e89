"""A robot's address says where it is and what its base is like; what is none is refused with one line."""

from contextlib import suppress
from math import pi

import pytest
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.ros2.address import CREATE3, Base, RangeSensor, Ros2Address, parse_address
from hypothesis import given
from hypothesis import strategies as st

ROUTER = "tcp/10.0.0.5:7447"


def test_a_router_and_a_namespace_are_enough() -> None:
    """Or the router alone; the base is a Create 3 then."""
    robot = parse_address(f"{ROUTER}/robot1")
    assert robot == Ros2Address(ROUTER, "/robot1", 0, CREATE3)
    assert robot.topic("cmd_vel") == "/robot1/cmd_vel"
    assert robot.uid == "robot1"
    assert parse_address(f"{ROUTER}/lab/robot1").topic("odom") == "/lab/robot1/odom"
    alone = parse_address("tcp/[fe80::1]:7447")
    assert alone.topic("odom") == "/odom"
    assert alone.uid == "[fe80::1]:7447"


def test_options_say_what_the_base_is_like() -> None:
    """A model by its name, or measures; sensors by their topics."""
    robot = parse_address(f"{ROUTER}/robot1?model=turtlebot4&domain=7")
    assert robot.domain == 7
    assert robot.base == Base("TurtleBot 4", 0.233, 0.17, 0.306, 0.5, pi / 2)
    other = parse_address(
        f"{ROUTER}/r?track_m=0.16&radius_m=0.1&max_speed_m_s=0.22&watchdog_s=0&scan_yaw_deg=-90"
        "&ranges=range/left:45,front:0"
    )
    assert other.base == Base(CREATE3.model, 0.16, 0.1, 0.22, 0.0, -pi / 2)
    assert other.ranges == (RangeSensor("/r/range/left", pi / 4), RangeSensor("/r/front", 0.0))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "expected ENDPOINT"),
        ("/dev/ttyACM0", "expected ENDPOINT"),
        ("tcp:127.0.0.1:7447", "expected ENDPOINT"),
        ("tcp/10.0.0.5", "tcp/10.0.0.5: not an endpoint"),
        ("tcp/10.0.0.5:0/robot1", "its port is 0"),
        (f"{ROUTER}/", " is no namespace of ROS 2"),
        (f"{ROUTER}/1robot", "1robot is no namespace of ROS 2"),
        (f"{ROUTER}/robot*", "is no namespace of ROS 2"),
        (f"{ROUTER}?speed=3", "no option is called speed"),
        (f"{ROUTER}?max_speed=3", "did you mean max_speed_m_s"),
        (f"{ROUTER}?model=thymio", "model=thymio: known are create3, turtlebot4"),
        (f"{ROUTER}?domain=233", "from 0 to 232"),
        (f"{ROUTER}?domain=-1", "from 0 to 232"),
        (f"{ROUTER}?track_m=wide", "track_m=wide: expected 0.01 to 2 m"),
        (f"{ROUTER}?max_speed_m_s=nan", "expected 0.01 to 1.3 m/s"),
        (f"{ROUTER}?watchdog_s=5", "expected 0 to 1 s"),
        (f"{ROUTER}?ranges=left", "expected TOPIC:DEGREES"),
        (f"{ROUTER}?ranges=left:west", "degrees to the left of ahead"),
        (f"{ROUTER}?ranges=a//b:0", "expected TOPIC:DEGREES"),
    ],
)
def test_what_is_no_address_is_refused(text: str, reason: str) -> None:
    """The line says what is wrong and what is expected."""
    with pytest.raises(DeviceError) as refused:
        parse_address(text)
    assert reason in str(refused.value)
    assert "\n" not in str(refused.value)


@given(st.text(max_size=30), st.text("abc123=&:,/._?-", max_size=30))
def test_no_text_causes_another_error(place: str, options: str) -> None:
    """Whatever a person types."""
    for text in (place, f"{ROUTER}/{place}", f"{ROUTER}?{options}", f"{ROUTER}?ranges={options}"):
        with suppress(DeviceError):
            parse_address(text)
