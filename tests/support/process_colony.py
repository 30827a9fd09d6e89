"""Colonies of real processes, for tests: started, observed from outside, and stopped."""

import contextlib
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import msgspec
import psutil

from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import Exchanged, RobotState
from crcolony.transport.zenoh_session import free_port
from tests.support.observer import EventReceived, Line, StateReceived, Token
from tests.support.paths import ROOT
from tests.support.process import PATIENCE_S, Process, Robot, wait_until

__all__ = [
    "BUSY",
    "ROOT",
    "Colony",
    "Process",
    "Robot",
    "View",
    "colony",
    "crcolony",
    "settings",
    "settle",
    "wait_until",
]

BUSY = (
    "life.agents=8",
    "life.slices=2",
    "life.slice_steps=20",
    "life.initial_energy=1.0",
    "life.energy_per_step=0.0",
    "life.refractory_steps=5",
    "arena.area_per_robot_m2=0.2",
    "body.encounter_half_angle_rad=3.1",
    "body.encounter_range_m=0.8",
    "generations=0",
)
"""Crowded, well fed and quick to mate again."""


def settings(*more: str) -> list[str]:
    """Return the options that set `BUSY`, and more."""
    return [option for setting in (*BUSY, *more) for option in ("--set", setting)]


_OBSERVER_S = 20.0
"""A colony settles within this time unless the observer does not see all of it; observing anew takes a second."""

Kind = TypeVar("Kind", Token, StateReceived, EventReceived)


@dataclass
class View:
    """What an observer has received, as a list and by robot."""

    process: Process
    lines: list[Line] = field(default_factory=list)
    states: dict[bytes, RobotState] = field(default_factory=dict)
    incarnations: dict[bytes, list[int]] = field(default_factory=dict)
    """Of every robot, the incarnations of its tokens, in order"""
    matings: Counter[bytes] = field(default_factory=Counter)
    """Matings that each robot has published"""
    _alive: set[tuple[str, int, str]] = field(default_factory=set)
    _read_to: int = 0

    def update(self) -> "View":
        """Read what the observer has printed since the last update."""
        with self.process.log.open("rb") as log:
            log.seek(self._read_to)
            data = log.read()
        whole, _, _ = data.rpartition(b"\n")
        self._read_to += len(whole) + bool(whole)
        for text in whole.splitlines():
            self._handle_line(msgspec.json.decode(text, type=Line))
        return self

    def _handle_line(self, line: Line) -> None:
        self.lines.append(line)
        match line:
            case Token(robot=robot, incarnation=incarnation, session=session, is_online=is_online):
                (self._alive.add if is_online else self._alive.discard)(
                    (robot, incarnation, session)
                )
                incarnations = self.incarnations.setdefault(bytes.fromhex(robot), [])
                if is_online and incarnation not in incarnations:
                    incarnations.append(incarnation)
            case StateReceived(state=state):
                self.states[state.robot] = state
            case EventReceived(message=message) if isinstance(message.event, Exchanged):
                self.matings[message.robot] += 1

    def restart(self) -> None:
        """Observe through another session: Zenoh never reconnects two peers of a mesh that have lost each other."""
        self.update()
        self.process.kill()
        self._read_to = self.process.log.stat().st_size  # the last line may be half a line
        self._alive.clear()
        self.process.start()

    def all(self, kind: type[Kind], since: int = 0) -> list[Kind]:
        """Return the lines of one kind, from the given line on."""
        return [line for line in self.update().lines[since:] if isinstance(line, kind)]

    def mated_encounters(self, since: int = 0) -> list[tuple[bytes, Encounter]]:
        """Return robot and encounter of every published mating, from the given line on."""
        return [
            (line.message.robot, line.message.event.encounter)
            for line in self.all(EventReceived, since)
            if isinstance(line.message.event, Exchanged)
        ]

    def is_alive(self, robot: bytes) -> bool:
        """Return whether a robot is online."""
        return any(name == robot.hex() for name, _, _ in self.update()._alive)

    def alive(self) -> set[bytes]:
        """Return the robots that are online."""
        return {bytes.fromhex(name) for name, _, _ in self.update()._alive if name}

    def fresh(self, robots: Sequence[bytes], since_unix_s: float = 0.0) -> list[RobotState]:
        """Return the states that these robots have published in the last 1.5 s, and not before the given time."""
        self.update()
        since_ms = 1000.0 * max(time.time() - 1.5, since_unix_s)
        states = [self.states[robot] for robot in robots if robot in self.states]
        return [state for state in states if state.unix_ms >= since_ms]

    def have_peers(self, robots: Sequence[bytes], peers: int, since_unix_s: float = 0.0) -> bool:
        """Return whether these robots all have bodies and so many peers, at this moment."""
        states = self.fresh(robots, since_unix_s)
        return len(states) == len(robots) and all(
            state.peers == peers and state.arena for state in states
        )

    def are_connected(self, robots: Sequence[bytes], since_unix_s: float = 0.0) -> bool:
        """Return whether these robots have bodies and exactly each other as peers, at this moment."""
        return self.have_peers(robots, len(robots) - 1, since_unix_s)

    def wait_for_matings(self, count: int, of: bytes | None = None) -> None:
        """Wait for more matings, where each side counts for itself."""
        before = self._matings_of(of)
        wait_until(lambda: self._matings_of(of) >= before + count, f"{count} more matings")

    def _matings_of(self, robot: bytes | None) -> int:
        matings = self.update().matings
        return matings.total() if robot is None else matings[robot]


class Colony:
    """Processes of one test, on this machine's loopback unless `before` (in front of a command) enters a namespace."""

    def __init__(self, folder: Path, *more: str) -> None:
        self.folder = folder
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.arenas: list[Process] = []
        self.robots: list[Robot] = []
        self.processes: list[Process] = []
        self._settings = settings(*more)

    def arena(
        self, slots: int, *options: str, name: str = "arena", before: tuple[str, ...] = ()
    ) -> Process:
        """Start an arena, to which all others connect unless their options name another endpoint."""
        if not {"--listen", "--interface", "--client"} & set(options):
            options = (*options, "--listen", self.endpoint)
        out = ["--arena", name, "--robots", str(slots), "--out", str(self.folder / name)]
        arena = self.start(name, "arena", *self._settings, *out, *options, before=before)
        self.arenas.append(arena)
        return arena

    def robot(
        self, *options: str, before: tuple[str, ...] = (), folder: Path | None = None
    ) -> Robot:
        """Start another robot, in a folder of its own or the given one."""
        name = f"robot-{len(self.robots)}"
        folder = folder or self.folder / name
        command = crcolony(
            "robot", *self._settings, "--out", str(folder), *self._with_endpoint(options),
            *_open_network(before),
        )  # fmt: skip
        robot = Robot(command, self.folder / f"{name}.log", before, folder=folder)
        self.robots.append(robot)
        self.processes.append(robot.start())
        return robot

    def observer(self, *options: str, before: tuple[str, ...] = ()) -> View:
        """Start an observer."""
        log = self.folder / f"observer-{len(self.processes)}.jsonl"
        command = [sys.executable, "-m", "tests.support.observer", *self._with_endpoint(options)]
        process = Process(command, log, before)
        self.processes.append(process.start())
        return View(process)

    def dashboard(self) -> tuple[Process, str, Path]:
        """Start a dashboard; return it, its address for viewers, and the folder of its recording."""
        port = free_port()
        out = self.folder / f"watched-{port}"
        options = ("--port", str(port), "--out", str(out), "--connect", self.endpoint)
        process = self.start(f"dashboard-{port}", "dashboard", *options)
        process.wait_for("dashboard at ")
        return process, f"rerun+http://127.0.0.1:{port}/proxy", out

    def start(self, name: str, *options: str, before: tuple[str, ...] = ()) -> Process:
        """Start any command of crcolony."""
        command = crcolony(*options, *_open_network(before))
        process = Process(command, self.folder / f"{name}.log", before)
        self.processes.append(process.start())
        return process

    def _with_endpoint(self, options: Sequence[str]) -> list[str]:
        if {"--connect", "--interface"} & set(options):
            return list(options)
        return [*options, "--connect", self.endpoint]

    @property
    def ids(self) -> list[bytes]:
        """The robots, in the order they were started."""
        return [robot.id for robot in self.robots]

    @property
    def stores(self) -> list[Path]:
        """The files of the robots' stores."""
        return [robot.store for robot in self.robots]

    def outcomes(self) -> Counter[str]:
        """Return how many encounters had each outcome (mated, refused, doubt, …), where each robot counts for itself.

        They are read from the robots' own logs, since telemetry could be forged.
        """
        counts: Counter[str] = Counter()
        for robot in self.robots:
            for line in robot.log.read_text(errors="replace").splitlines():
                if line.startswith("mated with "):
                    counts["mated"] += 1
                elif line.startswith("mating with "):
                    counts[line.split(": ", 1)[1].split()[0]] += 1
        return counts

    def finish(self, view: View) -> None:
        """Stop the arenas, wait until no encounter is open, and stop the robots, which saves them."""
        for arena in self.arenas:
            arena.stop()
        stopped_s = time.monotonic()

        def is_settled() -> bool:
            states = view.fresh(self.ids)
            is_over = time.monotonic() > stopped_s + MatingLimits().contact_s + 1.5
            return (
                is_over and len(states) == len(self.robots) and not any(s.waiting for s in states)
            )

        try:
            wait_until(is_settled, "no encounter is open")
        except AssertionError as error:
            fresh = {state.robot: state.waiting for state in view.fresh(self.ids)}
            error.add_note(f"of {[robot.hex()[:8] for robot in self.ids]} these wait: {fresh}")
            raise
        self.stop_robots()

    def stop_robots(self) -> None:
        """Stop all robots, which saves them."""
        for robot in self.robots:
            robot.signal(signal.SIGTERM)
        for robot in self.robots:
            code = robot.wait()
            assert code == 0, f"exit code {code}: {robot.output}"

    def kill_all(self) -> None:
        """End every process that was started here."""
        for process in self.processes:
            if process.is_running:
                children = psutil.Process(process.pid).children()  # of launch
                process.kill()
                for child in children:
                    child.kill()


def settle(made: Colony, view: View, within_s: float = PATIENCE_S) -> None:
    """Wait until all robots have bodies and each other as peers, and no encounter is open.

    Only states from now on count: a robot that has just been killed has published one a moment ago.
    """
    ids, started_unix_s = made.ids, time.time()

    def is_settled() -> bool:
        return view.are_connected(ids, started_unix_s) and not any(
            state.waiting for state in view.fresh(ids)
        )

    what = "all robots have bodies and peers, and no encounter is open"
    try:
        wait_until(is_settled, what, _OBSERVER_S)
    except AssertionError:  # or the observer has lost one of them for good, in a mesh
        view.restart()
        wait_until(is_settled, what, within_s)


def _open_network(before: tuple[str, ...]) -> list[str]:
    """Return the option without which no process uses a network beyond its machine, if it is in a namespace."""
    return ["--open-network"] if before else []


def crcolony(*options: str) -> list[str]:
    """Return the command as a user types it."""
    return [sys.executable, "-m", "crcolony", *options]


@contextlib.contextmanager
def colony(folder: Path, *more: str) -> Iterator[Colony]:
    """A colony whose processes are killed at the end of the context."""
    made = Colony(folder, *more)
    try:
        yield made
    finally:
        made.kill_all()
