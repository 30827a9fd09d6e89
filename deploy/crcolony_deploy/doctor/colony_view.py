"""What this host receives of its colony within some seconds: robots and arenas that are online, and their clocks."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from crcolony.protocol.key_expressions import ColonyKeys, parse_incompatible_peer
from crcolony.telemetry.robot_status import ArenaStatus, RobotStatus
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.brief_session import brief_session
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import has_links
from crcolony.transport.zenoh_tokens import tokens_online

_POLL_S = 0.1


@dataclass(frozen=True)
class ColonyView:
    """What was received; `problem` says why nothing could be."""

    robots: tuple[RobotStatus, ...] = ()
    """That are online, of all colonies"""
    arenas: tuple[ArenaStatus, ...] = ()
    is_linked: bool = False
    """Whether any other process was reached"""
    problem: str = ""
    other_versions: dict[bytes, int] = field(default_factory=dict)
    """Robots that speak another version of the protocol, and which"""
    clock_offsets_s: dict[bytes, float] = field(default_factory=dict)
    """How far the clock of each robot's host is ahead of this one"""


def view_colony(
    network: NetworkSettings, seconds: float, is_enough: Callable[[list[RobotStatus]], bool]
) -> ColonyView:
    """Return what is received within some seconds; it ends earlier when the robots that are online are enough."""
    try:
        with brief_session(network) as session:
            subscriber = TelemetrySubscriber(session)
            offsets_s: dict[bytes, float] = {}
            end_s = time.monotonic() + seconds
            pause = threading.Event()
            robots: list[RobotStatus] = []
            while time.monotonic() < end_s and not (robots and is_enough(robots)):
                pause.wait(_POLL_S)
                subscriber.poll()
                robots = [status for status in subscriber.monitor.alive if status.state]
                for status in robots:
                    if status.state is not None:
                        offset_s = status.state.unix_ms / 1000.0 - status.updated_s
                        # A message is late and never early: the largest offset is the nearest.
                        offsets_s[status.robot] = max(
                            offset_s, offsets_s.get(status.robot, offset_s)
                        )
            others = map(
                parse_incompatible_peer, tokens_online(session, ColonyKeys("*").all_versions)
            )
            return ColonyView(
                robots=tuple(subscriber.monitor.alive),
                arenas=tuple(subscriber.monitor.arenas.values()),
                is_linked=has_links(session),
                other_versions=dict(other for other in others if other is not None),
                clock_offsets_s=offsets_s,
            )
    except NetworkError as error:
        return ColonyView(problem=str(error))
