"""Keys, tokens and attachments are those of rmw_zenoh, and type hashes those that `rosbags` computes."""

import pytest
from crcolony_bridge.ros2 import keys
from crcolony_bridge.ros2.keys import Endpoint, Node, RosType, attachment, parse_token, topic_key
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

TYPES = [value for value in vars(keys).values() if isinstance(value, RosType)]
NODE = Node(3, "a1b2", "bridge", "/robot1")
TWIST = "geometry_msgs::msg::dds_::Twist_"
TWIST_HASH = "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"


@pytest.mark.parametrize("distro", [Stores.ROS2_JAZZY, Stores.ROS2_KILTED])
@pytest.mark.parametrize("ros_type", TYPES, ids=lambda ros_type: ros_type.name)
def test_hashes_are_those_of_the_definitions(ros_type: RosType, distro: Stores) -> None:
    """Of Jazzy, and of the distribution after it."""
    name = f"{ros_type.package}/msg/{ros_type.name}"
    assert ros_type.hash == get_typestore(distro).hash_rihs01(name)


def test_a_topic_is_a_key() -> None:
    """Domain, name, type and hash."""
    expected = f"0/robot1/cmd_vel/{TWIST}/{TWIST_HASH}"
    assert topic_key(0, "/robot1/cmd_vel", keys.TWIST) == expected


def test_tokens_say_who_publishes_and_subscribes() -> None:
    """A node, a subscriber and a publisher, in a namespace and without."""
    assert NODE.token == "@ros2_lv/3/a1b2/0/0/NN/%/%robot1/bridge"
    assert Node(0, "a1b2", "bridge").token == "@ros2_lv/0/a1b2/0/0/NN/%/%/bridge"
    rest = f"%robot1%cmd_vel/{TWIST}/{TWIST_HASH}/::,10:,:,:,,"
    for number, kind in ((1, "MS"), (2, "MP")):
        token = NODE.endpoint_token(
            number, "MS" if kind == "MS" else "MP", "/robot1/cmd_vel", keys.TWIST
        )
        assert token == f"@ros2_lv/3/a1b2/0/{number}/{kind}/%/%robot1/bridge/{rest}"


def test_a_token_is_understood() -> None:
    """That of an endpoint; nodes and services are passed over."""
    token = NODE.endpoint_token(7, "MS", "/robot1/cmd_vel", keys.TWIST)
    endpoint = parse_token(token)
    assert endpoint == Endpoint("MS", "/robot1/cmd_vel", TWIST, TWIST_HASH)
    assert endpoint.has_type(keys.TWIST)
    assert not endpoint.has_type(keys.TWIST_STAMPED)
    assert parse_token(NODE.token) is None
    assert parse_token(token.replace("/MS/", "/SS/")) is None


@given(st.text())
def test_what_is_no_token_is_passed_over(text: str) -> None:
    """Whatever it is."""
    assert parse_token(text) is None
    parse_token(f"{keys.TOKENS}/{text}")


def test_an_attachment_has_33_bytes() -> None:
    """Sequence number, time in nanoseconds, and the sender's id with its length before it."""
    expected = bytes.fromhex("0500000000000000000100000000000010") + bytes(range(16))
    assert attachment(5, 256, bytes(range(16))) == expected
