"""Where the dashboard is drawn: a Rerun server that viewers connect to, and a recording on disk (.rrd).

Both are recording streams of the same recording id. The live one is flushed ten times a second; the one on disk has
longer chunks, which makes it a tenth of the size, and may end (on a full disk) before the live one. Nothing here waits
for a viewer. All calls must be made by one thread: Rerun keeps the current time per thread.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from crcolony_dashboards.preconditions import check_port_is_free
from crcolony_dashboards.rrd_file import RrdFile, close_stream, new_stream

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

SERVER_MEMORY = "256MB"
"""Of the server for viewers that connect late; when it is full the oldest data are dropped"""
_LIVE_FLUSH_S = 0.1
ARENA_TIMELINE = "arena"
"""The colony's own time during the stretch of a past run that a replay opens with"""
TIMELINES = ("wall", "sim", "generation", ARENA_TIMELINE)


@dataclass(frozen=True)
class Moment:
    """The time of a drawing on the timelines."""

    unix_s: float
    sim_s: float
    """The colony's own time; 0 before it is known"""
    generation: int


class RerunStreams:
    """Logs to all streams at once."""

    def __init__(self, live: "rr.RecordingStream | None", rrd: "RrdFile | None") -> None:
        self.rrd = rrd
        self._streams = [live] if live is not None else []

    def set_time(self, moment: Moment) -> None:
        """Set the time of everything that is logged next."""
        for stream in self._all():
            stream.set_time("wall", timestamp=moment.unix_s)
            stream.set_time("generation", sequence=moment.generation)
            stream.set_time("sim", duration=moment.sim_s)

    def log(self, path: str, *components: Any, static: bool = False) -> None:
        """Log archetypes to an entity, replacing what it showed; static data are valid at all times."""
        for stream in self._all():
            stream.log(path, *components, static=static, strict=True)

    def close(self) -> None:
        """Close all streams, without waiting for a viewer that has stalled."""
        for stream in self._streams:
            close_stream(stream)
        if self.rrd is not None:
            self.rrd.close()

    def _all(self) -> "Sequence[rr.RecordingStream]":
        rrd = self.rrd.stream if self.rrd is not None else None
        return [*self._streams, rrd] if rrd is not None else self._streams


def open_live(port: int, run: str, blueprint: "rrb.Blueprint") -> tuple["rr.RecordingStream", str]:
    """Return a stream that viewers of this machine can connect to, and its URL.

    Raises DashboardError if the port is taken. Rerun allows one such server per process.
    """
    import rerun as rr

    check_port_is_free(port, "--port")
    stream = new_stream(run, _LIVE_FLUSH_S)
    sink = rr.GrpcServerSink("127.0.0.1", port, server_memory_limit=SERVER_MEMORY)
    stream.set_sinks(sink, default_blueprint=blueprint)
    return stream, f"rerun+http://127.0.0.1:{port}/proxy"
