"""What a robot's file keeps of old encounters, so that it grows by tens of kilobytes an hour and not by megabytes.

The last `FULL_ENCOUNTERS` keep everything. Older ones that have ended keep who met whom and when, the energy and the
outcome, but neither genotypes nor the partner's signed message: the offspring's genes and parents are in its birth, an
event that stays for good. Of snapshots the last two are kept.
"""

import sqlite3

from crcolony.storage.rows import StoreState
from crcolony.storage.sql import insert, select

FULL_ENCOUNTERS = 1_000
"""So many of the last encounters keep genotypes and signed message: about 2.5 MB."""

_MAX_AT_ONCE = 200
"""So many are compacted with a snapshot at most: a control loop waits for it."""

_BULKY = ("own_genes", "partner_genes", "proof", "child", "stream")
"""Columns that are emptied."""


def compact_encounters(database: sqlite3.Connection, state: StoreState, snapshot: int) -> None:
    """Empty the bulky columns of encounters that ended long ago, inside a transaction.

    Decisions after the older of two snapshots, with serial `snapshot`, would be needed to go on from there, and stay.
    """
    last = state.encounters - FULL_ENCOUNTERS
    query = """
        SELECT * FROM encounters WHERE seq > ? AND seq <= ? AND proof <> x'' ORDER BY seq LIMIT ?
    """
    rows = list(select(database, query, state.compacted, last, _MAX_AT_ONCE))
    for row in rows:
        if row["serial"] is not None and row["serial"] > snapshot:
            return
        if row["state"] in ("mated", "aborted"):
            state.head.toggle(row["digest"])
            empty = {name: b"" for name in _BULKY if row[name] is not None}
            # Deleted first: SQLite joins pages that are nearly empty after a deletion, but not after an update.
            database.execute("DELETE FROM encounters WHERE seq = ?", (row["seq"],))
            state.head.toggle(insert(database, "encounters", row | empty))
        state.compacted = row["seq"]
    if len(rows) < _MAX_AT_ONCE:
        state.compacted = max(state.compacted, last)
