"""Writes encounters, events and snapshots into a robot's file, inside a transaction of `RobotStore`."""

import sqlite3
import time
from collections.abc import Sequence

import msgspec

from crcolony.evolution.history import Event
from crcolony.protocol.encounters import EncounterRecord
from crcolony.storage.integrity import Head
from crcolony.storage.rows import UNDECIDED, Decision, StoreState, decision_columns, row_of
from crcolony.storage.sql import insert, insert_large, select, update

_encode = msgspec.msgpack.Encoder().encode


def write_record(
    database: sqlite3.Connection,
    state: StoreState,
    record: EncounterRecord,
    decision: Decision | None,
) -> None:
    """Write a record in place of the former one of its encounter, and what the robot decided about it.

    Raises ValueError if the encounter has ended, or if there is a decision already.
    """
    head = state.head
    before = state.open_rows.pop(record.encounter, None)
    row = row_of(record)
    if before is None:
        state.encounters += 1
        row |= {"seq": state.encounters, **UNDECIDED}
    else:
        head.toggle(before.pop("digest"))
        row = before | row
    if decision is not None:
        if row["serial"] is not None:
            raise ValueError("it is decided already whether this encounter has offspring")
        row |= decision_columns(decision) | {"serial": head.serial}
    if before is not None:
        digest = update(database, "encounters", before, row)
    else:
        try:
            digest = insert(database, "encounters", row)
        except sqlite3.IntegrityError:
            raise ValueError("this encounter has ended already") from None
    head.toggle(digest)
    if record.is_unresolved:
        state.open_rows[record.encounter] = row | {"digest": digest}


def write_snapshot(
    database: sqlite3.Connection,
    head: Head,
    base: int,
    robot: bytes,
    events: Sequence[Event],
    tick: int,
) -> None:
    """Write a snapshot (a checkpoint of the robot) and the events since the one with serial `base` (0: none).

    Every other snapshot is deleted, and so are events that came after `base`.
    """
    last = _events_of(database, base)
    _delete_events_after(database, head, last)
    for seq, event in enumerate(events, last + 1):
        columns = {
            "seq": seq,
            "tick": event.tick,
            "kind": type(event).__name__,
            "body": _encode(event),
        }
        head.toggle(insert(database, "events", columns))
    database.execute("DELETE FROM snapshots WHERE serial <> ?", (base,))
    snapshot = {
        "serial": head.serial,
        "tick": tick,
        "taken": int(time.time()),
        "events": last + len(events),
        "robot": robot,
    }
    insert_large(database, "snapshots", snapshot)
    head.newest, head.older = head.serial, base


def _events_of(database: sqlite3.Connection, serial: int) -> int:
    """Return the number of events up to a snapshot."""
    query = "SELECT events FROM snapshots WHERE serial = ?"
    row = database.execute(query, (serial,)).fetchone()
    return int(row[0]) if row else 0


def _delete_events_after(database: sqlite3.Connection, head: Head, seq: int) -> None:
    for row in list(select(database, "SELECT digest FROM events WHERE seq > ?", seq)):
        head.toggle(row["digest"])
    database.execute("DELETE FROM events WHERE seq > ?", (seq,))
