"""Where the dashboard is drawn: a Rerun server that viewers come and go to, and a film of it on disk.

They are two recording streams of one name. The live one is flushed ten times a second. The film has longer chunks, so
that it is a tenth of the size, and may end (on a full disk) while the live one goes on. Nothing here ever waits for a
viewer. All of it belongs to one thread: Rerun's clock is the thread's.
"""

import contextlib
import os
import socket
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from crcolony.dashboards.disk import check_room
from crcolony.errors import EXIT_OK, EXIT_WRONG_INPUT, Refusal

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

WANTED = (0, 41)
"""The version of Rerun that this is written for; every minor one changes something"""
SERVER_MEMORY = "256MB"
"""What late viewers get to see of the past; then the oldest is forgotten"""
_LIVE_FLUSH_S, _FILM_FLUSH_S = 0.1, 2.0
_CLOSING_S = 3.0


class DashboardError(Refusal):
    """The dashboard cannot be shown: the message says why."""


def check_rerun() -> None:
    """Raise DashboardError unless Rerun is here in the version that is wanted."""
    wanted = ".".join(map(str, WANTED))
    try:
        found = version("rerun-sdk")
    except PackageNotFoundError:
        raise DashboardError(
            "the dashboard needs Rerun, which is not installed: pip install 'crcolony[viz]'"
        ) from None
    if tuple(map(int, found.split(".")[:2])) != WANTED:
        raise DashboardError(
            f"the dashboard needs Rerun {wanted}, but {found} is installed: pip install 'crcolony[viz]'"
        )
    os.environ.setdefault("RUST_LOG", "off")  # what goes wrong in there is said here, in words
    try:
        import rerun
    except ImportError as error:
        raise DashboardError(f"Rerun {found} does not load: {error}") from None
    assert rerun.__version__


@dataclass(frozen=True)
class Moment:
    """When something is drawn, on the three timelines."""

    unix_s: float
    sim_s: float
    """The colony's own time; 0 before any is known"""
    generation: int


class Stage:
    """Draws on all streams at once."""

    def __init__(self, live: "rr.RecordingStream | None", film: "Film | None") -> None:
        self.film = film
        self._streams = [live] if live is not None else []

    def at(self, moment: Moment) -> None:
        """Say when what follows is."""
        for stream in self._all():
            stream.set_time("wall", timestamp=moment.unix_s)
            stream.set_time("generation", sequence=moment.generation)
            stream.set_time("sim", duration=moment.sim_s)

    def draw(self, path: str, *what: Any, static: bool = False) -> None:
        """Draw something, in place of what was there."""
        for stream in self._all():
            stream.log(path, *what, static=static, strict=True)

    def close(self) -> None:
        """End all streams; a viewer that does not listen is not waited for."""
        for stream in self._streams:
            _close(stream)
        if self.film is not None:
            self.film.close()

    def _all(self) -> "Sequence[rr.RecordingStream]":
        film = self.film.stream if self.film is not None else None
        return [*self._streams, film] if film is not None else self._streams


class Film:
    """A recording on disk (.rrd), as long as there is room for it."""

    def __init__(self, path: Path, stream: "rr.RecordingStream") -> None:
        self.path = path
        self.stream: rr.RecordingStream | None = stream
        self._stuck: rr.RecordingStream | None = None

    @property
    def is_stuck(self) -> bool:
        """Whether Rerun waits for ever for what it cannot write; a process with such a film must `leave`."""
        return self._stuck is not None

    def trouble(self) -> str | None:
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
            _close(self.stream)
            self.stream = None

    def _end(self, why: str) -> str:
        self.close()
        return f"{self.path}: not recorded any more: {why}"


def leave(film: Film | None, why: str = "") -> None:
    """End this process at once if its film is stuck, for it would not end otherwise; everything else is closed."""
    if film is None or not film.is_stuck:
        return
    if why:
        print(f"crcolony: {why}", file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(EXIT_WRONG_INPUT if why else EXIT_OK)


def open_live(port: int, run: str, blueprint: "rrb.Blueprint") -> tuple["rr.RecordingStream", str]:
    """Return a stream that viewers of this machine can come to, and where; raises DashboardError if the port is taken.

    There is one such server in the life of a process.
    """
    import rerun as rr

    check_port(port, "--port")
    stream = _stream(run, _LIVE_FLUSH_S)
    sink = rr.GrpcServerSink("127.0.0.1", port, server_memory_limit=SERVER_MEMORY)
    stream.set_sinks(sink, default_blueprint=blueprint)
    return stream, f"rerun+http://127.0.0.1:{port}/proxy"


def open_film(path: Path, run: str, blueprint: "rrb.Blueprint") -> Film:
    """Return a film that begins now; raises DashboardError if the file cannot be written."""
    import rerun as rr

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("wb").close()
    except OSError as error:
        raise DashboardError(f"{path}: cannot be written: {error.strerror}") from None
    stream = _stream(run, _FILM_FLUSH_S)
    # A footer would keep something of every chunk in memory, for hours; `films.put_in_order` adds it in the end.
    stream.set_sinks(rr.FileSink(str(path), write_footer=False), default_blueprint=blueprint)
    return Film(path, stream)


def _stream(run: str, flush_s: float) -> "rr.RecordingStream":
    import rerun as rr

    config = rr.ChunkBatcherConfig(flush_tick=flush_s)
    stream = rr.RecordingStream("crcolony", recording_id=run, batcher_config=config)
    stream.set_log_time_enabled(False)
    return stream


def _close(stream: "rr.RecordingStream") -> None:
    # A full disk, or a viewer that does not listen: it was said before, or does not matter.
    with contextlib.suppress(RuntimeError, ValueError):
        stream.flush(timeout_sec=_CLOSING_S)
    stream.disconnect()


def check_port(port: int, option: str) -> None:
    """Raise DashboardError if a port of this machine is taken, naming the option that chooses another."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            raise DashboardError(
                f"127.0.0.1:{port}: {(error.strerror or str(error)).lower()};"
                f" choose another with {option}"
            ) from None
