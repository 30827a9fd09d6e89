"""How rmw_zenoh names things on Zenoh: keys of topics, liveliness tokens, and the attachment of each message.

This is what it does in ROS 2 Jazzy, and what is there in Kilted is the same for these messages. In Humble there are no
hashes of types, and the first versions for Jazzy (2024) had an attachment with names in it: neither is implemented.
"""

import struct
from dataclasses import dataclass
from typing import Literal

TOKENS = "@ros2_lv"
"""What all liveliness tokens begin with."""
DEFAULT_QOS = "::,10:,:,:,,"
"""Reliable, volatile, the last ten are kept: every setting but the depth is rmw_zenoh's default."""
GID_BYTES = 16
_ENCLAVE = "%"
_ATTACHMENT = struct.Struct(f"<qqB{GID_BYTES}s")


@dataclass(frozen=True)
class RosType:
    """A type of messages. `hash` is the digest of its definition (REP 2016)."""

    package: str
    name: str
    hash: str

    @property
    def key(self) -> str:
        """The type as keys have it."""
        return f"{self.package}::msg::dds_::{self.name}_"


TWIST = RosType(
    "geometry_msgs",
    "Twist",
    "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
)
TWIST_STAMPED = RosType(
    "geometry_msgs",
    "TwistStamped",
    "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
)
ODOMETRY = RosType(
    "nav_msgs",
    "Odometry",
    "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
)
BATTERY_STATE = RosType(
    "sensor_msgs",
    "BatteryState",
    "RIHS01_4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
)
LASER_SCAN = RosType(
    "sensor_msgs",
    "LaserScan",
    "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
)
RANGE = RosType(
    "sensor_msgs",
    "Range",
    "RIHS01_b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a",
)

EndpointKind = Literal["MP", "MS"]
"""A publisher or a subscriber of messages."""


@dataclass(frozen=True)
class Node:
    """A node of ours, the only one of its Zenoh session. `namespace` begins with a slash, or is empty."""

    domain: int
    session: str
    name: str
    namespace: str = ""

    @property
    def token(self) -> str:
        """The liveliness token that says that it is there."""
        return f"{self._ids(0)}/NN/{self._names}"

    def endpoint_token(self, number: int, kind: EndpointKind, topic: str, ros_type: RosType) -> str:
        """Return the liveliness token of a publisher or subscriber; `number` is its own in this session."""
        return (
            f"{self._ids(number)}/{kind}/{self._names}"
            f"/{_mangle(topic)}/{ros_type.key}/{ros_type.hash}/{DEFAULT_QOS}"
        )

    def _ids(self, number: int) -> str:
        return f"{TOKENS}/{self.domain}/{self.session}/0/{number}"

    @property
    def _names(self) -> str:
        return f"{_ENCLAVE}/{_mangle(self.namespace or '/')}/{self.name}"


@dataclass(frozen=True)
class Endpoint:
    """A publisher or subscriber that a token tells of."""

    kind: EndpointKind
    topic: str
    type_key: str
    type_hash: str

    def has_type(self, ros_type: RosType) -> bool:
        """Return whether its messages have this type, whatever its definition."""
        return self.type_key == ros_type.key


def parse_token(token: str) -> Endpoint | None:
    """Return what a liveliness token tells of; None for nodes, services, and what is no token of rmw_zenoh."""
    parts = token.split("/")
    if len(parts) != 13 or parts[0] != TOKENS or parts[5] not in ("MP", "MS"):
        return None
    kind: EndpointKind = "MP" if parts[5] == "MP" else "MS"
    return Endpoint(kind, parts[9].replace("%", "/"), parts[10], parts[11])


def all_tokens(domain: int) -> str:
    """Return the key expression of all tokens of a domain."""
    return f"{TOKENS}/{domain}/**"


def topic_key(domain: int, topic: str, ros_type: RosType) -> str:
    """Return the key on which messages of a topic are put; the topic begins with a slash."""
    return f"{domain}/{topic.strip('/')}/{ros_type.key}/{ros_type.hash}"


def attachment(sequence: int, time_ns: int, gid: bytes) -> bytes:
    """Return what a message carries beside it: its number, when it was sent, and who has sent it."""
    return _ATTACHMENT.pack(sequence, time_ns, GID_BYTES, gid)


def _mangle(name: str) -> str:
    return name.replace("/", "%")
