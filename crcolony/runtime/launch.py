"""Starts an arena and robots on this machine, each its own process, restarts those that die, and shows their state.

It is a convenience and selects nothing. A process that dies is restarted from its own storage, a few times; one that
exits because of wrong input is not. However this process ends, even by kill -9, the others save and end with it.
"""

import contextlib
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass

from rich.console import Console
from rich.live import Live

from crcolony.errors import EXIT_OK
from crcolony.protocol.identity import RobotId, seeded_key, write_key
from crcolony.protocol.telemetry_messages import Exchanged, RobotEvent
from crcolony.results.colony_folder import ColonyFolder
from crcolony.results.run_report import print_run_report
from crcolony.runtime.console import format_clock
from crcolony.runtime.forked_process import ForkServer
from crcolony.runtime.launch_plan import (
    LaunchOptions,
    child_processes,
    chosen_networks,
    connect_option,
    mesh_warning,
)
from crcolony.runtime.supervisor import ChildProcess, dashboard_address, end_all
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import KEY_FILE
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.notices import format_arena_change
from crcolony.telemetry.status_changes import ArenaChanged, EventReceived
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.telemetry.terminal_view import plain_line, table_of
from crcolony.terminal import plain_console
from crcolony.transport.connection import Connection
from crcolony.transport.wait_for_network import open_connection

_REFRESH_S = 0.25
_STATUS_PERIOD_S = 5.0
"""How often a status line is printed where there is no terminal."""


@dataclass(frozen=True)
class LaunchOutcome:
    """How a launch ended."""

    is_well: bool
    """Whether no process has ended by an error"""
    lived_s: float
    """From the first control period on"""


def run_launch(launch: LaunchOptions, folder: ColonyFolder, server: ForkServer) -> int:
    """Run until stopped or until all robots are done, and print a report; return the exit code.

    Raises CrcolonyError for wrong input.
    """
    console = plain_console()
    wake = threading.Event()
    stop = ShutdownSignal(wake=wake.set)
    started_s = time.monotonic()
    outcome = run_processes(console, launch, folder, server, stop, wake)
    headline = f"stopped after {time.monotonic() - started_s:.0f} s"
    print_run_report(console, launch.folder, launch.config, stop, headline, launch.has_plots)
    return EXIT_OK if outcome.is_well else 1


def run_processes(
    console: Console,
    launch: LaunchOptions,
    folder: ColonyFolder,
    server: ForkServer,
    stop: ShutdownSignal,
    wake: threading.Event,
) -> LaunchOutcome:
    """Run until stopped or until all robots are done; `stop` sets `wake`.

    The minutes of the launch are counted from the first control period on.
    """
    _prepare(launch, folder)
    with contextlib.ExitStack() as held:
        networks = held.enter_context(chosen_networks(launch))
        children = child_processes(launch, networks, server.start)
        _print_start(console, launch, networks.endpoint)
        if warning := mesh_warning(launch, networks):
            console.print(warning, soft_wrap=True)
        supervisor = _Supervisor(console, children, stop)
        held.callback(end_all, children, lambda: stop.is_urgent)
        # Whoever joins a large mesh last may not be linked to all of it: this process joins before the robots.
        is_mesh = networks.robots.role != "client"
        _start([child for child in children if not (is_mesh and child.is_robot)], stop)
        # What this launch starts answers soon; what it joins may not.
        warn = supervisor.print if launch.robots_only else lambda line: None
        with open_connection(networks.robots, supervisor.is_over, warn) as connection:
            if connection is not None:
                _start([child for child in children if is_mesh and child.is_robot], stop)
                supervisor.show(connection, launch, wake)
    needed = [child for child in children if not child.is_observer]
    is_well = not any(child.ended not in ("", "done") for child in needed)
    return LaunchOutcome(is_well, supervisor.lived_s)


class _Supervisor:
    """Restarts the processes of a colony until it is over, and shows its state meanwhile."""

    def __init__(
        self, console: Console, children: list[ChildProcess], stop: ShutdownSignal
    ) -> None:
        self._console, self._children, self._stop = console, children, stop
        self._robots = sum(child.is_robot for child in children)
        self._started_s = time.monotonic()
        self._is_discovered = self._have_mated = False
        self._begun_s: float | None = None
        """When the first robot lived, None: none has yet"""
        self._addresses: set[str] = set()

    @property
    def lived_s(self) -> float:
        """For how long robots have lived."""
        return time.monotonic() - self._begun_s if self._begun_s is not None else 0.0

    def print(self, line: str) -> None:
        """Print a line."""
        self._console.print(line, soft_wrap=True)

    def is_over(self) -> bool:
        """Restart processes that have died; return whether to stop, or whether too many have ended for good."""
        now_s = time.monotonic()
        for child in self._children:
            child.shorten_log()
            line = child.restart_if_dead(now_s) or _new_address(child, self._addresses)
            if line:
                self.print(line)
        return self._stop() or _is_over(self._children)

    def show(self, connection: Connection, launch: LaunchOptions, wake: threading.Event) -> None:
        """Show the colony until it is over."""
        subscriber = TelemetrySubscriber(connection.session, launch.colony, sends_requests=True)
        status_s = time.monotonic()
        with _display(self._console) as live:
            while not self.is_over():
                wake.wait(_REFRESH_S)
                for change in subscriber.poll():
                    if isinstance(change, ArenaChanged):
                        self.print(format_arena_change(change))
                    elif isinstance(change, EventReceived):
                        self._print_first_mating(change.message.event, subscriber.monitor)
                self._print_discovery(subscriber)
                if self._begun_s is None and _is_any_stepping(subscriber):
                    self._begun_s = time.monotonic()
                    self._stop.end_after(launch.minutes)
                problems = connection.check.problems if launch.robots_only else []
                shown = subscriber.monitor, time.time(), problems
                if live is not None:
                    live.update(table_of(*shown, width=self._console.width))
                elif time.monotonic() - status_s >= _STATUS_PERIOD_S:
                    status_s = time.monotonic()
                    self.print(plain_line(*shown))

    def _print_discovery(self, subscriber: TelemetrySubscriber) -> None:
        """Print once how long it took until all robots were connected to each other."""
        if not self._is_discovered and _are_all_online(subscriber, self._robots):
            self._is_discovered = True
            after_s = time.monotonic() - self._started_s
            self.print(f"{self._robots} robots are connected after {after_s:.1f} s")

    def _print_first_mating(self, event: RobotEvent, monitor: ColonyMonitor) -> None:
        """Print once which robots were the first to mate."""
        if isinstance(event, Exchanged) and not self._have_mated:
            self._have_mated = True
            pair = (event.encounter.initiator, event.encounter.responder)
            names = " and ".join(sorted(_name_of(robot, monitor) for robot in pair))
            after_s = time.monotonic() - self._started_s
            self.print(f"the first to mate, after {after_s:.1f} s, are robots {names}")


def _name_of(robot: RobotId, monitor: ColonyMonitor) -> str:
    """Return a robot's number, or the begin of its id if its number is not known."""
    status = monitor.robots.get(robot)
    return str(status.state.number) if status and status.state else robot.hex()[:8]


def _is_any_stepping(subscriber: TelemetrySubscriber) -> bool:
    """Return whether a robot has received two observations, and so has lived for a control period."""
    return any(status.state and status.state.period_ms for status in subscriber.monitor.alive)


def _new_address(child: ChildProcess, printed: set[str]) -> str | None:
    """Return a line with the address of a dashboard, once."""
    address = dashboard_address(child.log) if child.is_observer and not printed else None
    if address is None:
        return None
    printed.add(address)
    return f"dashboard: {address}"


def _is_over(children: list[ChildProcess]) -> bool:
    """Return whether all robots are done, or the arena or the router has ended."""
    robots = [child.is_over for child in children if child.is_robot]
    needed = [child for child in children if not child.is_robot and not child.is_observer]
    return all(robots) or any(child.is_over for child in needed)


def _are_all_online(subscriber: TelemetrySubscriber, count: int) -> bool:
    """Return whether so many robots each have all others as peers."""
    states = [status.state for status in subscriber.monitor.alive]
    return sum(s is not None and s.peers >= count - 1 for s in states) >= count


@contextlib.contextmanager
def _display(console: Console) -> Iterator[Live | None]:
    if not console.is_terminal:
        yield None
        return
    with Live(console=console, refresh_per_second=4) as live:
        yield live


def _start(children: list[ChildProcess], stop: ShutdownSignal) -> None:
    """Start processes; after a signal to `stop` no more are started."""
    for child in children:
        if not stop():
            child.start(time.monotonic())


def _prepare(launch: LaunchOptions, folder: ColonyFolder) -> None:
    """Make the folders of the processes, with the keys of a repeatable run."""
    if not launch.robots_only:
        folder.prepare_arena()
    for number in range(launch.count):
        key = folder.prepare_robot(number) / KEY_FILE
        if launch.is_repeatable and not key.exists():
            seed = launch.config.seed
            write_key(key, seeded_key(launch.colony, seed, number, folder.population))


def _print_start(console: Console, launch: LaunchOptions, endpoint: str) -> None:
    clock = format_clock(launch.wall_period_s)
    if launch.wall_period_s is None:
        clock += ", as fast as possible"
    what = f"{launch.count} robots" + (
        f" for arena {launch.arena}" if launch.robots_only else f" and an arena, {clock}"
    )
    console.print(f"{what}, each its own process, into {launch.folder}", soft_wrap=True)
    where = connect_option(endpoint)
    hint = f"watch it with: crcolony top{where}"
    if not launch.has_dashboard:
        hint += f", or in a browser: crcolony dashboard --web{where}"
    console.print(hint, soft_wrap=True)
