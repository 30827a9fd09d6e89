"""Robots' memories for tests: small records, decisions, robots and events, told apart by a number."""

import contextlib
import resource
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from crcolony.evolution.history import Died, Event, TurnedOver
from crcolony.protocol.encounters import EncounterRecord, EncounterState, Offer
from crcolony.protocol.mating_messages import Encounter
from crcolony.storage.reading import read_stored_robot
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

ME, PEER, OTHER = b"m" * 16, b"p" * 16, b"o" * 16
SCHEMA = b"s" * 16


def open_store(path: Path, durable: bool = False) -> RobotStore:
    return RobotStore(path, ME, SCHEMA, durable=durable)


def proposed(number: int, state: EncounterState = "decided", peer: bytes = PEER) -> EncounterRecord:
    """Return the record of an encounter that this robot began."""
    return EncounterRecord(
        Encounter(ME, peer, 7, number),
        "initiator",
        state,
        number,
        number + 1,
        Offer(f"me/{number}", bytes([number % 256]) * 16),
        Offer(f"peer/{number}", bytes([number % 256]) * 16),
        b"a letter",
    )


def answered(
    number: int, state: EncounterState = "prepared", peer: bytes = PEER
) -> EncounterRecord:
    """Return the record of an encounter that another robot began."""
    encounter = Encounter(peer, ME, 7, number)
    return replace(proposed(number, state), encounter=encounter, role="responder")


def decision(number: int) -> Decision:
    conceived = number % 3 > 0
    child = bytes([number % 256]) * 16 if conceived else b""
    return Decision(number / 7, conceived, number % 5 == 0, child, 10 * number, bytes(15) + b"s")


def robot(number: int) -> dict[str, Any]:
    """Return something like what `Robot.save` returns; a few pages long."""
    pool = [(np.full(2, float(number)), "me/1", "peer/1", number)]
    weights = np.random.default_rng(number).normal(size=700)
    return {
        "arrays": {"weights": weights},
        "generation": number,
        "subpopulation": {"pool": pool},
    }


def events(number: int) -> list[Event]:
    return [Died(number, 0, f"me/{number}"), TurnedOver(number, 0, number, 3)]


@dataclass(frozen=True)
class Seen:
    """All that can be told of a memory, in a form that can be compared."""

    matings: tuple[tuple[EncounterRecord, Decision | None], ...]
    since: tuple[tuple[EncounterRecord, Decision], ...]
    open: tuple[EncounterRecord, ...]
    marks: tuple[tuple[bytes, tuple[tuple[int, int], bool]], ...]
    events: tuple[Event, ...]
    tick: int | None
    robot: bytes
    """Its weights"""


def see(store: RobotStore) -> Seen:
    loaded = store.load()
    memory = read_stored_robot(store.path)
    assert (None if loaded is None else loaded[1]) == memory.tick
    return Seen(
        tuple(memory.matings),
        tuple(store.decisions_since()),
        tuple(store.open_records()),
        tuple(store.marks().items()),
        tuple(memory.events),
        memory.tick,
        b"" if loaded is None else loaded[0]["arrays"]["weights"].tobytes(),
    )


@contextlib.contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let no file of this process grow beyond so many bytes, as a full disk or a quota would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
