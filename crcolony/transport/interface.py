"""The seam between a colony and whatever carries its bytes: Zenoh, or the lossy network of `simulation/`.

What goes out are calls of a `Transport`; what comes in are `InboundEvent`s, handed to one function that must only enqueue
them. Nothing here knows what the bytes mean.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from crcolony.errors import CrcolonyError
from crcolony.protocol.identity import RobotId


class NetworkError(CrcolonyError):
    """The network cannot be used: the message names the endpoint and the reason."""


@dataclass(frozen=True)
class EnvelopeReceived:
    """A letter for a robot here."""

    to: RobotId
    envelope: bytes


@dataclass(frozen=True)
class RobotOnline:
    """A robot is on the network. `life` is its incarnation, `session` the transport's name for its process."""

    robot: RobotId
    incarnation: int
    session: str


@dataclass(frozen=True)
class RobotOffline:
    """A robot, in one life, is on the network no more."""

    robot: RobotId
    incarnation: int
    session: str


@dataclass(frozen=True)
class IncompatiblePeer:
    """A robot of this colony speaks another version of the protocol (it may speak this one, too)."""

    robot: RobotId
    version: int


@dataclass(frozen=True)
class ArenaOnline:
    """The arena is on the network."""

    arena_run: int


@dataclass(frozen=True)
class ArenaOffline:
    """The arena is not on the network any more."""

    arena_run: int


@dataclass(frozen=True)
class JoinReplyReceived:
    """The arena's answer to a robot that asked for a body; empty if it said nothing."""

    robot: RobotId
    reply: bytes


@dataclass(frozen=True)
class ObservationReceived:
    """What a robot's body senses."""

    robot: RobotId
    observation: bytes


@dataclass(frozen=True)
class SceneReceived:
    """What the arena shows to everybody, while somebody here is being looked for."""

    scene: bytes


@dataclass(frozen=True)
class ActionReceived:
    """What a robot commands its body (for an arena)."""

    robot: RobotId
    action: bytes


@dataclass(frozen=True)
class QueryReceived:
    """A question that must be answered once, by calling `answer`."""

    topic: Literal["join", "history", "metadata"]
    robot: RobotId
    """Who is asked; empty: the arena"""
    payload: bytes
    reply: Callable[[bytes], None]


InboundEvent = (
    EnvelopeReceived
    | RobotOnline
    | RobotOffline
    | IncompatiblePeer
    | ArenaOnline
    | ArenaOffline
    | JoinReplyReceived
    | ObservationReceived
    | SceneReceived
    | ActionReceived
    | QueryReceived
)
Deliver = Callable[[InboundEvent], None]


class Transport(Protocol):
    """Carries a robot's bytes. No call waits for the other side; whatever is sent may be lost."""

    def send_envelope(self, to: RobotId, envelope: bytes) -> None:
        """Post a letter to another robot of the colony."""
        ...

    def request_body(self, robot: RobotId, request: bytes) -> None:
        """Ask the arena for a body; the answer arrives as `JoinReplyReceived`."""
        ...

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        """Command the body of a robot here."""
        ...

    def publish_telemetry(
        self, robot: RobotId, topic: Literal["state", "event"], data: bytes
    ) -> None:
        """Publish telemetry of a robot here."""
        ...

    def subscribe_scene(self, is_searching: bool) -> None:
        """Let what the arena shows to everybody arrive as `SceneReceived`, or not."""
        ...
