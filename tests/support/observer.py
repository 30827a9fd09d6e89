"""A process that prints what it receives of a colony, a line of JSON each, for a test.

Times are of CLOCK_MONOTONIC, which all processes of a machine share, whatever network namespace they are in.
"""

import argparse
import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import msgspec
import zenoh

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import WireError
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import open_telemetry
from crcolony.protocol.telemetry_messages import (
    EventMessage,
    RobotState,
    decode_event,
    decode_state,
)
from crcolony.transport.connection import Connection
from crcolony.transport.liveliness_follower import LivelinessFollower
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_samples import callback, leaving
from crcolony.transport.zenoh_session import open_session


class Token(msgspec.Struct, tag=True):
    """The liveliness token of a robot, or of an arena (its `robot` is empty), has appeared or gone."""

    at_s: float
    robot: str
    incarnation: int
    session: str
    is_online: bool


class StateReceived(msgspec.Struct, tag=True):
    """A state of a robot."""

    at_s: float
    state: RobotState


class EventReceived(msgspec.Struct, tag=True):
    """An event of a robot."""

    at_s: float
    message: EventMessage


Line = Token | StateReceived | EventReceived


class Observer:
    """Subscribes to the tokens, states and events of all colonies, and enqueues them."""

    def __init__(self, session: zenoh.Session) -> None:
        self.lines: SimpleQueue[Line] = SimpleQueue()
        self._followers = [
            LivelinessFollower(session, key, self._on_token)
            for key in (ColonyKeys("*").all_alive, key_expressions.ALL_ARENAS_ALIVE)
        ]
        self._declare(session)

    def _declare(self, session: zenoh.Session) -> None:
        live, of = session.liveliness(), ColonyKeys("*")
        self._declared: list[Any] = [
            live.declare_token(key_expressions.observer(str(session.zid()))),
            session.declare_subscriber(of.all_states, callback(self._on_state)),
            session.declare_subscriber(of.all_events, callback(self._on_event)),
        ]

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Subscribe in another session."""
        former = self._declared
        self._declare(session)
        return leaving(former, *(follower.move_to(session) for follower in self._followers))

    def _on_token(self, key: str, is_online: bool) -> None:
        robot = key_expressions.parse_robot_token(key)
        arena = key_expressions.parse_arena_token(key)
        now_s = time.monotonic()
        if robot is not None:
            name = robot.robot.hex()
            self.lines.put(Token(now_s, name, robot.incarnation, robot.session, is_online))
        elif arena is not None:
            self.lines.put(Token(now_s, "", 0, arena.session, is_online))

    def _on_state(self, sample: zenoh.Sample) -> None:
        with contextlib.suppress(WireError):
            state = decode_state(open_telemetry(sample.payload.to_bytes()).content)
            self.lines.put(StateReceived(time.monotonic(), state))

    def _on_event(self, sample: zenoh.Sample) -> None:
        event = decode_event(open_telemetry(sample.payload.to_bytes()).content)
        self.lines.put(EventReceived(time.monotonic(), event))


def main() -> None:
    """Print until killed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--interface", default="")
    parser.add_argument("--credentials", type=Path)
    options = parser.parse_args()
    network = NetworkSettings(
        connect=tuple(options.connect),
        interface=options.interface,
        credentials=options.credentials,
    )
    with Connection(network, open_session(network), lambda line: None) as connection:
        observer = Observer(connection.session)
        connection.add_user(observer)
        while True:
            with contextlib.suppress(Empty):
                print(msgspec.json.encode(observer.lines.get(timeout=0.2)).decode(), flush=True)
            connection.handle_timers(time.monotonic())


if __name__ == "__main__":
    main()
