"""Starts an arena and robots on this machine, each its own process, restarts those that die, and shows their state.

It is a convenience and controls nothing: if it is killed, the colony continues. A process that dies is restarted from
its own storage, a few times; one that exits because of wrong input is not.
"""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Iterator

from rich.console import Console
from rich.live import Live

from crcolony.config import Config
from crcolony.errors import EXIT_OK
from crcolony.protocol.identity import seeded_key, write_key
from crcolony.results.run_folder import keep_config
from crcolony.results.run_report import print_run_report
from crcolony.runtime.console import format_clock
from crcolony.runtime.launch_plan import LaunchOptions, child_processes, choose_networks
from crcolony.runtime.start_robot import warm_up
from crcolony.runtime.supervisor import ChildProcess, dashboard_address
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import KEY_FILE, make_folder
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.telemetry.terminal_view import plain_line, table_of
from crcolony.transport.interface import NetworkError
from crcolony.transport.zenoh_session import HERE, NetworkSettings, Session, open_session

_REFRESH_S = 0.25
_ROUTER_TIMEOUT_S = 10.0
"""How long to retry to connect to a router that has just been started."""
_STATUS_PERIOD_S = 5.0
"""How often a status line is printed where there is no terminal."""
_SHUTDOWN_TIMEOUT_S = 5.0
"""How long a process may take to save and exit before it is killed."""


def run_launch(launch: LaunchOptions) -> int:
    """Run until stopped or until all robots are done, and print a report; return the exit code.

    Raises CrcolonyError for wrong input.
    """
    console = Console(markup=False, highlight=False)
    _prepare(launch)
    networks = choose_networks(launch)
    children = child_processes(launch, networks)
    _print_start(console, launch, networks.endpoint)
    started_s = time.monotonic()
    with _running(children, launch.config), _open_session(networks.robots) as session:
        wake = threading.Event()
        stop = ShutdownSignal(launch.minutes, wake=wake.set)
        signal.signal(signal.SIGHUP, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
        _supervise(console, children, TelemetrySubscriber(session, launch.colony), stop, wake)
    console.print(f"stopped after {time.monotonic() - started_s:.0f} s")
    print_run_report(console, launch.folder, launch.config)
    needed = [child for child in children if not child.is_observer]
    return EXIT_OK if not any(child.ended not in ("", "done") for child in needed) else 1


def _supervise(
    console: Console,
    children: list[ChildProcess],
    subscriber: TelemetrySubscriber,
    stop: ShutdownSignal,
    wake: threading.Event,
) -> None:
    """Show the colony and restart its processes until it is over."""
    robots = [child for child in children if child.is_robot]
    started_s = status_s = time.monotonic()
    is_discovered = False
    addresses: set[str] = set()
    with _display(console) as live:
        while not stop() and not _is_over(children):
            wake.wait(_REFRESH_S)
            now_s = time.monotonic()
            subscriber.poll()
            for child in children:
                line = child.restart_if_dead(now_s) or _new_address(child, addresses)
                if line:
                    console.print(line, soft_wrap=True)
            if not is_discovered and _are_all_online(subscriber, len(robots)):
                is_discovered = True
                console.print(
                    f"{len(robots)} robots are connected after {now_s - started_s:.1f} s",
                )
            if live is not None:
                live.update(table_of(subscriber.monitor, time.time()))
            elif now_s - status_s >= _STATUS_PERIOD_S:
                status_s = now_s
                console.print(plain_line(subscriber.monitor), soft_wrap=True)


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


def _open_session(network: NetworkSettings) -> Session:
    """Connect to the network of the robots; retry while a router that has just been started is not ready."""
    until_s = time.monotonic() + _ROUTER_TIMEOUT_S
    while True:
        try:
            return open_session(network)
        except NetworkError:
            if network.role != "client" or time.monotonic() > until_s:
                raise


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


@contextlib.contextmanager
def _running(children: list[ChildProcess], config: Config) -> Iterator[None]:
    """Run processes inside the context; at its end terminate the robots first, then the rest, and wait for each."""
    try:
        for child in children:
            if not child.is_robot:
                child.start(time.monotonic())
        warm_up(config)  # compiles once for all robots, while the arena starts
        for child in children:
            if child.is_robot:
                child.start(time.monotonic())
        yield
    finally:
        for is_robot in (True, False):
            group = [child for child in children if child.is_robot == is_robot]
            for child in group:
                child.terminate()
            until_s = time.monotonic() + _SHUTDOWN_TIMEOUT_S
            for child in group:
                child.wait(until_s)


def _prepare(launch: LaunchOptions) -> None:
    """Create the folder of the run, with the config and the keys of a repeatable run."""
    make_folder(launch.folder)
    keep_config(launch.folder, launch.config)
    for number in range(launch.count):
        folder = launch.folder / "robots" / str(number)
        make_folder(folder)
        if launch.is_repeatable and not (folder / KEY_FILE).exists():
            write_key(folder / KEY_FILE, seeded_key(launch.colony, launch.config.seed, number))


def _print_start(console: Console, launch: LaunchOptions, endpoint: str) -> None:
    clock = format_clock(launch.wall_period_s)
    if launch.wall_period_s is None:
        clock += ", as fast as possible"
    what = f"{launch.count} robots" + (
        f" for arena {launch.arena}" if launch.robots_only else f" and an arena, {clock}"
    )
    console.print(f"{what}, each its own process, into {launch.folder}", soft_wrap=True)
    where = "" if endpoint == HERE else f" --connect {endpoint}"
    if endpoint.startswith("--"):
        where = f" {endpoint}"
    hint = f"watch it with: crcolony top{where}"
    if not launch.has_dashboard:
        hint += f", or in a browser: crcolony dashboard --web{where}"
    console.print(hint, soft_wrap=True)
