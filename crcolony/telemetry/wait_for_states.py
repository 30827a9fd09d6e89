"""Waits until the state of every robot is known, for commands that print it once."""

import threading
import time
from collections.abc import Callable, Iterable

from crcolony.telemetry.status_changes import StatusChange
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.connection_check import reasons_unreachable
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import Session, has_links

_POLL_S = 0.05
"""Between two polls."""
_DISCOVERY_S = 0.7
"""So long it waits for further robots, at least."""


def wait_for_states(
    session: Session,
    subscriber: TelemetrySubscriber,
    network: NetworkSettings,
    seconds: float,
    handle_changes: Callable[[Iterable[StatusChange]], None] = lambda changes: None,
) -> list[str]:
    """Wait for some seconds at most; return what is wrong with the network, where robots are known all the same.

    Raises NetworkError where nobody answers.
    """
    end_s = time.monotonic() + seconds
    settled_s = time.monotonic() + min(seconds, _DISCOVERY_S)
    pause = threading.Event()
    while time.monotonic() < end_s:
        pause.wait(_POLL_S)
        handle_changes(subscriber.poll())
        robots = subscriber.monitor.alive
        is_complete = bool(robots) and all(status.state for status in robots)
        if is_complete and time.monotonic() > settled_s:
            break
    handle_changes(subscriber.poll())
    problems = [] if has_links(session) else reasons_unreachable(network.connect)
    if problems and not subscriber.monitor.robots and not subscriber.monitor.arenas:
        raise NetworkError("; ".join(problems))
    return problems
