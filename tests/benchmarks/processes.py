"""Processes for benchmarks of the network: Python functions as children, and the command line as a user starts it."""

import contextlib
import multiprocessing
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.signed_telemetry import open_telemetry
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port, open_session

COLONY, ARENA = "bench", "bench"
_SPAWN = multiprocessing.get_context("spawn")
_PATIENCE_S = 20.0


@contextlib.contextmanager
def child(run: Callable[..., None], *arguments: object) -> Iterator[Connection]:
    """Run `run(connection, *arguments)` in a process of its own, and end it when this is left."""
    ours, theirs = _SPAWN.Pipe()
    process = _SPAWN.Process(target=run, args=(theirs, *arguments), daemon=True)
    process.start()
    theirs.close()
    try:
        yield ours
    finally:
        process.kill()
        process.join()
        ours.close()


@contextlib.contextmanager
def commands(
    folder: Path, *lines: Sequence[str], before: Sequence[Sequence[str]] = ()
) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Run `crcolony` commands, each a process that logs into the folder; end them, and wait, when this is left.

    `before` has what is put in front of each, as to run it on another host.
    """
    folder.mkdir(parents=True, exist_ok=True)
    running: list[subprocess.Popen[bytes]] = []
    try:
        for number, line in enumerate(lines):
            prefix = before[number] if before else ()
            running.append(start(folder / f"{number}.log", line, prefix))
        yield running
    finally:
        stop(running)


def start(log: Path, line: Sequence[str], before: Sequence[str] = ()) -> subprocess.Popen[bytes]:
    """Start one `crcolony` command."""
    words = [*before, sys.executable, "-m", "crcolony", *line]
    with log.open("wb") as out:
        return subprocess.Popen(words, stdout=out, stderr=out)


def stop(running: Sequence[subprocess.Popen[bytes]]) -> None:
    """Ask processes to end, and kill those that do not."""
    for process in running:
        process.terminate()
    until_s = time.monotonic() + 10.0
    for process in running:
        try:
            process.wait(max(0.1, until_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def here() -> str:
    """Return an endpoint of this machine that is free now."""
    return f"tcp/127.0.0.1:{free_port()}"


class Wire:
    """Bare Zenoh between processes: what arrives on the keys it subscribes to waits in a queue, as in the product."""

    def __init__(self, network: NetworkSettings, *keys: str) -> None:
        self.session = open_session(network)
        self.queue: SimpleQueue[bytes] = SimpleQueue()
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._subscribers = [
            self.session.declare_subscriber(key, Callback(self._on_sample, indirect=False))
            for key in keys
        ]

    def _on_sample(self, sample: zenoh.Sample) -> None:
        self.queue.put(sample.payload.to_bytes())

    def put(self, key: str, data: bytes) -> None:
        """Publish at once, and wait where the link is congested: nothing gets lost."""
        if key not in self._publishers:
            self._publishers[key] = self.session.declare_publisher(
                key, express=True, congestion_control=zenoh.CongestionControl.BLOCK
            )
        self._publishers[key].put(data)

    def get(self) -> bytes:
        """Wait for what arrives next; raises AssertionError if nothing does."""
        try:
            return self.queue.get(timeout=_PATIENCE_S)
        except Empty:
            raise AssertionError("nothing arrived") from None

    def get_telemetry(self) -> bytes:
        """Wait for telemetry, and return it without its signature, which is not verified."""
        return open_telemetry(self.get()).content

    def wait_for_message(self) -> None:
        """Wait for what arrives next and is not empty, as what `wait_for_subscriber` of the other side puts is."""
        while not self.get():
            pass

    def wait_for_subscriber(self, key: str) -> None:
        """Wait until there is a subscriber of a key."""
        self.put(key, b"")
        publisher: Any = self._publishers[key]
        matching = threading.Event()
        listener = publisher.declare_matching_listener(
            Callback(lambda status: matching.set() if status.matching else None, indirect=False)
        )
        assert publisher.matching_status.matching or matching.wait(_PATIENCE_S), (
            f"{key}: no subscriber"
        )
        listener.undeclare()

    def close(self) -> None:
        """Leave the network."""
        self.session.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> "Wire":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()
