"""The recording of a live dashboard: received telemetry and what was drawn, in the folder of the colony that it shows.

Which colony that is, is known when the first robot is online. What was received before waits in memory.
"""

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.recordings.retention import Retention
from crcolony.recordings.telemetry_file import TELEMETRY_FILE, RecordingInUseError, TelemetryFile
from crcolony.telemetry.samples import RawSample
from crcolony_dashboards.rrd_file import MAX_BYTES, RrdFile, open_rrd, optimize_rrd

if TYPE_CHECKING:
    import rerun.blueprint as rrb

RRD_FILE = "dashboard.rrd"
_MAX_WAITING = 10_000
"""Samples that wait until it is known where to record"""


class Recording:
    """A telemetry file and an .rrd; a folder that another dashboard records into is left alone.

    With `keep_s` states and poses are kept for so long, and there is no .rrd: of that nothing can be deleted.
    """

    def __init__(self, run: str, keep_s: float | None = None) -> None:
        self._keep_s = keep_s
        self.run = run
        """The id of the recording"""
        self.rrd: RrdFile | None = None
        self.is_decided = False
        """Whether it has been opened, or is not to be"""
        self._telemetry: TelemetryFile | None = None
        self._waiting: deque[RawSample] = deque(maxlen=_MAX_WAITING)

    def add(self, sample: RawSample) -> None:
        """Record a sample, now or when the recording is opened."""
        if self._telemetry is not None:
            self._telemetry.add(sample)
        elif not self.is_decided:
            self._waiting.append(sample)

    def open(self, folder: Path, blueprint: "rrb.Blueprint") -> str:
        """Open the recording in a folder; return what to print. Raises TelemetryError, DashboardError."""
        self.is_decided = True
        try:
            retention = Retention(self._keep_s) if self._keep_s is not None else None
            self._telemetry = TelemetryFile.open(folder / TELEMETRY_FILE, retention)
        except RecordingInUseError:
            self._waiting.clear()
            return f"another dashboard records into {folder}: not recorded twice"
        while self._waiting:
            self._telemetry.add(self._waiting.popleft())
        if self._keep_s is not None:
            return f"recorded into {folder}: events for good, the rest for {self._keep_s / 3600.0:g} hours"
        self.rrd = open_rrd(unused_path(folder / RRD_FILE), self.run, blueprint)
        return f"recorded into {folder}"

    def leave_out(self) -> None:
        """Record nothing."""
        self.is_decided = True

    def commit(self) -> list[str]:
        """Write to the disk what was received and drawn; return why a part has ended, once."""
        errors = [self.rrd.check() if self.rrd else None]
        errors.append(self._telemetry.commit() if self._telemetry else None)
        return [error for error in errors if error]

    def close(self, print_line: Callable[[str], None]) -> None:
        """Close both files, and optimize the .rrd unless it is incomplete or that would take long."""
        is_complete = self.rrd is not None and self.rrd.stream is not None
        if self.rrd is not None:
            self.rrd.close()
            if is_complete and self.rrd.path.stat().st_size < MAX_BYTES:
                optimize_rrd(self.rrd.path)
        error = self._telemetry.close() if self._telemetry is not None else None
        if error is not None:
            print_line(error)


def unused_path(path: Path) -> Path:
    """Return the path, or if it exists, the first that does not with `-2`, `-3` and so on before its suffix."""
    number, unused = 1, path
    while unused.exists():
        number += 1
        unused = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return unused
