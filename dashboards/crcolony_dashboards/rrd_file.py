"""The recording of a dashboard on disk (.rrd): written as long as there is room, and optimized when it is complete."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.errors import EXIT_OK, EXIT_WRONG_INPUT
from crcolony.recordings.disk_space import check_room
from crcolony_dashboards.preconditions import DashboardError
from crcolony_dashboards.viewers import rerun_program

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

MAX_BYTES = 256 * 2**20
"""A larger recording is not optimized when a dashboard is stopped, since that would take long"""
_FLUSH_S = 2.0
"""How often chunks are written"""
_CLOSE_TIMEOUT_S = 3.0
_OPTIMIZE_TIMEOUT_S = 600.0
_MAGIC = b"RRF2"
"""The first bytes of every recording; of any other file Rerun would make an empty recording"""


def optimize_rrd(rrd: Path) -> None:
    """Rewrite a recording with an index and several times smaller; if that fails it stays as it is."""
    draft = rrd.with_name(rrd.name + ".draft")
    command = [str(rerun_program()), "rrd", "optimize", str(rrd), "-o", str(draft)]
    try:
        with rrd.open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                return
        done = subprocess.run(
            command, capture_output=True, timeout=_OPTIMIZE_TIMEOUT_S, check=False
        )
        if done.returncode == 0 and draft.is_file():
            draft.replace(rrd)
    except (OSError, subprocess.TimeoutExpired):
        return
    finally:
        draft.unlink(missing_ok=True)


class RrdFile:
    """A recording that ends by itself when the disk is full."""

    def __init__(self, path: Path, stream: "rr.RecordingStream") -> None:
        self.path = path
        self.stream: rr.RecordingStream | None = stream
        self._stuck: rr.RecordingStream | None = None

    @property
    def is_stuck(self) -> bool:
        """Whether Rerun would wait forever for a failed write; such a process must call `exit_if_stuck`."""
        return self._stuck is not None

    def check(self) -> str | None:
        """Check free disk space and flush; if that fails, end the recording and return why, once."""
        if self.stream is None:
            return None
        try:
            check_room(self.path.parent)
        except OSError as error:
            return self._end(error.strerror or str(error))
        try:
            self.stream.flush(timeout_sec=_CLOSE_TIMEOUT_S)
        except (RuntimeError, ValueError) as error:
            # The writing thread has failed, and closing would wait for it.
            self._stuck, self.stream = self.stream, None
            return self._end(f"cannot be written: {error}")
        return None

    def close(self) -> None:
        """End the recording."""
        if self.stream is not None:
            close_stream(self.stream)
            self.stream = None

    def _end(self, why: str) -> str:
        self.close()
        return f"{self.path}: not recorded any more: {why}"


def exit_if_stuck(rrd: RrdFile | None, error: str = "") -> None:
    """Exit this process at once if its recording is stuck, since it would never end otherwise.

    Everything else must be closed before. The exit code is that of a failure if there is an error, which is printed.
    """
    if rrd is None or not rrd.is_stuck:
        return
    if error:
        print(f"crcolony: {error}", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(EXIT_WRONG_INPUT if error else EXIT_OK)


def open_rrd(path: Path, run: str, blueprint: "rrb.Blueprint") -> RrdFile:
    """Start a recording in place of the file at `path`; raises DashboardError if it cannot be written."""
    import rerun as rr

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("wb").close()
    except OSError as error:
        raise DashboardError(f"{path}: cannot be written: {error.strerror}") from None
    stream = new_stream(run, _FLUSH_S)
    # For a footer Rerun would keep data of every chunk in memory, for hours; `optimize_rrd` adds it in the end.
    stream.set_sinks(rr.FileSink(str(path), write_footer=False), default_blueprint=blueprint)
    return RrdFile(path, stream)


def new_stream(run: str, flush_s: float) -> "rr.RecordingStream":
    """Return a recording stream with recording id `run` that flushes its chunks at a fixed interval."""
    import rerun as rr

    config = rr.ChunkBatcherConfig(flush_tick=flush_s)
    stream = rr.RecordingStream("crcolony", recording_id=run, batcher_config=config)
    stream.set_log_time_enabled(False)
    return stream


def close_stream(stream: "rr.RecordingStream") -> None:
    """Flush a stream and close it, also if it cannot be flushed."""
    # A full disk was reported before, and a stalled viewer does not matter.
    with contextlib.suppress(RuntimeError, ValueError):
        stream.flush(timeout_sec=_CLOSE_TIMEOUT_S)
    stream.disconnect()
