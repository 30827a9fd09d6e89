"""What a robot's node is given: who the robot is, how it is to run, and what it uses of its process."""

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from crcolony.config import Config
from crcolony.nodes.event_buffer import MAX_BYTES
from crcolony.protocol.identity import ArenaId, Identity
from crcolony.protocol.telemetry_messages import RobotEvent
from crcolony.storage.store import RobotStore
from crcolony.transport.interface import LinkOnThisMachine, NoLinkOnThisMachine, Transport

STATE_PERIOD_S = 0.5
"""How often a robot publishes its state."""


class UnixClock(Protocol):
    """Returns the time of day, in seconds since 1970."""

    def __call__(self) -> float: ...


@dataclass(frozen=True)
class ColonyMember:
    """A robot as its colony knows it: its key, the colony's name, its number, and the ordinal of this start."""

    identity: Identity
    colony: str
    number: int
    incarnation: int


def _ignore_event(_: RobotEvent) -> None:
    """Do nothing with an event."""


@dataclass(frozen=True)
class NodeResources:
    """What a robot uses of its process. `on_event` receives every event that the robot publishes."""

    store: RobotStore
    transport: Transport
    unix_s: UnixClock
    on_event: Callable[[RobotEvent], None] = _ignore_event
    history_bytes: int = MAX_BYTES
    """Of the recent events that it keeps for observers"""


class KnownArenas(Protocol):
    """The arenas in which a robot lives, by name."""

    def accepts(self, name: str, arena: ArenaId) -> bool:
        """Return whether a robot may live in an arena of this name; the first one is remembered."""
        ...


class FirstArenas:
    """Accepts the first arena of each name, for as long as the process runs."""

    def __init__(self) -> None:
        self._known: dict[str, ArenaId] = {}

    def accepts(self, name: str, arena: ArenaId) -> bool:
        """See `KnownArenas`."""
        return self._known.setdefault(name, arena) == arena


@dataclass(frozen=True)
class EmbodimentOptions:
    """Where a robot requests its body, and how often it saves and publishes its state."""

    config: Config
    arena: str
    wanted_slot: int = -1
    """The slot of the arena that it requests; -1: any"""
    known_arenas: KnownArenas = field(default_factory=FirstArenas)
    draw: Callable[[int], bytes] = secrets.token_bytes
    """Draws random bytes for keys"""
    snapshot_s: float = 10.0
    state_period_s: float = STATE_PERIOD_S


def _ignore_line(_: str) -> None:
    """Do nothing with a line."""


@dataclass(frozen=True)
class ProcessCallbacks:
    """What a robot calls in its process."""

    reconnect: Callable[[], None]
    """Closes the network session and opens another"""
    print_line: Callable[[str], None] = _ignore_line
    count_dropped: Callable[[], int] = lambda: 0
    """Returns how many inbound events were discarded"""
    print_warning: Callable[[str], None] = _ignore_line
    """Receives faults of the outside"""
    local_link: LinkOnThisMachine = field(default_factory=NoLinkOnThisMachine)
    """Carries rows when the body is on this machine"""
