"""A real memory, in a real SQLite file, on a disk that may be full or fail, of a process that may die at any point."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from random import Random
from typing import Any

from crcolony.errors import FatalStorageError
from crcolony.evolution.history import Event
from crcolony.fault_simulation.faults import CrashError, Hazard
from crcolony.fault_simulation.invariants import InvariantChecker
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.storage.rows import Decision, StoreState
from crcolony.storage.store import RobotStore, StorageFullError

_FAILING = 0.7
"""Share of transactions for which a disk has no room while it is nearly full"""
_ERRORS = 0.5


class Disk:
    """One robot's disk, whatever process uses it."""

    def __init__(self, rng: Random, has_errors: bool) -> None:
        self._rng, self._has_errors = rng, has_errors
        self._is_full = False

    def fill(self) -> None:
        """Leave room for few transactions."""
        self._is_full = True

    def clear(self) -> None:
        """Have room for all of them."""
        self._is_full = False

    def has_room(self) -> bool:
        """Tell whether there is room for this transaction."""
        return not self._is_full or self._rng.random() >= _FAILING

    def end(self) -> type[Exception]:
        """Return how a process ends that is struck down at it: by an error of the disk, or killed."""
        return (
            FatalStorageError if self._has_errors and self._rng.random() < _ERRORS else CrashError
        )


class SimulatedStore(RobotStore):
    """The memory of one life. It tells the witness what is on the disk."""

    def attach(self, robot: RobotId, disk: Disk, hazard: Hazard, checker: InvariantChecker) -> None:
        """Let it be struck from now on."""
        self._robot_id, self._disk, self._hazard, self._checker = robot, disk, hazard, checker

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[StoreState]:
        if not self._disk.has_room():
            raise StorageFullError("no room")
        with super()._transaction() as state:
            yield state
            self._strike()

    def _strike(self) -> None:
        try:
            self._hazard.strike(self._disk.end())
        except CrashError:
            self._connection.close()  # no orderly rollback: the process is dead
            raise

    def begin_incarnation(self, unix_s: int) -> int:
        """Count this start."""
        incarnation = super().begin_incarnation(unix_s)
        self._strike()
        return incarnation

    def write(
        self,
        records: Sequence[EncounterRecord],
        decided: EncounterRecord | None = None,
        decision: Decision | None = None,
    ) -> None:
        """Write records and a decision."""
        super().write(records, decided, decision)
        self._checker.on_written(self._robot_id, records, decided, decision)
        self._strike()

    def save(self, robot: Mapping[str, Any], events: Sequence[Event], tick: int) -> None:
        """Write a snapshot."""
        super().save(robot, events, tick)
        self._checker.on_saved(self._robot_id, events)
        self._strike()

    def drop(self) -> None:
        """Let go of the file as a killed process does: what is not committed is lost, nothing is tidied up."""
        self._is_broken = True
        self.close()
