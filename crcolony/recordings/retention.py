"""What a recording of a colony that runs for weeks keeps: every event for good, poses and states for some hours.

The freed pages of the file are used again, so that it stops to grow but for events: births, matings, lifetimes,
turnovers, and who was online when.
"""

import sqlite3

_BULKY = ("scene", "state", "activity")
"""Kinds of samples that repeat several times a second; without them a recording is some hundredths of its size."""
_ROWS_AT_ONCE = 20_000
"""So many are looked at with one commit: more than arrive meanwhile from a thousand robots."""


class Retention:
    """Deletes the bulky samples that are older than `keep_s`, a part at every call."""

    def __init__(self, keep_s: float) -> None:
        self._keep_ms = round(1000.0 * keep_s)
        self._checked = 0
        """The row up to which nothing old and bulky is left"""

    def delete_old(self, database: sqlite3.Connection, unix_ms: int) -> None:
        """Delete what is too old at this time; the caller commits."""
        query = "SELECT rowid, unix_ms FROM samples WHERE rowid > ? ORDER BY rowid LIMIT ?"
        before_ms, last = unix_ms - self._keep_ms, self._checked
        for row, arrived_ms in database.execute(query, (last, _ROWS_AT_ONCE)):
            if arrived_ms >= before_ms:
                break
            last = row
        if last > self._checked:
            marks = ", ".join("?" * len(_BULKY))
            delete = f"DELETE FROM samples WHERE rowid > ? AND rowid <= ? AND kind IN ({marks})"
            database.execute(delete, (self._checked, last, *_BULKY))
            self._checked = last
