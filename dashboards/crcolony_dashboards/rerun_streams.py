"""Where the dashboard is drawn: a Rerun server that viewers come and go to, and a film of it on disk.

They are two recording streams of one name. The live one is flushed ten times a second. The film has longer chunks, so
that it is a tenth of the size, and may end (on a full disk) while the live one goes on. Nothing here ever waits for a
viewer. All of it belongs to one thread: Rerun's clock is the thread's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from crcolony_dashboards.rerun_check import check_port
from crcolony_dashboards.rrd_file import RrdFile, close_stream, new_stream

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

SERVER_MEMORY = "256MB"
"""What late viewers get to see of the past; then the oldest is forgotten"""
_LIVE_FLUSH_S = 0.1


@dataclass(frozen=True)
class Moment:
    """When something is drawn, on the three timelines."""

    unix_s: float
    sim_s: float
    """The colony's own time; 0 before any is known"""
    generation: int


class RerunStreams:
    """Draws on all streams at once."""

    def __init__(self, live: "rr.RecordingStream | None", rrd: "RrdFile | None") -> None:
        self.rrd = rrd
        self._streams = [live] if live is not None else []

    def set_time(self, moment: Moment) -> None:
        """Say when what follows is."""
        for stream in self._all():
            stream.set_time("wall", timestamp=moment.unix_s)
            stream.set_time("generation", sequence=moment.generation)
            stream.set_time("sim", duration=moment.sim_s)

    def log(self, path: str, *what: Any, static: bool = False) -> None:
        """Draw something, in place of what was there."""
        for stream in self._all():
            stream.log(path, *what, static=static, strict=True)

    def close(self) -> None:
        """End all streams; a viewer that does not listen is not waited for."""
        for stream in self._streams:
            close_stream(stream)
        if self.rrd is not None:
            self.rrd.close()

    def _all(self) -> "Sequence[rr.RecordingStream]":
        rrd = self.rrd.stream if self.rrd is not None else None
        return [*self._streams, rrd] if rrd is not None else self._streams


def open_live(port: int, run: str, blueprint: "rrb.Blueprint") -> tuple["rr.RecordingStream", str]:
    """Return a stream that viewers of this machine can come to, and where; raises DashboardError if the port is taken.

    There is one such server in the life of a process.
    """
    import rerun as rr

    check_port(port, "--port")
    stream = new_stream(run, _LIVE_FLUSH_S)
    sink = rr.GrpcServerSink("127.0.0.1", port, server_memory_limit=SERVER_MEMORY)
    stream.set_sinks(sink, default_blueprint=blueprint)
    return stream, f"rerun+http://127.0.0.1:{port}/proxy"
