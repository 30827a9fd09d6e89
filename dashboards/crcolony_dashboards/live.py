"""The dashboard of colonies that live: a process that listens, draws, and is in nobody's way.

What is heard waits in a queue until the one thread that draws takes it, ten times a second. Robots and arenas only
publish, whether anybody listens or not; a dashboard may come late, stall, be killed and come back.
"""

import contextlib
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from crcolony.recordings.telemetry_file import TELEMETRY_FILE, TelemetryFile
from crcolony.shutdown import ShutdownSignal
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.zenoh_session import NetworkSettings, open_session
from crcolony_dashboards.dashboard import Dashboard
from crcolony_dashboards.rerun_check import check_rerun
from crcolony_dashboards.rerun_streams import RerunStreams, open_live
from crcolony_dashboards.rrd_file import MAX_BYTES, leave, open_film, optimize_rrd
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.viewers import Viewer, open_browser, open_native, serve_web

FILM = "dashboard.rrd"
_PERIOD_S = 0.1
_GONE_S = 2.0
_HISTORY = 1_000
"""Events before its coming that a dashboard asks every robot for"""


@dataclass(frozen=True)
class DashboardOptions:
    """What to watch, and how to show it."""

    network: NetworkSettings
    colony: str
    port: int
    folder: Path | None
    """Where it is recorded; None: nowhere"""
    web_port: int | None = None
    """None: no web viewer"""
    native: bool = False
    agent: str = ""
    """Whose potentials are drawn; empty: the best one's"""
    minutes: float | None = None


def run_dashboard(watching: DashboardOptions) -> None:
    """Watch until told to stop. Raises Refusal if the dashboard cannot be shown."""
    check_rerun()
    woken = threading.Event()
    stop = ShutdownSignal(watching.minutes, wake=woken.set)
    with contextlib.ExitStack() as open_things:
        session = open_things.enter_context(open_session(watching.network))
        sample = _telemetry(watching)
        if sample is not None:
            open_things.callback(_end_recording, sample)
        subscriber = TelemetrySubscriber(
            session,
            watching.colony,
            sends_requests=True,
            history=_HISTORY,
            on_raw_sample=sample.add if sample is not None else lambda raw: None,
        )
        dashboard = Dashboard(subscriber.monitor, watching.agent)
        streams, url = _streams(watching, dashboard)
        open_things.callback(_end_showing, streams)
        viewers = open_things.enter_context(_viewers(watching, url))
        _print_line(f"dashboard at {url}")
        _monitor(subscriber, dashboard, streams, sample, viewers, stop, woken)
    leave(streams.rrd)


def _monitor(
    subscriber: TelemetrySubscriber,
    dashboard: Dashboard,
    streams: RerunStreams,
    sample: TelemetryFile | None,
    viewers: list[Viewer],
    stop: Callable[[], bool],
    woken: threading.Event,
) -> None:
    """Draw ten times a second; say who has come and gone, and what has failed."""
    dashboard.setup(streams)
    upkeep, presence = Throttle(2.0), ColonyAnnouncer()
    next_s = time.monotonic()
    while not stop():
        now_s = time.time()
        dashboard.handle_changes(subscriber.poll(), now_s)
        dashboard.draw(streams, now_s)
        colonies = {status.colony for status in dashboard.view.alive}
        for line in presence.changes(colonies, now_s):
            _print_line(line)
        if upkeep.is_due(now_s):
            trouble = [streams.rrd.check() if streams.rrd else None]
            trouble.append(sample.commit() if sample else None)
            for what in filter(None, trouble):
                _print_line(what)
            for viewer in [viewer for viewer in viewers if viewer.ended is not None]:
                viewers.remove(viewer)
                _print_line("the viewer was closed; the dashboard goes on")
        next_s = max(next_s + _PERIOD_S, time.monotonic())
        woken.wait(next_s - time.monotonic())


class ColonyAnnouncer:
    """Tells who is there to be watched. Somebody who is gone for a moment only was always there."""

    def __init__(self) -> None:
        self._said: set[str] | None = None
        self._there_s: dict[str, float] = {}

    def changes(self, colonies: set[str], now_s: float) -> list[str]:
        """Return what to say about it, if that has changed."""
        self._there_s |= dict.fromkeys(colonies, now_s)
        there = {name for name, seen_s in self._there_s.items() if now_s - seen_s < _GONE_S}
        said, self._said = self._said, there
        if there == said:
            return []
        new = [f"watching {name}" for name in sorted(there - (said or set()))]
        if there or said is None:
            return new or ["no colony on the network yet; looking …"] * (not there)
        return ["nobody is there any more; looking …"]


def _streams(watching: DashboardOptions, dashboard: Dashboard) -> tuple[RerunStreams, str]:
    blueprint = dashboard.blueprint("wall", is_live=True)
    run = f"crcolony-{uuid.uuid4().hex[:8]}"
    live, url = open_live(watching.port, run, blueprint)
    rrd = None
    if watching.folder is not None:
        rrd = open_film(free_name(watching.folder / FILM), run, blueprint)
        _print_line(f"recorded into {watching.folder}")
    return RerunStreams(live, rrd), url


def _end_showing(streams: RerunStreams) -> None:
    """Close all streams, and put the film in order unless that would take long."""
    is_whole = streams.rrd is not None and streams.rrd.stream is not None
    streams.close()
    rrd = streams.rrd.path if streams.rrd is not None and is_whole else None
    if rrd is not None and rrd.stat().st_size < MAX_BYTES:
        optimize_rrd(rrd)


def _end_recording(sample: TelemetryFile) -> None:
    trouble = sample.close()
    if trouble is not None:
        _print_line(trouble)


def _telemetry(watching: DashboardOptions) -> TelemetryFile | None:
    return TelemetryFile.open(watching.folder / TELEMETRY_FILE) if watching.folder else None


@contextlib.contextmanager
def _viewers(watching: DashboardOptions, url: str) -> Iterator[list[Viewer]]:
    """The viewers that were asked for; they are closed when this is left."""
    viewers: list[Viewer] = []
    try:
        if watching.web_port is not None:
            viewer, address = serve_web(url, watching.web_port)
            viewers.append(viewer)
            is_open = open_browser(address)
            _print_line(f"{'opened' if is_open else 'open'} in a browser: {address}")
        if watching.native:
            viewers.append(open_native(url))
        yield viewers
    finally:
        for viewer in viewers:
            viewer.close()


def free_name(path: Path) -> Path:
    """Return a path, or one with the next number if there is such a file already."""
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return free


def _print_line(line: str) -> None:
    print(line, flush=True, file=sys.stdout)
