"""Observers of the trial of Zenoh's advanced publishers: processes that count the events they receive."""

import contextlib
import os
import socket
import struct
import threading
import time
from collections import Counter
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import psutil
import zenoh
import zenoh.ext
from zenoh.handlers import Callback

from crcolony.protocol.codec import WireError
from crcolony.protocol.telemetry_messages import EventMessage, decode_event
from crcolony.telemetry.status_changes import EventReceived
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.benchmarks.advanced_pubsub_robots import COLONY, KEYS, Kind

POLL_S = 0.05
_BYTES_RECEIVED_AT = 128
"""Of tcpi_bytes_received in Linux' struct tcp_info"""


@dataclass
class ObserverReport:
    """What an observer has received so far."""

    events: dict[tuple[bytes, int], int]
    """Distinct numbers by robot and incarnation"""
    duplicates: int
    disordered: int
    """Events that arrived after one of a higher number of the same robot and incarnation"""
    first_s: float
    """From the start of the observer to the first event, and to the last"""
    last_s: float
    missed: int
    """Events that are shown as lost"""
    rss_mib: float
    cpu_s: float
    received_bytes: int
    """By the open TCP sockets of this process"""


class Log:
    """The events that arrived, in whatever thread."""

    def __init__(self) -> None:
        self.started_s = time.monotonic()
        self.first_s = self.last_s = 0.0
        self.duplicates = self.disordered = 0
        self._seqs: dict[tuple[bytes, int], set[int]] = {}
        self._last: Counter[tuple[bytes, int]] = Counter()
        self._lock = threading.Lock()

    def add(self, message: EventMessage) -> None:
        """Count an event."""
        with self._lock:
            at, seq = (message.robot, message.incarnation), message.seq
            seqs = self._seqs.setdefault(at, set())
            self.last_s = time.monotonic() - self.started_s
            self.first_s = self.first_s or self.last_s
            self.duplicates += seq in seqs
            self.disordered += seq < self._last[at]
            self._last[at] = max(seq, self._last[at])
            seqs.add(seq)

    def counts(self) -> dict[tuple[bytes, int], int]:
        """Return how many distinct events there are by robot and incarnation."""
        with self._lock:
            return {at: len(seqs) for at, seqs in self._seqs.items()}


class OurObserver:
    """An observer that asks for what it missed, as `crcolony dashboard` does."""

    def __init__(self, session: zenoh.Session, log: Log, history: int) -> None:
        self._log = log
        self._subscriber = TelemetrySubscriber(
            session, COLONY, sends_requests=True, history=history
        )

    @property
    def missed(self) -> int:
        """Events that were published while it watched, and have not come."""
        return sum(status.missed for status in self._subscriber.monitor.all)

    def poll(self) -> None:
        """Process what arrived."""
        for change in self._subscriber.poll():
            if isinstance(change, EventReceived):
                self._log.add(change.message)


class ZenohObserver:
    """An observer with an advanced subscriber."""

    def __init__(self, session: zenoh.Session, log: Log, history: int) -> None:
        self._log, self.missed = log, 0
        self._subscriber: Any = zenoh.ext.declare_advanced_subscriber(
            session,
            KEYS.all_events,
            Callback(self._on_sample, indirect=False),
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=history)
            if history
            else None,
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )
        self._listener = self._subscriber.sample_miss_listener(
            Callback(self._on_miss, indirect=False)
        )

    def _on_sample(self, sample: zenoh.Sample) -> None:
        try:
            self._log.add(decode_event(sample.payload.to_bytes()))
        except WireError:
            return

    def _on_miss(self, miss: zenoh.ext.Miss) -> None:
        self.missed += miss.nb

    def poll(self) -> None:
        """Do nothing: events arrive on Zenoh's threads."""


def run_observer(
    connection: Connection, kind: Kind, network: NetworkSettings, history: int
) -> None:
    """Observe; obeys ("report",) and ("leave",)."""
    session, log = open_session(network), Log()
    make = OurObserver if kind == "ours" else ZenohObserver
    observer: OurObserver | ZenohObserver = make(session, log, history)
    process = psutil.Process()
    connection.send(os.getpid())
    while True:
        observer.poll()
        while connection.poll(POLL_S):
            if connection.recv() == ("leave",):
                session.close()  # type: ignore[no-untyped-call]
                return
            times = process.cpu_times()
            connection.send(
                ObserverReport(
                    log.counts(), log.duplicates, log.disordered, log.first_s, log.last_s,
                    observer.missed, process.memory_info().rss / 2**20, times.user + times.system,
                    received_bytes(),
                )
            )  # fmt: skip
            observer.poll()


def received_bytes() -> int:
    """Return how many bytes the open TCP sockets of this process have received (Linux only)."""
    total = 0
    for name in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # it is no socket, or closed by now
            one = socket.socket(fileno=int(name))
            try:
                info = one.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _BYTES_RECEIVED_AT + 8)
                total += struct.unpack_from("Q", info, _BYTES_RECEIVED_AT)[0]
            finally:
                one.detach()
    return total
