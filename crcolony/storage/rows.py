"""The rows of a robot's memory, as the records, decisions and robots they stand for."""

import io
import math
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from crcolony.protocol.encounters import EncounterRecord, Offer
from crcolony.protocol.mating_messages import Encounter
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint
from crcolony.storage.integrity import Head
from crcolony.storage.sql import find, select

UNDECIDED = dict.fromkeys(("energy", "conceived", "too_late", "child", "step", "stream", "serial"))
"""The columns of an encounter about whose offspring nothing is decided."""


WAITING = """
    SELECT * FROM encounters WHERE (role, state) = ('initiator', 'decided')
    OR (role, state) = ('responder', 'prepared') ORDER BY seq
"""
"""Encounters that wait for their partner, oldest first."""


@dataclass
class Known:
    """What there is in a file, as far as it must be known to write the next encounter."""

    head: Head
    encounters: int
    """How many there are, and the `seq` of the last"""
    waiting: dict[Encounter, dict[str, Any]]
    """The rows of those that wait for their partner; the others never change again"""


@dataclass(frozen=True)
class Decision:
    """What a robot made of a mating, by its own energy."""

    energy: float
    conceived: bool
    too_late: bool
    """The agent that met is no longer alive in this generation"""
    child: bytes
    """The offspring's genes (little-endian float64), or nothing"""
    step: int
    """The robot's control step at the decision"""
    stream: bytes
    """The robot's randomness after it"""


def head_of(database: sqlite3.Connection) -> Head:
    """Return the one row of `memory`."""
    row = find(database, "SELECT * FROM memory")
    assert row is not None, "it was there when the memory was opened"
    del row["digest"]
    return Head(**row)


def known_of(database: sqlite3.Connection) -> Known:
    """Return what is in the file."""
    (encounters,) = database.execute("SELECT ifnull(max(seq), 0) FROM encounters").fetchone()
    waiting = {record_of(row).encounter: row for row in select(database, WAITING)}
    return Known(head_of(database), int(encounters), waiting)


def snapshot_of(database: sqlite3.Connection, serial: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a saved robot and the row it stands in; raises CheckpointError if it cannot be understood."""
    row = find(database, "SELECT * FROM snapshots WHERE serial = ?", serial)
    if row is None:
        raise CheckpointError("it is missing")
    return read_checkpoint(io.BytesIO(row["robot"])), row


def record_of(row: Mapping[str, Any]) -> EncounterRecord:
    """Return the record that a row of `encounters` holds."""
    encounter = Encounter(
        bytes.fromhex(row["initiator"]),
        bytes.fromhex(row["responder"]),
        row["life"],
        row["count"],
    )
    has_partner = row["partner_agent"] is not None
    return EncounterRecord(
        encounter,
        row["role"],
        row["state"],
        row["nonce"],
        row["tick"],
        Offer(row["own_agent"], row["own_genes"]),
        Offer(row["partner_agent"], row["partner_genes"]) if has_partner else None,
        row["proof"],
        bool(row["orphaned"]),
    )


def decision_of(row: Mapping[str, Any]) -> Decision | None:
    """Return the decision that a row of `encounters` holds, if it has come to one."""
    if row["serial"] is None:
        return None
    return Decision(
        row["energy"],
        bool(row["conceived"]),
        bool(row["too_late"]),
        row["child"],
        row["step"],
        row["stream"],
    )


def row_of(record: EncounterRecord) -> dict[str, Any]:
    """Return the columns of `encounters` that a record fills."""
    encounter, partner = record.encounter, record.partner
    return {
        "initiator": encounter.initiator.hex(),
        "responder": encounter.responder.hex(),
        "life": encounter.incarnation,
        "count": encounter.count,
        "role": record.role,
        "state": record.state,
        "nonce": record.nonce,
        "tick": record.tick,
        "own_agent": record.own.agent,
        "own_genes": record.own.genes,
        "partner_agent": partner.agent if partner else None,
        "partner_genes": partner.genes if partner else None,
        "proof": record.proof,
        "orphaned": int(record.orphaned),
    }


def columns_of(decision: Decision) -> dict[str, Any]:
    """Return the columns of `encounters` that a decision fills; raises ValueError for an energy that is no number."""
    if not math.isfinite(decision.energy):
        raise ValueError(f"an energy of {decision.energy}")
    return {
        "energy": float(decision.energy) + 0.0,  # SQLite knows no -0.0
        "conceived": int(decision.conceived),
        "too_late": int(decision.too_late),
        "child": decision.child,
        "step": int(decision.step),
        "stream": decision.stream,
    }
