"""The processes of a trial of Zenoh's advanced publishers, and how they are started, paused and waited for."""

import contextlib
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from crcolony.transport.zenoh_session import NetworkSettings, free_port
from tests.benchmarks.advanced_pubsub_attacks import run_attack, run_proxy
from tests.benchmarks.advanced_pubsub_observers import ObserverReport, run_observer
from tests.benchmarks.advanced_pubsub_robots import Kind, run_robots
from tests.benchmarks.processes import child

HISTORY = 1_000


@dataclass
class Peer:
    """A process of the trial."""

    connection: Connection
    pid: int

    def request(self, *command: object) -> Any:
        """Send a command, and wait for the answer."""
        self.connection.send(command)
        assert self.connection.poll(30.0), f"no answer to {command}"
        return self.connection.recv()


@contextlib.contextmanager
def peer(run: Callable[..., None], *arguments: object) -> Iterator[Peer]:
    """Run a process of the trial, and kill it when this is left."""
    with child(run, *arguments) as connection:
        assert connection.poll(30.0), f"{run.__name__} did not start"
        yield Peer(connection, connection.recv())


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

    def observer_through_proxy(self, period_s: float) -> Peer:
        """Start an observer whose TCP connection is cut again and again."""
        port = free_port()
        self._start(run_proxy, port, self._port, period_s)
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
