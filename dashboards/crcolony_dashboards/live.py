"""The dashboard of live colonies: it subscribes to their telemetry, draws ten times a second, and never blocks them.

Received samples wait in a queue until the single drawing thread processes them. Robots and arenas publish whether or
not anybody subscribes, so a dashboard may start late, stall, be killed and restart.
"""

import contextlib
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
from crcolony_dashboards.colony_announcer import ColonyAnnouncer
from crcolony_dashboards.dashboard import Dashboard
from crcolony_dashboards.preconditions import check_rerun
from crcolony_dashboards.rerun_streams import RerunStreams, open_live
from crcolony_dashboards.rrd_file import MAX_BYTES, exit_if_stuck, open_rrd, optimize_rrd
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.viewers import Viewer, open_browser, open_native, serve_web

RRD_FILE = "dashboard.rrd"
_DRAW_PERIOD_S = 0.1
_UPKEEP_PERIOD_S = 2.0
"""How often recordings are written to disk and viewers are checked"""
_HISTORY = 1_000
"""Earlier events that are requested from every robot"""


@dataclass(frozen=True)
class DashboardOptions:
    """What a dashboard subscribes to, and how it is shown."""

    network: NetworkSettings
    colony: str
    """Name of the colony; `*` for all"""
    port: int
    """That viewers connect to"""
    folder: Path | None
    """Where the dashboard is recorded; None for no recording"""
    web_port: int | None = None
    """Port of the web viewer; None for no web viewer"""
    native: bool = False
    """Whether to open the native viewer"""
    agent: str = ""
    """The agent whose potentials are drawn; empty for the best one"""
    minutes: float | None = None
    """Stop after this time; None for never"""


def run_dashboard(options: DashboardOptions) -> None:
    """Run a dashboard until a signal stops it. Raises DashboardError if it cannot be shown."""
    check_rerun()
    wake = threading.Event()
    should_stop = ShutdownSignal(options.minutes, wake=wake.set)
    with contextlib.ExitStack() as stack:
        session = stack.enter_context(open_session(options.network))
        telemetry_file = _open_telemetry_file(options)
        if telemetry_file is not None:
            stack.callback(_close_telemetry_file, telemetry_file)
        subscriber = TelemetrySubscriber(
            session,
            options.colony,
            sends_requests=True,
            history=_HISTORY,
            on_raw_sample=telemetry_file.add if telemetry_file is not None else lambda raw: None,
        )
        dashboard = Dashboard(subscriber.monitor, options.agent)
        streams, url = _open_streams(options, dashboard)
        stack.callback(_close_streams, streams)
        viewers = stack.enter_context(_open_viewers(options, url))
        _print_line(f"dashboard at {url}")
        upkeep = _Upkeep(streams, telemetry_file, viewers)
        _draw_until_stopped(subscriber, dashboard, streams, upkeep, should_stop, wake)
    exit_if_stuck(streams.rrd)


def _draw_until_stopped(
    subscriber: TelemetrySubscriber,
    dashboard: Dashboard,
    streams: RerunStreams,
    upkeep: "_Upkeep",
    should_stop: Callable[[], bool],
    wake: threading.Event,
) -> None:
    """Draw ten times a second, and print which colonies are online and what has failed."""
    dashboard.setup(streams)
    upkeep_throttle, announcer = Throttle(_UPKEEP_PERIOD_S), ColonyAnnouncer()
    next_s = time.monotonic()
    while not should_stop():
        now_s = time.time()
        dashboard.handle_changes(subscriber.poll(), now_s)
        dashboard.draw(streams, now_s)
        colonies = {status.colony for status in dashboard.view.alive}
        lines = announcer.update(colonies, now_s)
        if upkeep_throttle.is_due(now_s):
            lines += upkeep.run()
        for line in lines:
            _print_line(line)
        next_s = max(next_s + _DRAW_PERIOD_S, time.monotonic())
        wake.wait(next_s - time.monotonic())


@dataclass
class _Upkeep:
    """Writes recordings to disk, and notices viewers that were closed."""

    streams: RerunStreams
    telemetry_file: TelemetryFile | None
    viewers: list[Viewer]

    def run(self) -> list[str]:
        """Return a message for every failure and every closed viewer since the last call."""
        errors = [self.streams.rrd.check() if self.streams.rrd else None]
        errors.append(self.telemetry_file.commit() if self.telemetry_file else None)
        lines = [error for error in errors if error]
        for viewer in [viewer for viewer in self.viewers if viewer.exit_code is not None]:
            self.viewers.remove(viewer)
            lines.append("the viewer was closed; the dashboard continues")
        return lines


def _open_streams(options: DashboardOptions, dashboard: Dashboard) -> tuple[RerunStreams, str]:
    blueprint = dashboard.blueprint("wall", is_live=True)
    run = f"crcolony-{uuid.uuid4().hex[:8]}"
    live, url = open_live(options.port, run, blueprint)
    rrd = None
    if options.folder is not None:
        rrd = open_rrd(unused_path(options.folder / RRD_FILE), run, blueprint)
        _print_line(f"recorded into {options.folder}")
    return RerunStreams(live, rrd), url


def _close_streams(streams: RerunStreams) -> None:
    """Close all streams, and optimize the recording unless that would take long."""
    is_complete = streams.rrd is not None and streams.rrd.stream is not None
    streams.close()
    path = streams.rrd.path if streams.rrd is not None and is_complete else None
    if path is not None and path.stat().st_size < MAX_BYTES:
        optimize_rrd(path)


def _open_telemetry_file(options: DashboardOptions) -> TelemetryFile | None:
    return TelemetryFile.open(options.folder / TELEMETRY_FILE) if options.folder else None


def _close_telemetry_file(telemetry_file: TelemetryFile) -> None:
    error = telemetry_file.close()
    if error is not None:
        _print_line(error)


@contextlib.contextmanager
def _open_viewers(options: DashboardOptions, url: str) -> Iterator[list[Viewer]]:
    """Open the viewers that the options name, and close them on exit."""
    viewers: list[Viewer] = []
    try:
        if options.web_port is not None:
            viewer, address = serve_web(url, options.web_port)
            viewers.append(viewer)
            is_open = open_browser(address)
            _print_line(f"{'opened' if is_open else 'open'} in a browser: {address}")
        if options.native:
            viewers.append(open_native(url))
        yield viewers
    finally:
        for viewer in viewers:
            viewer.close()


def unused_path(path: Path) -> Path:
    """Return the path, or if it exists, the first that does not with `-2`, `-3` and so on before its suffix."""
    number, unused = 1, path
    while unused.exists():
        number += 1
        unused = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return unused


def _print_line(line: str) -> None:
    print(line, flush=True)
