"""The processes that a launch starts on this machine: how each is called, kept alive, and asked to end."""

import contextlib
import signal
import subprocess
import sys
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

from crcolony.config import Config
from crcolony.errors import EXIT_OK, EXIT_WRONG_INPUT
from crcolony.storage.files import make_folder
from crcolony.transport.zenoh_session import HERE, MESH_ROBOTS, NetworkSettings, free_port, is_taken

_RESTARTS, _RESTARTS_WITHIN_S = 5, 60.0
_RESTART_DELAY_S = 0.5
DASHBOARD = "dashboard"


@dataclass(frozen=True)
class LaunchOptions:
    """What to start."""

    config: Config
    count: int
    folder: Path
    colony: str
    arena: str
    network: NetworkSettings | None
    """None: a port of this machine, for this colony alone"""
    wall_period_s: float | None
    robots_only: bool
    minutes: float | None
    has_dashboard: bool = False
    """Whether to show it in a browser"""


@dataclass
class ChildProcess:
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

    def restart_if_dead(self, now_s: float) -> str | None:
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
    def is_robot(self) -> bool:
        """Whether it is one of those the whole is for."""
        return self.name.startswith("robot")

    @property
    def only_watches(self) -> bool:
        """Whether nobody needs it to live."""
        return self.name == DASHBOARD

    @property
    def is_over(self) -> bool:
        """Whether it has ended for good."""
        return bool(self.ended)

    def terminate(self) -> None:
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


def is_repeatable(launch: LaunchOptions) -> bool:
    return launch.wall_period_s is None and not launch.robots_only


@dataclass(frozen=True)
class LaunchNetworks:
    """How the processes of a launch come onto the network."""

    robots: NetworkSettings
    arena: NetworkSettings
    router: NetworkSettings | None
    endpoint: str
    """Where others join them"""


def networks_of(launch: LaunchOptions) -> LaunchNetworks:
    """Return how to connect: as told, or by a seed on this machine, which is a router for more than a mesh carries."""
    message = launch.network
    if message is None:
        is_free = launch.robots_only or not is_taken(HERE)
        seed = HERE if is_free else f"tcp/127.0.0.1:{free_port()}"
        joining, beginning = NetworkSettings(connect=(seed,)), NetworkSettings(listen=(seed,))
        if launch.count > MESH_ROBOTS and not launch.robots_only:
            client = NetworkSettings(role="client", connect=(seed,))
            return LaunchNetworks(
                client, client, NetworkSettings(role="router", listen=(seed,)), seed
            )
        return LaunchNetworks(joining, beginning, None, seed)
    if launch.robots_only or not message.listen:
        return LaunchNetworks(
            message, message, None, (*message.connect, f"--interface {message.interface}")[0]
        )
    return LaunchNetworks(NetworkSettings(connect=message.listen), message, None, message.listen[0])


def _words(network: NetworkSettings) -> list[str]:
    """Return a network as options of the command line."""
    words = [word for endpoint in network.connect for word in ("--connect", endpoint)]
    words += [word for endpoint in network.listen for word in ("--listen", endpoint)]
    if network.interface:
        words += ["--interface", network.interface]
    return [*words, "--client"] if network.role == "client" else words


def children_of(launch: LaunchOptions, networks: LaunchNetworks) -> list[ChildProcess]:
    """Return what to start, in order."""
    logs = launch.folder / "logs"
    make_folder(logs)
    children = []
    if networks.router is not None:
        children.append(_child("router", ["router", *_words(networks.router)], logs))
    if not launch.robots_only:
        children.append(_child("arena", _arena_words(launch, networks.arena), logs))
    if launch.has_dashboard:
        children.append(_child(DASHBOARD, _dashboard_words(launch, networks.robots), logs))
    for number in range(launch.count):
        words = _robot_words(launch, networks.robots, number)
        children.append(_child(f"robot {number}", words, logs))
    return children


def _child(name: str, words: list[str], logs: Path) -> ChildProcess:
    log = logs / f"{name.replace(' ', '-')}.log"
    return ChildProcess(name, [sys.executable, "-m", "crcolony", *words], log)


def _arena_words(launch: LaunchOptions, network: NetworkSettings) -> list[str]:
    clock = (
        ["--lockstep", "--expect", str(launch.count)]
        if launch.wall_period_s is None
        else ["--hz", repr(1.0 / launch.wall_period_s)]
    )
    config = str(launch.folder / "config.toml")
    words = ["arena", "--config", config, "--arena", launch.arena, "--out", str(launch.folder)]
    return [*words, *clock, *_words(network)]


def _robot_words(launch: LaunchOptions, network: NetworkSettings, number: int) -> list[str]:
    words = [
        "robot", "--config", str(launch.folder / "config.toml"), "--colony", launch.colony,
        "--arena", launch.arena, "--out", str(launch.folder / "robots" / str(number)),
        *_words(network),
    ]  # fmt: skip
    if not launch.robots_only:
        words += ["--number", str(number)]
    return [*words, "--repeatable"] if is_repeatable(launch) else words


def _dashboard_words(launch: LaunchOptions, network: NetworkSettings) -> list[str]:
    return ["dashboard", "--web", "--out", str(launch.folder), *_words(network)]


def address_in(log: Path) -> str | None:
    """Return where a dashboard is to be seen, once it has said so."""
    with contextlib.suppress(OSError):
        for line in log.read_text("utf-8", "replace").splitlines():
            if "http://" in line and "browser" in line:
                return line[line.index("http://") :]
    return None


def last_line(log: Path) -> str:
    """Return the last line that a process said."""
    try:
        lines = log.read_text("utf-8", "replace").strip().splitlines()
    except OSError:
        return "it said nothing"
    return lines[-1].removeprefix("crcolony: ") if lines else "it said nothing"
