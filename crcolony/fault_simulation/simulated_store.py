"""A real store in a real SQLite file, on a disk that may be full or fail, of a process that may crash at any point."""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from random import Random
from typing import Any

from crcolony.errors import FatalStorageError
from crcolony.evolution.history import Event
from crcolony.fault_simulation.faults import CrashCountdown, CrashError
from crcolony.fault_simulation.invariants import InvariantChecker
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.storage.rows import Decision, StoreState
from crcolony.storage.store import RobotStore, StorageFullError

_FULL_SHARE = 0.7
"""Share of transactions that fail while a disk is full."""
_ERROR_SHARE = 0.5
"""Share of crashes that are errors of the disk, where a disk has errors."""


class Disk:
    """One robot's disk, which outlives its processes."""

    def __init__(self, rng: Random, has_errors: bool) -> None:
        self._rng, self._has_errors = rng, has_errors
        self._is_full = False

    def fill(self) -> None:
        """Let most transactions fail."""
        self._is_full = True

    def clear(self) -> None:
        """Let all transactions succeed."""
        self._is_full = False

    def has_room(self) -> bool:
        """Return whether there is room for this transaction."""
        return not self._is_full or self._rng.random() >= _FULL_SHARE

    def crash_error(self) -> type[Exception]:
        """Return how a process crashes in a transaction: by an error of the disk, or killed."""
        return (
            FatalStorageError
            if self._has_errors and self._rng.random() < _ERROR_SHARE
            else CrashError
        )


class SimulatedStore(RobotStore):
    """The store of one incarnation. It reports to the checker what is on the disk."""

    def attach(
        self, robot: RobotId, disk: Disk, countdown: CrashCountdown, checker: InvariantChecker
    ) -> None:
        """Inject the faults of a disk and a countdown from now on."""
        self._robot_id, self._disk = robot, disk
        self._countdown, self._checker = countdown, checker

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[StoreState]:
        if not self._disk.has_room():
            raise StorageFullError("no room")
        with super()._transaction() as state:
            yield state
            self._count_operation()

    def _count_operation(self) -> None:
        try:
            self._countdown.count(self._disk.crash_error())
        except CrashError:
            self._connection.close()  # no orderly rollback: the process is killed
            raise

    def begin_incarnation(self, unix_s: int) -> int:
        """Count this start."""
        incarnation = super().begin_incarnation(unix_s)
        self._count_operation()
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
        self._count_operation()

    def save(self, robot: Mapping[str, Any], events: Sequence[Event], tick: int) -> None:
        """Write a snapshot."""
        super().save(robot, events, tick)
        self._checker.on_saved(self._robot_id, events)
        self._count_operation()

    def abandon(self) -> None:
        """Close the file as a killed process does: without a commit and without cleaning up."""
        self._is_broken = True
        self.close()
