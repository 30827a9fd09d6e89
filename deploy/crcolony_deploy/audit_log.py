"""The audit log: what operators did to a colony, one signed record a line, each with the digest of the one before.

Files beside it with .1, .2, … are its earlier parts. A command that records is never kept from its work by damage in
the log: it appends, and `crcolony audit verify` shows the damage.
"""

import contextlib
import fcntl
import getpass
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from crcolony.errors import CrcolonyError
from crcolony.protocol.identity import Identity
from crcolony_deploy.audit_record import (
    AuditRecord,
    decode_record,
    digest_of_line,
    encode_record,
    make_record,
)

MAX_BYTES = 8 * 2**20
"""A larger file becomes an earlier part: about 16,000 records."""
MAX_PARTS = 10
"""Earlier parts that are kept; the oldest is deleted, and a record says so."""
ROTATED = "audit rotated"
"""The action of that record; its detail `deleted_up_to` is the last record that is gone, 0 for none."""


class AuditError(CrcolonyError):
    """The audit log cannot be read or written: the message names the file and the reason."""


class AuditLog:
    """Appends to one log, signed by one key; several processes may do so at the same time."""

    def __init__(
        self, path: Path, identity: Identity, clock: Callable[[], float] = time.time
    ) -> None:
        self.path = path
        self._identity, self._clock = identity, clock

    def check_writable(self) -> None:
        """Raise AuditError if nothing can be appended now."""
        try:
            with self._locked():
                os.close(_open_log(self.path))
        except OSError as error:
            raise self._not_written(error) from None

    def append(self, action: str, details: Mapping[str, str]) -> AuditRecord:
        """Append a record, which is on the disk when this returns; raises AuditError."""
        try:
            with self._locked():
                if self.path.exists() and self.path.stat().st_size > MAX_BYTES:
                    self._rotate()
                return self._append(action, details)
        except OSError as error:
            raise self._not_written(error) from None

    def _append(self, action: str, details: Mapping[str, str]) -> AuditRecord:
        seq, last = _end_of(self.path)
        record = make_record(
            self._identity,
            seq + 1,
            time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(self._clock())),
            operator(),
            action,
            details,
            digest_of_line(last) if last is not None else "",
        )
        descriptor = _open_log(self.path)
        try:
            data = encode_record(record) + b"\n"
            if not _ends_a_line(descriptor):
                data = b"\n" + data  # after a power cut; the part of a line is covered by the chain
            before = os.fstat(descriptor).st_size
            if os.write(descriptor, data) < len(data):
                os.ftruncate(descriptor, before)
                raise OSError(28, "No space left on device")
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        return record

    def _rotate(self) -> None:
        """Let the present file be part 1, and begin a new one with a record that says what was deleted."""
        deleted_up_to = 0
        oldest = part(self.path, MAX_PARTS)
        if oldest.exists():
            deleted_up_to, _ = _end_of_file(oldest)
            oldest.unlink()
        for number in range(MAX_PARTS - 1, 0, -1):
            if part(self.path, number).exists():
                part(self.path, number).rename(part(self.path, number + 1))
        self.path.rename(part(self.path, 1))
        self._append(ROTATED, {"deleted_up_to": str(deleted_up_to)})

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        lock = os.open(self.path.with_name(self.path.name + ".lock"), os.O_RDWR | os.O_CREAT, 0o640)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield
        finally:
            os.close(lock)

    def _not_written(self, error: OSError) -> AuditError:
        return AuditError(f"{self.path}: not in the audit log: {error.strerror}")


def record_action(log: AuditLog | None, action: str, **details: object) -> AuditRecord | None:
    """Append what an operator did, if there is a log; raises AuditError."""
    if log is None:
        return None
    return log.append(action, {name: str(value) for name, value in details.items()})


def part(path: Path, number: int) -> Path:
    """Return the path of an earlier part of a log; the present file is part 0."""
    return path.with_name(f"{path.name}.{number}") if number else path


def parts(path: Path) -> list[Path]:
    """Return the files of a log that are there, the oldest first."""
    return [part(path, k) for k in range(MAX_PARTS, -1, -1) if part(path, k).exists()]


def read_lines(path: Path) -> Iterator[tuple[Path, int, bytes]]:
    """Yield every line of a log, with its file and its number in it; raises AuditError."""
    files = parts(path)
    if not files:
        raise AuditError(f"{path}: there is no such file")
    for file in files:
        try:
            lines = file.read_bytes().split(b"\n")
        except OSError as error:
            raise AuditError(f"{file}: cannot be read: {error.strerror}") from None
        for number, line in enumerate(lines, 1):
            if line or number < len(lines):
                yield file, number, line


def operator() -> str:
    """Return who runs this process: user@host, and who became root by sudo."""
    try:
        user = getpass.getuser()
    except (OSError, KeyError):  # a user without a name, as in a container
        user = str(os.getuid())
    former = os.environ.get("SUDO_USER")
    return f"{user}{f' (sudo by {former})' if former else ''}@{socket.gethostname()}"


def _open_log(path: Path) -> int:
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o640)


def _ends_a_line(descriptor: int) -> bool:
    size = os.fstat(descriptor).st_size
    return size == 0 or os.pread(descriptor, 1, size - 1) == b"\n"


def _end_of(path: Path) -> tuple[int, bytes | None]:
    """Return the number of the last record of a log, and its last line, which may be damaged; None: it is empty."""
    for file in reversed(parts(path)):
        seq, last = _end_of_file(file)
        if last is not None:
            return seq, last
    return 0, None


def _end_of_file(file: Path) -> tuple[int, bytes | None]:
    data = file.read_bytes()
    lines = data.removesuffix(b"\n").split(b"\n") if data else []
    records = (decode_record(line) for line in reversed(lines))
    seq = next((record.seq for record in records if record is not None), 0)
    return seq, lines[-1] if lines else None
