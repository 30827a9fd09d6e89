"""The rows of a robot's file, and the values that they hold: encounters, decisions, snapshots, the head."""

import io
import math
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from crcolony.protocol.encounters import EncounterRecord, Offer
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Encounter
from crcolony.storage.checkpoint import CheckpointError, read_checkpoint
from crcolony.storage.integrity import NAMES, Head
from crcolony.storage.sql import select, select_one

UNDECIDED = dict.fromkeys(("energy", "conceived", "too_late", "child", "step", "stream", "serial"))
"""The columns of an encounter about whose offspring nothing is decided."""

_OPEN_ENCOUNTERS = """
    SELECT * FROM encounters WHERE (role, state) = ('initiator', 'decided')
    OR (role, state) = ('responder', 'prepared') ORDER BY seq
"""
_RESPONDED_ENCOUNTERS = """
    SELECT initiator, incarnation, count, state FROM encounters WHERE role = 'responder'
    ORDER BY incarnation, count
"""


@dataclass
class StoreState:
    """The part of a file's content that is kept in RAM, to write the next encounter without reading the file."""

    head: Head
    encounters: int
    """The number of encounters, which is the `seq` of the last"""
    open_rows: dict[Encounter, dict[str, Any]]
    """The rows of encounters that are open; of the others only the bulky columns are emptied later"""
    compacted: int
    """The `seq` up to which that was done"""


@dataclass(frozen=True)
class Decision:
    """What a robot decided about its own offspring of a mating, by its energy."""

    energy: float
    conceived: bool
    too_late: bool
    """The agent that met is no longer alive in this generation"""
    child: bytes
    """The offspring's genes (little-endian float64), or nothing"""
    step: int
    """The robot's control step at the decision"""
    stream: bytes
    """The state of the robot's random generator after the decision"""


def read_head(database: sqlite3.Connection) -> Head:
    """Return the head of a file that was checked when it was opened."""
    row = select_one(database, f"SELECT * FROM {NAMES.head}")
    assert row is not None, "it was there when the file was opened"
    del row["digest"]
    return Head(**row)


def read_state(database: sqlite3.Connection) -> StoreState:
    """Return the state of a file as it is on the disk."""
    (encounters,) = database.execute("SELECT ifnull(max(seq), 0) FROM encounters").fetchone()
    open_rows = {record_of(row).encounter: row for row in select(database, _OPEN_ENCOUNTERS)}
    query = "SELECT ifnull(min(seq) - 1, 0) FROM encounters WHERE proof <> x''"
    (compacted,) = database.execute(query).fetchone()
    return StoreState(read_head(database), int(encounters), open_rows, int(compacted))


def read_open_records(database: sqlite3.Connection) -> list[EncounterRecord]:
    """Return the encounters that wait for their partner, oldest first."""
    return [record_of(row) for row in select(database, _OPEN_ENCOUNTERS)]


def read_marks(database: sqlite3.Connection) -> dict[RobotId, tuple[tuple[int, int], bool]]:
    """Return incarnation and count of the last encounter of every initiator, and whether it was a mating."""
    return {
        bytes.fromhex(initiator): ((incarnation, count), state == "mated")
        for initiator, incarnation, count, state in database.execute(_RESPONDED_ENCOUNTERS)
    }


def read_decisions(
    database: sqlite3.Connection, after_serial: int
) -> list[tuple[EncounterRecord, Decision]]:
    """Return the matings that were decided after a transaction, in order."""
    query = "SELECT * FROM encounters WHERE serial > ? ORDER BY serial"
    decisions = []
    for row in select(database, query, after_serial):
        decision = decision_of(row)
        assert decision is not None, "a row with a serial holds a decision"
        decisions.append((record_of(row), decision))
    return decisions


def read_snapshot(
    database: sqlite3.Connection, serial: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the robot saved in a snapshot, and the snapshot's row; raises CheckpointError if it is unreadable."""
    row = select_one(database, "SELECT * FROM snapshots WHERE serial = ?", serial)
    if row is None:
        raise CheckpointError("it is missing")
    return read_checkpoint(io.BytesIO(row["robot"])), row


def record_of(row: Mapping[str, Any]) -> EncounterRecord:
    """Return the record that a row of `encounters` holds."""
    encounter = Encounter(
        bytes.fromhex(row["initiator"]),
        bytes.fromhex(row["responder"]),
        row["incarnation"],
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
    """Return the decision that a row of `encounters` holds, or None if there is none yet."""
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
        "incarnation": encounter.incarnation,
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


def decision_columns(decision: Decision) -> dict[str, Any]:
    """Return the columns of `encounters` that a decision fills; raises ValueError if the energy is not finite."""
    if not math.isfinite(decision.energy):
        raise ValueError(f"an energy of {decision.energy}")
    return {
        "energy": float(decision.energy) + 0.0,  # SQLite stores -0.0 as 0.0, and digests must agree
        "conceived": int(decision.conceived),
        "too_late": int(decision.too_late),
        "child": decision.child,
        "step": int(decision.step),
        "stream": decision.stream,
    }
