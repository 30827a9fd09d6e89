"""The processes of a trial of Zenoh's advanced publishers, and how they are started, paused and waited for."""

import contextlib
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cached_property
from multiprocessing.connection import Connection
from typing import Any

from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port
from tests.benchmarks.advanced_pubsub_attacks import run_attack, run_proxy
from tests.benchmarks.advanced_pubsub_observers import ObserverReport, run_observer
from tests.benchmarks.advanced_pubsub_robots import Kind, RobotsReport, run_robots
from tests.benchmarks.processes import child

HISTORY = 1_000
Row = tuple[str, str]
"""What was measured, and the figure"""


class Peer:
    """A process of the trial. It is waited for when it is needed, so that several start at the same time."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection

    @cached_property
    def pid(self) -> int:
        """Wait until the process is ready, and return its id."""
        assert self.connection.poll(30.0), "a process did not start"
        pid: int = self.connection.recv()
        return pid

    def send(self, *command: object) -> None:
        """Send a command."""
        assert self.pid
        self.connection.send(command)

    def request(self, *command: object) -> Any:
        """Send a command, and wait for the answer."""
        self.send(*command)
        assert self.connection.poll(30.0), f"no answer to {command}"
        return self.connection.recv()


@contextlib.contextmanager
def peer(run: Callable[..., None], *arguments: object) -> Iterator[Peer]:
    """Run a process of the trial, and kill it when this is left."""
    with child(run, *arguments) as connection:
        yield Peer(connection)


@contextlib.contextmanager
def stopped(process: Peer) -> Iterator[None]:
    """Pause a process."""
    os.kill(process.pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(process.pid, signal.SIGCONT)


class Trial:
    """The processes of one trial in one of the two ways."""

    def __init__(self, kind: Kind, stack: ExitStack) -> None:
        self.kind: Kind = kind
        self._stack = stack
        self._port = free_port()
        self.endpoint = f"tcp/127.0.0.1:{self._port}"

    def robots(self, count: int, incarnation: int = 0, first: int = 0) -> Peer:
        """Start a process of robots; the first that is started listens, the others connect to it."""
        network = (
            NetworkSettings(connect=(self.endpoint,))
            if first
            else NetworkSettings(listen=(self.endpoint,))
        )
        return self._start(run_robots, self.kind, network, count, incarnation, first)

    def observer(self, history: int = HISTORY) -> Peer:
        """Start an observer."""
        return self._start(
            run_observer, self.kind, NetworkSettings(connect=(self.endpoint,)), history
        )

    def listening_observer(self) -> Peer:
        """Start an observer that the robots, which have started before, connect to; it wants all events."""
        return self._start(
            run_observer, self.kind, NetworkSettings(listen=(self.endpoint,)), 10_000
        )

    def observer_through_proxy(self, period_s: float) -> Peer:
        """Start an observer whose TCP connection is cut again and again."""
        port = free_port()
        assert self._start(run_proxy, port, self._port, period_s).pid
        network = NetworkSettings(role="client", connect=(f"tcp/127.0.0.1:{port}",))
        return self._start(run_observer, self.kind, network, HISTORY)

    def attacker(self, name: str) -> Peer:
        """Start a hostile peer that waits for a command to attack."""
        return self._start(run_attack, name, self.kind, self.endpoint)

    def _start(self, *run: Any) -> Peer:
        return self._stack.enter_context(peer(*run))


def wait(observer: Peer, is_done: Callable[[ObserverReport], bool], within_s: float) -> Any:
    """Wait until an observer reports something, at most so long; return its last report."""
    until_s = time.monotonic() + within_s
    while True:
        report = observer.request("report")
        if is_done(report) or time.monotonic() > until_s:
            return report
        time.sleep(0.1)


def total(report: ObserverReport) -> int:
    """Return how many distinct events an observer has received."""
    return sum(report.events.values())


def format_arrival(report: ObserverReport, wanted: int) -> str:
    """Return how many of the wanted events arrived, when the last did, and how often twice or out of order."""
    return (
        f"{total(report)} of {wanted} in {report.last_s:.2f} s, {report.duplicates} twice,"
        f" {report.disordered} out of order, {report.missed} shown as lost"
    )


def format_load(before: RobotsReport, after: RobotsReport) -> str:
    """Return what a process of robots went through between two reports."""
    return (
        f"CPU {(after.cpu_s - before.cpu_s) / (after.at_s - before.at_s):.0%},"
        f" memory {after.rss_mib - before.rss_mib:+.0f} MiB,"
        f" loop late {after.max_late_ms:.0f} ms, longest put {after.max_put_ms:.0f} ms"
    )
