"""Robots of the trial of Zenoh's advanced publishers: a process of them publishes events in one of two ways.

"ours" is the event buffer, numbered messages and history queries; "zenoh" is `zenoh.ext`.
"""

import contextlib
import itertools
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Literal, Protocol

import psutil
import zenoh
import zenoh.ext

from crcolony.nodes.event_buffer import EventBuffer
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import Identity, seeded
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.signed_telemetry import purpose_of_robot, sign_telemetry
from crcolony.protocol.telemetry_messages import (
    EventMessage,
    Fault,
    RobotMetadata,
    RobotState,
    decode_history_request,
)
from crcolony.rate_limit import TokenBucket
from crcolony.transport.close_session import close_session
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import QueryReceived
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_robots import RobotTransport
from crcolony.transport.zenoh_session import open_session

Kind = Literal["ours", "zenoh"]
COLONY = "trial"
KEYS = ColonyKeys(COLONY)
CONTROL_S, STATE_S = 1.0 / 30.0, 0.2
"""Periods of a robot's control loop and of its states"""
CACHE = 10_000
"""Events that a robot keeps"""
HEARTBEAT_S = 0.5
EVENT = Fault(1, "x" * 130)
"""An event that is about 200 bytes long when it is encoded"""


def robot_name(number: int) -> bytes:
    """Return the id of a robot of the trial."""
    return identity_of(number).id


def identity_of(number: int) -> Identity:
    """Return the key of a robot of the trial."""
    return seeded("trial", 1, number)


def make_state(robot: bytes, incarnation: int, seq: int) -> RobotState:
    """Return a state in which only the number of the last event matters."""
    return RobotState(
        robot, 0, "trial", incarnation, seq, int(1000 * time.time()), 1, 0, "x", 0.5, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0.0,
    )  # fmt: skip


class Robots(Protocol):
    """Robots of one process that publish events."""

    session: zenoh.Session

    def publish_event(self, robot: bytes) -> None:
        """Publish one event."""
        ...

    def publish_states(self) -> None:
        """Publish the state of every robot."""
        ...

    def handle_queries(self, timeout_s: float) -> None:
        """Answer what is asked within a time."""
        ...

    def reconnect(self, reopen: Callable[[], zenoh.Session]) -> None:
        """Leave the session for another one in the same incarnation."""
        ...


class OurRobots:
    """Robots with our event buffer, behind the transport and the inbox of a real robot process."""

    def __init__(self, session: zenoh.Session, robots: list[Identity], incarnation: int) -> None:
        self.session, self._incarnation = session, incarnation
        self._identities = {identity.id: identity for identity in robots}
        self._states = itertools.count(incarnation * 2**32 + 1)
        self._inbox = Inbox()
        self._transport = RobotTransport(session, COLONY, "trial", self._inbox.deliver)
        self._buffers = {robot: EventBuffer(robot, incarnation) for robot in self._identities}
        self._limits = {robot: TokenBucket(100.0) for robot in self._identities}
        for robot in self._identities:
            self._transport.add_robot(robot, incarnation)

    def publish_event(self, robot: bytes) -> None:
        """Number and keep an event, and publish it."""
        data = self._buffers[robot].append(EVENT, int(1000 * time.time()))
        self._transport.publish_telemetry(robot, "event", self._sign(robot, data))

    def publish_states(self) -> None:
        """Publish states, each with the number of the last event."""
        for robot, buffer in self._buffers.items():
            state = make_state(robot, self._incarnation, buffer.seq)
            signed = self._sign(robot, encode(state), next(self._states))
            self._transport.publish_telemetry(robot, "state", signed)

    def _sign(self, robot: bytes, message: bytes, count: int = 0) -> bytes:
        return sign_telemetry(message, purpose_of_robot(COLONY), self._identities[robot], count)

    def handle_queries(self, timeout_s: float) -> None:
        """Answer what is asked within a time, as a robot's loop does between two periods."""
        until_s = time.monotonic() + timeout_s
        while (left_s := until_s - time.monotonic()) > 0.0:
            event = self._inbox.get(left_s)
            if not isinstance(event, QueryReceived):
                continue
            if self._limits[event.robot].allow(time.time()):
                self._reply(event)

    def _reply(self, query: QueryReceived) -> None:
        if query.topic == "metadata":
            metadata = RobotMetadata(query.robot, self._incarnation, "{}", [], "")
            query.reply(self._sign(query.robot, encode(metadata)))
            return
        with contextlib.suppress(WireError):
            request = decode_history_request(query.payload)
            reply = encode(self._buffers[query.robot].reply_to(request))
            query.reply(self._sign(query.robot, reply))

    def reconnect(self, reopen: Callable[[], zenoh.Session]) -> None:
        """Move the transport to another session; the buffers stay."""
        self._transport.leave()
        close_session(self.session)
        self.session = reopen()
        self._transport.move_to(self.session)()


class ZenohRobots:
    """Robots whose events are published, numbered and kept by `zenoh.ext`; the payload is the same."""

    def __init__(self, session: zenoh.Session, robots: list[Identity], incarnation: int) -> None:
        self._incarnation = incarnation
        self._seqs = {identity.id: 0 for identity in robots}
        self._begin(session)

    def _begin(self, session: zenoh.Session) -> None:
        self.session = session
        self._states = {
            robot: session.declare_publisher(
                KEYS.state(robot), congestion_control=zenoh.CongestionControl.DROP, express=True
            )
            for robot in self._seqs
        }
        self._publishers = {
            robot: zenoh.ext.declare_advanced_publisher(
                session,
                KEYS.event(robot),
                congestion_control=zenoh.CongestionControl.DROP,
                express=True,
                cache=zenoh.ext.CacheConfig(CACHE),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=HEARTBEAT_S, sporadic_heartbeat=None
                ),
                publisher_detection=True,
            )
            for robot in self._seqs
        }

    def publish_event(self, robot: bytes) -> None:
        """Publish an event in the same message as ours, so that only the transport differs."""
        self._seqs[robot] += 1
        message = EventMessage(
            robot, self._incarnation, self._seqs[robot], int(1000 * time.time()), EVENT
        )
        self._publishers[robot].put(encode(message))

    def publish_states(self) -> None:
        """Publish states, which exist whoever numbers the events."""
        for robot, publisher in self._states.items():
            publisher.put(encode(make_state(robot, self._incarnation, self._seqs[robot])))

    def handle_queries(self, timeout_s: float) -> None:
        """Wait: Zenoh answers on its own threads."""
        time.sleep(timeout_s)

    def reconnect(self, reopen: Callable[[], zenoh.Session]) -> None:
        """Declare all publishers anew in another session: `zenoh.ext` cannot move a cache."""
        self.session.close()  # type: ignore[no-untyped-call]
        self._begin(reopen())


@dataclass
class RobotsReport:
    """What a process of robots measured since it was last asked."""

    at_s: float
    rss_mib: float
    cpu_s: float
    threads: int
    max_late_ms: float
    """Of the control loop"""
    max_put_ms: float
    published: int
    put_us: float
    """Median of a call that publishes one event"""


@dataclass
class _Meter:
    late_s: list[float] = field(default_factory=lambda: [0.0])
    puts_s: list[float] = field(default_factory=lambda: [0.0])

    def publish(self, robots: Robots, robot: bytes) -> None:
        started_s = time.perf_counter()
        robots.publish_event(robot)
        self.puts_s.append(time.perf_counter() - started_s)

    def report(self) -> RobotsReport:
        process = psutil.Process()
        times = process.cpu_times()
        return RobotsReport(
            time.monotonic(),
            process.memory_info().rss / 2**20,
            times.user + times.system,
            process.num_threads(),
            1e3 * max(self.late_s),
            1e3 * max(self.puts_s),
            len(self.puts_s) - 1,
            1e6 * statistics.median(self.puts_s),
        )


def run_robots(
    connection: Connection,
    kind: Kind,
    network: NetworkSettings,
    count: int,
    incarnation: int,
    first: int,
) -> None:
    """Run robots; obeys ("burst", events), ("rate", events per second of each robot), ("reconnect",), ("report",)."""
    identities = [identity_of(first + number) for number in range(count)]
    names = [identity.id for identity in identities]
    make = OurRobots if kind == "ours" else ZenohRobots
    robots: Robots = make(open_session(network), identities, incarnation)
    meter, rate, owed = _Meter(), 0.0, 0.0
    connection.send(os.getpid())
    due_s = state_due_s = time.monotonic()
    while True:
        now_s = time.monotonic()
        meter.late_s.append(now_s - due_s)
        due_s = max(due_s, now_s - CONTROL_S) + CONTROL_S
        owed += rate * CONTROL_S
        for _ in range(int(owed)):
            for name in names:
                meter.publish(robots, name)
        owed -= int(owed)
        if now_s >= state_due_s:
            robots.publish_states()
            state_due_s = now_s + STATE_S
        robots.handle_queries(max(0.0, due_s - time.monotonic()))
        while connection.poll(0.0):
            match connection.recv():
                case ("burst", events):
                    for _ in range(events):
                        for name in names:
                            meter.publish(robots, name)
                case ("rate", per_s):
                    rate = per_s
                case ("reconnect",):
                    robots.reconnect(lambda: open_session(network))
                case ("report",):
                    connection.send(meter.report())
                    meter = _Meter()
                    due_s = time.monotonic() + CONTROL_S
                    continue
            connection.send("done")
            due_s = time.monotonic() + CONTROL_S
