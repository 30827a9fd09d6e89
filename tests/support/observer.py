"""A process that prints what it receives of a colony, a line of JSON each, for a test.

Times are of CLOCK_MONOTONIC, which all processes of a machine share, whatever network namespace they are in.
"""

import argparse
import contextlib
import time
from queue import SimpleQueue

import msgspec
import zenoh
from zenoh.handlers import Callback

from crcolony.protocol import key_expressions
from crcolony.protocol.codec import WireError
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.telemetry_messages import (
    EventMessage,
    RobotState,
    decode_event,
    decode_state,
)
from crcolony.transport.network_settings import NetworkSettings
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


def main() -> None:
    """Print until killed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--interface", default="")
    options = parser.parse_args()
    lines: SimpleQueue[Line] = SimpleQueue()

    def on_token(sample: zenoh.Sample) -> None:
        is_online, key = sample.kind == zenoh.SampleKind.PUT, str(sample.key_expr)
        robot, arena = (
            key_expressions.parse_robot_token(key),
            key_expressions.parse_arena_token(key),
        )
        if robot is not None:
            name = robot.robot.hex()
            lines.put(Token(time.monotonic(), name, robot.incarnation, robot.session, is_online))
        elif arena is not None:
            lines.put(Token(time.monotonic(), "", 0, arena.session, is_online))

    def on_state(sample: zenoh.Sample) -> None:
        with contextlib.suppress(WireError):
            lines.put(StateReceived(time.monotonic(), decode_state(sample.payload.to_bytes())))

    def on_event(sample: zenoh.Sample) -> None:
        lines.put(EventReceived(time.monotonic(), decode_event(sample.payload.to_bytes())))

    network = NetworkSettings(connect=tuple(options.connect), interface=options.interface)
    of = ColonyKeys("*")
    with open_session(network) as session:
        live = session.liveliness()
        declared = [
            live.declare_token(key_expressions.observer(str(session.zid()))),
            session.declare_subscriber(of.all_states, Callback(on_state, indirect=False)),
            session.declare_subscriber(of.all_events, Callback(on_event, indirect=False)),
            *(
                live.declare_subscriber(key, Callback(on_token, indirect=False), history=True)
                for key in (of.all_alive, key_expressions.ALL_ARENAS_ALIVE)
            ),
        ]
        while declared:
            print(msgspec.json.encode(lines.get()).decode(), flush=True)


if __name__ == "__main__":
    main()
