"""Films that are over: with the index that viewers seek by, and several times smaller."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.errors import EXIT_OK, EXIT_WRONG_INPUT
from crcolony.recordings.disk_space import check_room
from crcolony_dashboards.rerun_check import DashboardError

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

from crcolony_dashboards.viewers import rerun_program

MAX_BYTES = 256 * 2**20
"""Of a film that is put in order while somebody waits"""
_FLUSH_S, _CLOSING_S = 2.0, 3.0
_PATIENCE_S = 600.0
_BEGINNING = b"RRF2"
"""Of every film; of anything else Rerun would make an empty one"""


def optimize_rrd(rrd: Path) -> None:
    """Rewrite a film with its index; where that fails it stays as it is, and can be seen all the same."""
    draft = rrd.with_name(rrd.name + ".draft")
    command = [str(rerun_program()), "rrd", "optimize", str(rrd), "-o", str(draft)]
    try:
        with rrd.open("rb") as file:
            if file.read(len(_BEGINNING)) != _BEGINNING:
                return
        done = subprocess.run(command, capture_output=True, timeout=_PATIENCE_S, check=False)
        if done.returncode == 0 and draft.is_file():
            draft.replace(rrd)
    except (OSError, subprocess.TimeoutExpired):
        return
    finally:
        draft.unlink(missing_ok=True)


class RrdFile:
    """A recording on disk (.rrd), as long as there is room for it."""

    def __init__(self, path: Path, stream: "rr.RecordingStream") -> None:
        self.path = path
        self.stream: rr.RecordingStream | None = stream
        self._stuck: rr.RecordingStream | None = None

    @property
    def is_stuck(self) -> bool:
        """Whether Rerun waits for ever for what it cannot write; a process with such a film must `leave`."""
        return self._stuck is not None

    def check(self) -> str | None:
        """Look after the disk, now and then; end the film where it is full and return why, once."""
        if self.stream is None:
            return None
        try:
            check_room(self.path.parent)
        except OSError as error:
            return self._end(error.strerror or str(error))
        try:
            self.stream.flush(timeout_sec=_CLOSING_S)
        except (RuntimeError, ValueError) as error:
            # The thread that writes has failed, and closing would wait for it.
            self._stuck, self.stream = self.stream, None
            return self._end(f"cannot be written: {error}")
        return None

    def close(self) -> None:
        """End the film."""
        if self.stream is not None:
            close_stream(self.stream)
            self.stream = None

    def _end(self, why: str) -> str:
        self.close()
        return f"{self.path}: not recorded any more: {why}"


def leave(rrd: RrdFile | None, why: str = "") -> None:
    """End this process at once if its film is stuck, for it would not end otherwise; everything else is closed."""
    if rrd is None or not rrd.is_stuck:
        return
    if why:
        print(f"crcolony: {why}", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(EXIT_WRONG_INPUT if why else EXIT_OK)


def open_film(path: Path, run: str, blueprint: "rrb.Blueprint") -> RrdFile:
    """Return a film that begins now; raises DashboardError if the file cannot be written."""
    import rerun as rr

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("wb").close()
    except OSError as error:
        raise DashboardError(f"{path}: cannot be written: {error.strerror}") from None
    stream = new_stream(run, _FLUSH_S)
    # A footer would keep something of every chunk in memory, for hours; `films.optimize_rrd` adds it in the end.
    stream.set_sinks(rr.FileSink(str(path), write_footer=False), default_blueprint=blueprint)
    return RrdFile(path, stream)


def new_stream(run: str, flush_s: float) -> "rr.RecordingStream":
    """Return a recording stream that flushes its chunks at a fixed interval."""
    import rerun as rr

    config = rr.ChunkBatcherConfig(flush_tick=flush_s)
    stream = rr.RecordingStream("crcolony", recording_id=run, batcher_config=config)
    stream.set_log_time_enabled(False)
    return stream


def close_stream(stream: "rr.RecordingStream") -> None:
    """Flush a stream and let it go; a stream that cannot be flushed is let go all the same."""
    # A full disk, or a viewer that does not listen: it was said before, or does not matter.
    with contextlib.suppress(RuntimeError, ValueError):
        stream.flush(timeout_sec=_CLOSING_S)
    stream.disconnect()
