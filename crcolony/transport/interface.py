"""The seam between a colony and whatever carries its bytes: Zenoh, or the lossy network of `simulation/`.

What goes out are calls of a `Transport`; what comes in are `Arrival`s, handed to one function that must only enqueue
them. Nothing here knows what the bytes mean.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from crcolony.errors import Refusal
from crcolony.protocol.identity import RobotId


class NetworkError(Refusal):
    """The network cannot be used: the message names the endpoint and the reason."""


@dataclass(frozen=True)
class Mail:
    """A letter for a robot here."""

    to: RobotId
    letter: bytes


@dataclass(frozen=True)
class RobotSeen:
    """A robot is on the network. `life` is its incarnation, `session` the transport's name for its process."""

    robot: RobotId
    life: int
    session: str


@dataclass(frozen=True)
class RobotGone:
    """A robot, in one life, is on the network no more."""

    robot: RobotId
    life: int
    session: str


@dataclass(frozen=True)
class StrangerSeen:
    """A robot of this colony speaks another version of the protocol (it may speak this one, too)."""

    robot: RobotId
    version: int


@dataclass(frozen=True)
class ArenaSeen:
    """The arena is on the network."""

    world: int


@dataclass(frozen=True)
class ArenaGone:
    """The arena is not on the network any more."""

    world: int


@dataclass(frozen=True)
class Placed:
    """The arena's answer to a robot that asked for a body; empty if it said nothing."""

    robot: RobotId
    answer: bytes


@dataclass(frozen=True)
class Observed:
    """What a robot's body senses."""

    robot: RobotId
    observation: bytes


@dataclass(frozen=True)
class Shown:
    """What the arena shows to everybody, while somebody here is being looked for."""

    scene: bytes


@dataclass(frozen=True)
class Acted:
    """What a robot commands its body (for an arena)."""

    robot: RobotId
    action: bytes


@dataclass(frozen=True)
class Asked:
    """A question that must be answered once, by calling `answer`."""

    about: Literal["join", "past", "about"]
    robot: RobotId
    """Who is asked; empty: the arena"""
    question: bytes
    answer: Callable[[bytes], None]


Arrival = (
    Mail
    | RobotSeen
    | RobotGone
    | StrangerSeen
    | ArenaSeen
    | ArenaGone
    | Placed
    | Observed
    | Shown
    | Acted
    | Asked
)
Deliver = Callable[[Arrival], None]


class Transport(Protocol):
    """Carries a robot's bytes. No call waits for the other side; whatever is sent may be lost."""

    def send(self, to: RobotId, letter: bytes) -> None:
        """Post a letter to another robot of the colony."""
        ...

    def join(self, robot: RobotId, request: bytes) -> None:
        """Ask the arena for a body; the answer arrives as `Placed`."""
        ...

    def act(self, robot: RobotId, action: bytes) -> None:
        """Command the body of a robot here."""
        ...

    def tell(self, robot: RobotId, topic: Literal["state", "event"], data: bytes) -> None:
        """Publish telemetry of a robot here."""
        ...

    def search(self, is_searching: bool) -> None:
        """Let what the arena shows to everybody arrive as `Shown`, or not."""
        ...
