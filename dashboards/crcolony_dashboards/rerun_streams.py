"""Where the dashboard is drawn: a Rerun server that viewers come and go to, and a film of it on disk.

They are two recording streams of one name. The live one is flushed ten times a second. The film has longer chunks, so
that it is a tenth of the size, and may end (on a full disk) while the live one goes on. Nothing here ever waits for a
viewer. All of it belongs to one thread: Rerun's clock is the thread's.
"""

import contextlib
import os
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from crcolony.errors import Refusal
from crcolony_dashboards.rrd_file import Film

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
