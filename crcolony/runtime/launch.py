"""Starts an arena and robots on this machine, each its own process, keeps them alive, and shows how they are.

It is a convenience and in charge of nothing: kill it, and the colony lives on. What dies is started again from its own
memory, a few times; what says that something outside is wrong is not.
"""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Iterator

import zenoh
from rich.console import Console
from rich.live import Live

from crcolony.config import Config
from crcolony.errors import EXIT_OK
from crcolony.protocol.identity import seeded_key, write_key
from crcolony.results.run_folder import keep_config
from crcolony.results.run_report import print_run_report
from crcolony.runtime.start_robot import warm_up
from crcolony.runtime.supervisor import (
    ChildProcess,
    LaunchOptions,
    address_in,
    children_of,
    is_repeatable,
    networks_of,
)
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import KEY_FILE, make_folder
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.telemetry.terminal_view import plain_line, table_of
from crcolony.transport.interface import NetworkError
from crcolony.transport.zenoh_session import HERE, NetworkSettings, open_session

_REFRESH_S = 0.25
_PATIENCE_S = 10.0
_PLAIN_LINES_S = 5.0
_GRACE_S = 5.0
"""How long a process may take to save and end before it is killed."""


def run_launch(launch: LaunchOptions) -> int:
    """Run until told to stop or until all robots are done; say what has come of it. Raises Refusal."""
    console = Console()
    _prepare(launch)
    networks = networks_of(launch)
    children = children_of(launch, networks)
    _greet(console, launch, networks.endpoint)
    started_s = time.monotonic()
    with _running(children, launch.config), _session(networks.robots) as session:
        woken = threading.Event()
        stop = ShutdownSignal(launch.minutes, wake=woken.set)
        signal.signal(signal.SIGHUP, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
        _attend(console, children, TelemetrySubscriber(session, launch.colony), stop, woken)
    console.print(f"stopped after {time.monotonic() - started_s:.0f} s", highlight=False)
    print_run_report(console, launch.folder, launch.config)
    needed = [child for child in children if not child.only_watches]
    return EXIT_OK if not any(child.ended not in ("", "done") for child in needed) else 1


def _attend(
    console: Console,
    children: list[ChildProcess],
    subscriber: TelemetrySubscriber,
    stop: ShutdownSignal,
    woken: threading.Event,
) -> None:
    """Show the colony and look after the processes until it is over."""
    robots = [child for child in children if child.is_robot]
    said_s, is_discovered = time.monotonic(), False
    shown_at: set[str] = set()
    started_s = time.monotonic()
    with _display(console) as live:
        while not stop() and not _is_over(children):
            woken.wait(_REFRESH_S)
            now_s = time.monotonic()
            subscriber.poll()
            for child in children:
                changes = child.restart_if_dead(now_s) or _where(child, shown_at)
                if changes:
                    console.print(changes, highlight=False, soft_wrap=True)
            if not is_discovered and _all_see_all(subscriber, len(robots)):
                is_discovered = True
                console.print(
                    f"{len(robots)} robots see each other after {now_s - started_s:.1f} s",
                    highlight=False,
                )
            if live is not None:
                live.update(table_of(subscriber.monitor, time.time()))
            elif now_s - said_s >= _PLAIN_LINES_S:
                said_s = now_s
                console.print(plain_line(subscriber.monitor), highlight=False, soft_wrap=True)


def _where(child: ChildProcess, said: set[str]) -> str | None:
    """Say once where a dashboard is to be seen."""
    address = address_in(child.log) if child.only_watches and not said else None
    if address is None:
        return None
    said.add(address)
    return f"dashboard: {address}"


def _is_over(children: list[ChildProcess]) -> bool:
    """Whether all robots are done, or the arena or router will not run."""
    robots = [child.is_over for child in children if child.is_robot]
    nature = [child for child in children if not child.is_robot and not child.only_watches]
    return all(robots) or any(child.is_over for child in nature)


def _session(network: NetworkSettings) -> zenoh.Session:
    """Watch through the network of the robots; a router that has just been started may need a moment."""
    until_s = time.monotonic() + _PATIENCE_S
    while True:
        try:
            return open_session(network)
        except NetworkError:
            if network.role != "client" or time.monotonic() > until_s:
                raise


def _all_see_all(subscriber: TelemetrySubscriber, count: int) -> bool:
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
    """Run processes; robots first, then the arena, are asked to save and end when this is left."""
    try:
        for child in children:
            if not child.is_robot:
                child.start(time.monotonic())
        warm_up(config)  # compiles once for all robots, while the arena gets ready
        for child in children:
            if child.is_robot:
                child.start(time.monotonic())
        yield
    finally:
        for is_robot in (True, False):
            group = [child for child in children if child.is_robot == is_robot]
            for child in group:
                child.terminate()
            until_s = time.monotonic() + _GRACE_S
            for child in group:
                child.wait(until_s)


def _prepare(launch: LaunchOptions) -> None:
    """Make the results folder, with the config and the keys of a repeatable run."""
    make_folder(launch.folder)
    keep_config(launch.folder, launch.config)
    for number in range(launch.count):
        folder = launch.folder / "robots" / str(number)
        make_folder(folder)
        if is_repeatable(launch) and not (folder / KEY_FILE).exists():
            write_key(folder / KEY_FILE, seeded_key(launch.colony, launch.config.seed, number))


def _greet(console: Console, launch: LaunchOptions, endpoint: str) -> None:
    clock = (
        "in lockstep, as fast as possible"
        if launch.wall_period_s is None
        else f"{1.0 / launch.wall_period_s:.3g} control periods a second"
    )
    what = f"{launch.count} robots" + (
        f" for arena {launch.arena} elsewhere" if launch.robots_only else f" and an arena, {clock}"
    )
    console.print(
        f"{what}, each its own process, into {launch.folder}", highlight=False, soft_wrap=True
    )
    where = "" if endpoint == HERE else f" --connect {endpoint}"
    where = f" {endpoint}" if endpoint.startswith("--") else where
    watching = f"watch from elsewhere: crcolony top{where}"
    if not launch.has_dashboard:
        watching += f", or in a browser: crcolony dashboard --web{where}"
    console.print(watching, highlight=False, soft_wrap=True)
