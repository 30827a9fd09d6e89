"""Starts an arena and robots on this machine, each its own process, keeps them alive, and shows how they are.

It is a convenience and in charge of nothing: kill it, and the colony lives on. What dies is started again from its own
memory, a few times; what says that something outside is wrong is not.
"""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.live import Live

from crcolony.colony.identity import seeded_key, write_key
from crcolony.colony.network import HERE, Network, free_port, is_taken, open_session
from crcolony.colony.processes.closing import say_summary
from crcolony.colony.processes.start import KEY, make_folder, new_arena, warm_up
from crcolony.colony.processes.stopping import Stop
from crcolony.colony.processes.top import Watcher, plain_line, shown
from crcolony.colony.results import keep_config
from crcolony.config import Config
from crcolony.errors import EXIT_OK, EXIT_WRONG_INPUT

_REFRESH_S = 0.25
_PLAIN_LINES_S = 5.0
_GRACE_S = 5.0
"""How long a process may take to save and end before it is killed."""
_RESTARTS, _RESTARTS_WITHIN_S = 5, 60.0
_RESTART_DELAY_S = 0.5


@dataclass(frozen=True)
class Launch:
    """What to start."""

    config: Config
    count: int
    folder: Path
    colony: str
    arena: str
    network: Network | None
    """None: a port of this machine, for this colony alone"""
    wall_period_s: float | None
    robots_only: bool
    minutes: float | None


@dataclass
class Child:
    """A process that was started here."""

    name: str
    command: list[str]
    log: Path
    process: subprocess.Popen[bytes] | None = None
    starts: deque[float] = field(default_factory=lambda: deque(maxlen=_RESTARTS))
    ended: str = ""
    """Why it will not be started again"""
    restart_at_s: float | None = None
    restarts: int = 0

    def start(self, now_s: float) -> None:
        """Start the process; it has a session of its own, so that Ctrl-C here does not reach it."""
        self.starts.append(now_s)
        self.restart_at_s = None
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                self.command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    def look_after(self, now_s: float) -> str | None:
        """See whether it lives, and start it again if it died; return what happened, in words."""
        if self.restart_at_s is not None and now_s >= self.restart_at_s:
            self.restarts += 1
            self.start(now_s)
            return f"{self.name} is started again"
        if self.process is None or self.process.poll() is None:
            return None
        code, self.process = self.process.returncode, None
        if code == EXIT_OK:
            self.ended = "done"
            return None
        if code == EXIT_WRONG_INPUT:
            self.ended = last_line(self.log)
            return f"{self.name} cannot run: {self.ended}"
        is_hopeless = len(self.starts) == _RESTARTS and now_s - self.starts[0] < _RESTARTS_WITHIN_S
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"ended with {code}"
        if is_hopeless:
            self.ended = f"{how}, {_RESTARTS} times in a minute"
            return f"{self.name}: {self.ended}; see {self.log}"
        self.restart_at_s = now_s + _RESTART_DELAY_S
        return f"{self.name}: {how}"

    @property
    def is_over(self) -> bool:
        """Whether it has ended for good."""
        return bool(self.ended)

    def ask_to_stop(self) -> None:
        """Ask it to save and end."""
        if self.process is not None and self.process.poll() is None:
            self.process.terminate()

    def wait(self, until_s: float) -> None:
        """Wait until it has ended; kill it if it takes too long."""
        if self.process is None:
            return
        try:
            self.process.wait(max(until_s - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def run_launch(launch: Launch) -> int:
    """Run until told to stop or until all robots are done; say what has come of it. Raises Refusal."""
    console = Console()
    _prepare(launch)
    woken = threading.Event()
    stop = Stop(launch.minutes, wake=woken.set)
    signal.signal(signal.SIGHUP, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
    network, endpoint = _network(launch)
    children = _children(launch, network)
    _greet(console, launch, endpoint)
    started_s = time.monotonic()
    with _running(children), open_session(_watching(network)) as session:
        watcher = Watcher(session, launch.colony)
        _attend(console, children, watcher, stop, woken)
    console.print(f"stopped after {time.monotonic() - started_s:.0f} s", highlight=False)
    say_summary(console, launch.folder, launch.config)
    return EXIT_OK if not any(child.ended not in ("", "done") for child in children) else 1


def _attend(
    console: Console,
    children: list[Child],
    watcher: Watcher,
    stop: Stop,
    woken: threading.Event,
) -> None:
    """Show the colony and look after the processes until it is over."""
    robots = [child for child in children if child.name != "arena"]
    said_s, is_discovered = time.monotonic(), False
    started_s = time.monotonic()
    with _display(console) as live:
        while not stop() and not all(child.is_over for child in robots):
            woken.wait(_REFRESH_S)
            now_s = time.monotonic()
            for child in children:
                news = child.look_after(now_s)
                if news:
                    console.print(news, highlight=False, soft_wrap=True)
            if not is_discovered and _all_see_all(watcher, len(robots)):
                is_discovered = True
                console.print(
                    f"{len(robots)} robots see each other after {now_s - started_s:.1f} s",
                    highlight=False,
                )
            if live is not None:
                live.update(shown(watcher))
            elif now_s - said_s >= _PLAIN_LINES_S:
                said_s = now_s
                with watcher.lock:
                    console.print(plain_line(watcher.watch), highlight=False, soft_wrap=True)


def _all_see_all(watcher: Watcher, count: int) -> bool:
    with watcher.lock:
        states = [watched.state for watched in watcher.watch.alive]
    return sum(s is not None and s.peers >= count - 1 for s in states) >= count


@contextlib.contextmanager
def _display(console: Console) -> Iterator[Live | None]:
    if not console.is_terminal:
        yield None
        return
    with Live(console=console, refresh_per_second=4) as live:
        yield live


@contextlib.contextmanager
def _running(children: list[Child]) -> Iterator[None]:
    """Run processes; robots first, then the arena, are asked to save and end when this is left."""
    try:
        for child in children:
            child.start(time.monotonic())
        yield
    finally:
        for group in (
            [child for child in children if child.name != "arena"],
            [child for child in children if child.name == "arena"],
        ):
            for child in group:
                child.ask_to_stop()
            until_s = time.monotonic() + _GRACE_S
            for child in group:
                child.wait(until_s)


# What is started ----------------------------------------------------------------------------------------------------


def _prepare(launch: Launch) -> None:
    """Make the results folder, with the config and the keys of a repeatable run, and compile once for all."""
    make_folder(launch.folder)
    keep_config(launch.folder, launch.config)
    for number in range(launch.count):
        folder = launch.folder / "robots" / str(number)
        make_folder(folder)
        if _is_repeatable(launch) and not (folder / KEY).exists():
            write_key(folder / KEY, seeded_key(launch.colony, launch.config.seed, number))
    if not launch.robots_only:
        new_arena(launch.config, 0, lockstep=False, expect=0).advance()
    warm_up(launch.config)


def _is_repeatable(launch: Launch) -> bool:
    return launch.wall_period_s is None and not launch.robots_only


def _network(launch: Launch) -> tuple[Network, str]:
    """Return how robots come onto the network, and the endpoint to watch them at."""
    if launch.network is not None:
        network = launch.network
        endpoint = (network.listen if not launch.robots_only else ()) or network.connect
        return network, endpoint[0] if endpoint else f"--interface {network.interface}"
    endpoint_here = HERE
    if not launch.robots_only and is_taken(HERE):
        endpoint_here = f"tcp/127.0.0.1:{free_port()}"
    return Network(connect=(endpoint_here,)), endpoint_here


def _watching(network: Network) -> Network:
    return network


def _children(launch: Launch, network: Network) -> list[Child]:
    python = [sys.executable, "-m", "crcolony"]
    config = ["--config", str(launch.folder / "config.toml")]
    logs = launch.folder / "logs"
    make_folder(logs)
    children = []
    reach = [word for endpoint in network.connect for word in ("--connect", endpoint)]
    if network.interface:
        reach += ["--interface", network.interface]
    if network.role == "client":
        reach += ["--client"]
    if not launch.robots_only:
        listen = network.listen or (() if network.interface else network.connect)
        words = [word for endpoint in listen for word in ("--listen", endpoint)]
        if network.interface:
            words += ["--interface", network.interface]
        if launch.network is not None and network.listen:
            reach = [word for endpoint in network.listen for word in ("--connect", endpoint)]
            words += [word for endpoint in network.connect for word in ("--connect", endpoint)]
        clock = (
            ["--lockstep", "--expect", str(launch.count)]
            if launch.wall_period_s is None
            else ["--hz", repr(1.0 / launch.wall_period_s)]
        )
        arena = ["arena", *config, "--arena", launch.arena, "--out", str(launch.folder), *clock]
        children.append(Child("arena", [*python, *arena, *words], logs / "arena.log"))
    for number in range(launch.count):
        words = [
            "robot", *config, "--colony", launch.colony, "--arena", launch.arena,
            "--out", str(launch.folder / "robots" / str(number)), *reach,
        ]  # fmt: skip
        if not launch.robots_only:
            words += ["--number", str(number)]
        if _is_repeatable(launch):
            words += ["--repeatable"]
        children.append(Child(f"robot {number}", [*python, *words], logs / f"robot-{number}.log"))
    return children


def _greet(console: Console, launch: Launch, endpoint: str) -> None:
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
    console.print(f"watch from elsewhere: crcolony top{where}", highlight=False, soft_wrap=True)


def last_line(log: Path) -> str:
    """Return the last line that a process said."""
    try:
        lines = log.read_text("utf-8", "replace").strip().splitlines()
    except OSError:
        return "it said nothing"
    return lines[-1].removeprefix("crcolony: ") if lines else "it said nothing"
