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

from crcolony.errors import CrcolonyError
from crcolony.recordings.run_of_robots import run_of_robots
from crcolony.runtime.service_notify import ServiceNotifier
from crcolony.shutdown import ShutdownSignal
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.connection import Connection
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.wait_for_network import open_connection
from crcolony_dashboards.colony_announcer import ColonyAnnouncer
from crcolony_dashboards.dashboard import Dashboard
from crcolony_dashboards.preconditions import check_rerun
from crcolony_dashboards.recording import Recording
from crcolony_dashboards.rerun_streams import RerunStreams, open_live
from crcolony_dashboards.rrd_file import exit_if_stuck
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.viewers import Viewer, open_browser, open_native, serve_web

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
    """Where the dashboard is recorded; None for the folder of the colony if it is in `runs`, else for a new one"""
    new_folder: Callable[[], Path]
    """Returns the new one"""
    runs: Path = Path("runs")
    records: bool = True
    web_port: int | None = None
    """Port of the web viewer; None for no web viewer"""
    native: bool = False
    """Whether to open the native viewer"""
    agent: str = ""
    """The agent whose potentials are drawn; empty for the best one"""
    minutes: float | None = None
    """Stop after this time; None for never"""
    keep_s: float | None = None
    """How long poses and states are kept in the recording; None for ever"""


def run_dashboard(options: DashboardOptions, service: ServiceNotifier) -> None:
    """Run a dashboard until a signal stops it. Raises DashboardError if it cannot be shown."""
    check_rerun()
    wake = threading.Event()
    should_stop = ShutdownSignal(options.minutes, wake=wake.set)
    with contextlib.ExitStack() as stack:
        waiting = open_connection(options.network, service.starting(should_stop), _print_line)
        connection = stack.enter_context(waiting)
        if connection is None:
            return
        recording = Recording(f"crcolony-{uuid.uuid4().hex[:8]}", options.keep_s)
        subscriber = TelemetrySubscriber(
            connection.session,
            options.colony,
            sends_requests=True,
            history=_HISTORY,
            on_raw_sample=recording.add,
        )
        connection.add_user(subscriber)
        dashboard = Dashboard(subscriber.monitor, options.agent)
        blueprint = dashboard.blueprint("wall", is_live=True)
        live, url = open_live(options.port, recording.run, blueprint)
        streams = RerunStreams(live, None)
        stack.callback(streams.close)
        stack.callback(recording.close, _print_line)
        if not options.records:
            recording.leave_out()
        elif options.folder is not None:
            _print_line(recording.open(options.folder, blueprint))
            streams.rrd = recording.rrd
        viewers = stack.enter_context(_open_viewers(options, url))
        _print_line(f"dashboard at {url}")
        upkeep = _Upkeep(options, recording, dashboard, streams, viewers)
        service.say_ready(f"dashboard at {url}")
        is_stopped = service.watching(should_stop)
        _draw_until_stopped(subscriber, connection, upkeep, is_stopped, wake)
    exit_if_stuck(streams.rrd)


def _draw_until_stopped(
    subscriber: TelemetrySubscriber,
    connection: Connection,
    upkeep: "_Upkeep",
    should_stop: Callable[[], bool],
    wake: threading.Event,
) -> None:
    """Draw ten times a second, and print which colonies are online and what has failed."""
    dashboard, streams = upkeep.dashboard, upkeep.streams
    dashboard.setup(streams)
    upkeep_throttle, announcer = Throttle(_UPKEEP_PERIOD_S), ColonyAnnouncer()
    next_s = time.monotonic()
    while not should_stop():
        now_s = time.time()
        connection.handle_timers(time.monotonic())
        dashboard.view.connection_problems = connection.check.problems
        dashboard.handle_changes(subscriber.poll(), now_s)
        lines = upkeep.open_recording()
        dashboard.draw(streams, now_s)
        colonies = {status.colony for status in dashboard.view.alive}
        lines += announcer.update(colonies, now_s)
        if upkeep_throttle.is_due(now_s):
            lines += upkeep.run()
        for line in lines:
            _print_line(line)
        next_s = max(next_s + _DRAW_PERIOD_S, time.monotonic())
        wake.wait(next_s - time.monotonic())


@dataclass
class _Upkeep:
    """Opens the recording, writes it to disk, and notices viewers that were closed."""

    options: DashboardOptions
    recording: Recording
    dashboard: Dashboard
    streams: RerunStreams
    viewers: list[Viewer]

    def open_recording(self) -> list[str]:
        """Open the recording when the first robot is online, and return what to print."""
        monitor = self.dashboard.view.monitor
        if self.recording.is_decided or not monitor.alive:
            return []
        robots = [status.robot for status in monitor.alive]
        try:
            folder = run_of_robots(robots, self.options.runs) or self.options.new_folder()
            line = self.recording.open(folder, self.dashboard.blueprint("wall", is_live=True))
        except CrcolonyError as error:
            return [f"not recorded: {error}"]
        self.streams.rrd = self.recording.rrd
        self.dashboard.setup(self.streams)
        return [line]

    def run(self) -> list[str]:
        """Return a message for every failure and every closed viewer since the last call."""
        lines = self.recording.commit()
        for viewer in [viewer for viewer in self.viewers if viewer.exit_code is not None]:
            self.viewers.remove(viewer)
            lines.append("the viewer was closed; the dashboard continues")
        return lines


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


def _print_line(line: str) -> None:
    print(line, flush=True)
