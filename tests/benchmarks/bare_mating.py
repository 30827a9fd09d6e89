"""What a mating cannot do without: bare Zenoh messages, bare durable commits of SQLite, and signatures."""

import contextlib
import os
import sqlite3
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from crcolony.protocol.envelope import open_envelope
from crcolony.protocol.identity import Identity, is_signed
from crcolony.transport.network_settings import NetworkSettings
from tests.benchmarks.processes import Wire, child


@dataclass(frozen=True)
class Sizes:
    """Bytes of the messages of a mating, and of what is committed."""

    propose: int
    accept: int
    commit: int
    done: int
    prepared: int
    decided: int


def bare_initiator(
    connection: Connection, network: NetworkSettings, folder: Path, sizes: Sizes
) -> None:
    """Mate without any of the product whenever the connection asks; answer when it began."""
    with contextlib.ExitStack() as opened:
        wire = opened.enter_context(Wire(network, "bare/initiator"))
        commit = committer(opened, folder)
        wire.wait_for_subscriber("bare/responder")
        connection.send("ready")
        while True:
            connection.recv()
            start_s = time.monotonic()
            wire.put("bare/responder", bytes(sizes.propose))
            wire.wait_for_message()
            commit(sizes.decided)
            wire.put("bare/responder", bytes(sizes.commit))
            wire.wait_for_message()
            connection.send(start_s)


def bare_responder(
    connection: Connection, network: NetworkSettings, folder: Path, sizes: Sizes
) -> None:
    """Answer the bare initiator; tell the connection of every mating when it was decided."""
    with contextlib.ExitStack() as opened:
        wire = opened.enter_context(Wire(network, "bare/responder"))
        commit = committer(opened, folder)
        wire.wait_for_subscriber("bare/initiator")
        connection.send("ready")
        while True:
            wire.wait_for_message()
            commit(sizes.prepared)
            wire.put("bare/initiator", bytes(sizes.accept))
            wire.wait_for_message()
            commit(sizes.decided)
            decided_s = time.monotonic()
            wire.put("bare/initiator", bytes(sizes.done))
            connection.send(decided_s)


def bare_matings_between(
    opened: contextlib.ExitStack, endpoint: str, folder: Path, sizes: Sizes
) -> Callable[[], float]:
    """Return a function that does what is bare of a mating and returns how long that took, in seconds."""
    folders = [folder / "bare_a", folder / "bare_b"]
    for each in folders:
        each.mkdir()
    listening, connecting = (
        NetworkSettings(listen=(endpoint,)),
        NetworkSettings(connect=(endpoint,)),
    )
    initiator = opened.enter_context(child(bare_initiator, listening, folders[0], sizes))
    responder = opened.enter_context(child(bare_responder, connecting, folders[1], sizes))
    assert (initiator.recv(), responder.recv()) == ("ready", "ready")

    def mate() -> float:
        initiator.send("mate")
        return float(responder.recv() - initiator.recv())

    return mate


def echo(connection: Connection, network: NetworkSettings, sizes: list[int]) -> None:
    """Answer every message with one of the size that the protocol answers with."""
    with Wire(network, "bench/to") as wire:
        wire.wait_for_subscriber("bench/back")
        connection.send("ready")
        number = 0
        while True:
            if wire.get():
                wire.put("bench/back", bytes(sizes[number % len(sizes)]))
                number += 1


def round_trips_between(
    opened: contextlib.ExitStack, endpoint: str, sizes: Sizes
) -> Callable[[], float]:
    """Return a function that makes the two bare round trips of a mating and returns how long they took, in seconds."""
    wire = opened.enter_context(Wire(NetworkSettings(listen=(endpoint,)), "bench/back"))
    ready = opened.enter_context(
        child(echo, NetworkSettings(connect=(endpoint,)), [sizes.accept, sizes.done])
    )
    assert ready.recv() == "ready"
    wire.wait_for_subscriber("bench/to")

    def travel() -> float:
        start = time.perf_counter()
        for size in (sizes.propose, sizes.commit):
            wire.put("bench/to", bytes(size))
            wire.wait_for_message()
        return time.perf_counter() - start

    return travel


def committer(opened: contextlib.ExitStack, folder: Path) -> Callable[[int], None]:
    """Return a function that makes a bare durable commit of so many bytes into a file of this folder."""
    database = sqlite3.connect(folder / "bare", isolation_level=None)
    opened.callback(database.close)
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA synchronous = FULL")
    database.execute("CREATE TABLE bare (key INTEGER PRIMARY KEY, value BLOB)")

    def commit(size: int) -> None:
        database.execute("INSERT INTO bare (value) VALUES (?)", (os.urandom(size),))

    return commit


def commits_into(opened: contextlib.ExitStack, folder: Path, sizes: Sizes) -> Callable[[], float]:
    """Return a function that makes the three bare commits of a mating and returns how long they took, in seconds."""
    commit_one = committer(opened, folder)

    def commit() -> float:
        start = time.perf_counter()
        for size in (sizes.prepared, sizes.decided, sizes.decided):
            commit_one(size)
        return time.perf_counter() - start

    return commit


def signatures_of(sealed: list[bytes]) -> Callable[[], float]:
    """Return a function that signs and verifies the messages of a mating and returns how long that took, in seconds."""
    me = Identity(bytes(32))
    contents = [open_envelope(envelope)[0].content for envelope in sealed[:3]]

    def sign_and_verify() -> float:
        start = time.perf_counter()
        for content in contents:
            assert is_signed(content, me.sign(content), me.public_key)
        return time.perf_counter() - start

    return sign_and_verify
