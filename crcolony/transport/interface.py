"""The interface between a colony and what carries its bytes: Zenoh, or the simulated network of the fault simulation.

Outbound bytes are calls of a `Transport`; inbound ones are `InboundEvent`s, passed to one function that must only
enqueue them. Nothing here decodes the bytes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import msgspec

from crcolony.body.shared_pages import Page, Pages, no_pages
from crcolony.compiled import FloatArray
from crcolony.errors import CrcolonyError
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.identity import RobotId
from crcolony.protocol.link_keys import LinkKeys


class NetworkError(CrcolonyError):
    """The network cannot be used: the message names the endpoint and the reason."""


class NetworkUnavailableError(NetworkError):
    """The network cannot be used now, and may be later: an interface, a name or a router is not there yet."""


@dataclass(frozen=True)
class EnvelopeReceived:
    """A signed envelope for a robot of this process."""

    to: RobotId
    envelope: bytes


@dataclass(frozen=True)
class RobotOnline:
    """A robot's liveliness token has appeared; `session` is the transport's name of the robot's process."""

    robot: RobotId
    incarnation: int
    session: str


@dataclass(frozen=True)
class RobotOffline:
    """A robot's liveliness token, of one incarnation and session, has gone."""

    robot: RobotId
    incarnation: int
    session: str


@dataclass(frozen=True)
class IncompatiblePeer:
    """A robot of this colony has a token of another version of the protocol; it may have one of this version, too."""

    robot: RobotId
    version: int


@dataclass(frozen=True)
class ArenaOnline:
    """The arena's liveliness token has appeared."""

    arena_run: int


@dataclass(frozen=True)
class ArenaOffline:
    """The arena's liveliness token has gone."""

    arena_run: int


@dataclass(frozen=True)
class JoinReplyReceived:
    """The arena's reply to a robot's request for a body."""

    robot: RobotId
    reply: bytes


@dataclass(frozen=True)
class ArenaMetadataReceived:
    """The arena's reply to a request for its metadata."""

    metadata: bytes


@dataclass(frozen=True)
class ObservationReceived:
    """An observation of a robot's body."""

    robot: RobotId
    observation: bytes


@dataclass(frozen=True)
class SceneReceived:
    """A scene of the arena, while a robot of this process subscribes to it."""

    scene: bytes


@dataclass(frozen=True)
class ActionReceived:
    """An action of a robot, for the arena."""

    robot: RobotId
    action: bytes


class LocalObservation(msgspec.Struct, frozen=True, gc=False):
    """The latest observation of a robot's body on the same machine; it may be one that was received before."""

    tick: int
    row: FloatArray
    """(OBSERVATION_WIDTH,), not checked"""
    contact: Contact | None


@dataclass(frozen=True)
class QueryReceived:
    """A query that is answered, at most once, by calling `reply`."""

    topic: Literal["join", "history", "metadata"]
    robot: RobotId
    """The robot that is queried, or asks for a body; empty: the arena is queried"""
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
    | ArenaMetadataReceived
    | ObservationReceived
    | SceneReceived
    | ActionReceived
    | LocalObservation
    | QueryReceived
)
Deliver = Callable[[InboundEvent], None]
TelemetryTopic = Literal["state", "event", "activity"]
"""What a robot publishes for observers."""


class Transport(Protocol):
    """Carries a robot's bytes. No call blocks, and everything that is sent may be lost."""

    def send_envelope(self, to: RobotId, envelope: bytes) -> None:
        """Send an envelope to another robot of the colony."""
        ...

    def request_body(self, robot: RobotId, request: bytes) -> None:
        """Send the arena a request to join or leave; the reply arrives as `JoinReplyReceived`."""
        ...

    def request_arena_metadata(self) -> None:
        """Request the arena's settings; the reply arrives as `ArenaMetadataReceived`."""
        ...

    def publish_action(self, robot: RobotId, action: bytes) -> None:
        """Publish an action of a robot of this process."""
        ...

    def publish_telemetry(self, robot: RobotId, topic: TelemetryTopic, data: bytes) -> None:
        """Publish telemetry of a robot of this process."""
        ...

    def subscribe_scene(self, is_needed: bool) -> None:
        """Deliver the arena's scenes as `SceneReceived` while they are needed."""
        ...


class LinkOnThisMachine(Protocol):
    """Carries the rows of a robot and its body when both are on one machine; nothing on it is lost or delayed."""

    @property
    def is_open(self) -> bool:
        """Whether it carries rows now; if not, they go over the network."""
        ...

    def open(self, robot: RobotId, arena_run: int, keys: LinkKeys) -> None:
        """Begin to open it, unless it is open to this run of an arena; nothing happens if that is on another machine.

        Observations arrive as `LocalObservation` then.
        """
        ...

    @property
    def page(self) -> Page | None:
        """The memory that robot and body share; None unless it is open."""
        ...

    def ring(self) -> None:
        """Tell the body's process that there is an action in the memory."""
        ...

    def publish_action(self, tick: int, row: FloatArray) -> None:
        """Send the action (ACTION_WIDTH,) that answers the observation of a tick."""
        ...


class NoLinkOnThisMachine:
    """All rows go over the network."""

    is_open = False
    page: Page | None = None

    def open(self, robot: RobotId, arena_run: int, keys: LinkKeys) -> None:
        """See `LinkOnThisMachine`."""

    def ring(self) -> None:
        """See `LinkOnThisMachine`."""

    def publish_action(self, tick: int, row: FloatArray) -> None:
        """See `LinkOnThisMachine`."""


class RobotsOnThisMachine(Protocol):
    """Carries the rows of robots on the same machine as their bodies."""

    @property
    def pages(self) -> Pages:
        """The memory with their rows."""
        ...

    def __contains__(self, robot: RobotId) -> bool:
        """Return whether it carries the rows of this robot."""
        ...

    def __len__(self) -> int: ...

    def publish_observation(
        self, robot: RobotId, tick: int, row: FloatArray, contact: Contact | None
    ) -> None:
        """Give one of these robots the observation (OBSERVATION_WIDTH,) of a tick."""
        ...

    def ring_all(self) -> None:
        """Tell all of them that the observations of a tick are in the memory."""
        ...

    def remove(self, robot: RobotId) -> None:
        """End the link to a robot, if there is one."""
        ...

    def close(self) -> None:
        """End all links; robots go on over the network."""
        ...


class NoRobotsOnThisMachine:
    """All rows go over the network."""

    def __init__(self) -> None:
        self.pages = no_pages()

    def __contains__(self, robot: RobotId) -> bool:
        return False

    def __len__(self) -> int:
        return 0

    def publish_observation(
        self, robot: RobotId, tick: int, row: FloatArray, contact: Contact | None
    ) -> None:
        """See `RobotsOnThisMachine`."""

    def ring_all(self) -> None:
        """See `RobotsOnThisMachine`."""

    def remove(self, robot: RobotId) -> None:
        """See `RobotsOnThisMachine`."""

    def close(self) -> None:
        """See `RobotsOnThisMachine`."""
