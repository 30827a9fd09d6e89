"""Colonies of real processes, for tests: put together, watched from outside, and ended."""

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
from tests.support.observer import EventReceived, Line, Stated, Token
from tests.support.paths import ROOT
from tests.support.process import Process, Robot, wait_until

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
    """Return the words that set `BUSY`, and more."""
    return [word for setting in (*BUSY, *more) for word in ("--set", setting)]


Kind = TypeVar("Kind", Token, Stated, EventReceived)


@dataclass
class View:
    """What an observer has heard, as a list and by robot."""

    process: Process
    lines: list[Line] = field(default_factory=list)
    states: dict[bytes, RobotState] = field(default_factory=dict)
    incarnations: dict[bytes, list[int]] = field(default_factory=dict)
    """Of every robot, its lives as tokens told them, in order"""
    matings: Counter[bytes] = field(default_factory=Counter)
    """Matings of every robot that were told"""
    _alive: set[tuple[str, int, str]] = field(default_factory=set)
    _read_to: int = 0

    def update(self) -> "View":
        """Take in what was said since the last time."""
        with self.process.log.open("rb") as log:
            log.seek(self._read_to)
            data = log.read()
        whole, _, _ = data.rpartition(b"\n")
        self._read_to += len(whole) + bool(whole)
        for text in whole.splitlines():
            self._take(msgspec.json.decode(text, type=Line))
        return self

    def _take(self, line: Line) -> None:
        self.lines.append(line)
        match line:
            case Token(robot=robot, incarnation=incarnation, session=session, there=there):
                (self._alive.add if there else self._alive.discard)((robot, incarnation, session))
                incarnations = self.incarnations.setdefault(bytes.fromhex(robot), [])
                if there and incarnation not in incarnations:
                    incarnations.append(incarnation)
            case Stated(state=state):
                self.states[state.robot] = state
            case EventReceived(message=message) if isinstance(message.event, Exchanged):
                self.matings[message.robot] += 1

    def all(self, kind: type[Kind], since: int = 0) -> list[Kind]:
        """Return the lines of one kind, from the given line on."""
        return [line for line in self.update().lines[since:] if isinstance(line, kind)]

    def mating_driver(self, since: int = 0) -> list[tuple[bytes, Encounter]]:
        """Return who has told of which mating, from the given line on."""
        return [
            (line.message.robot, line.message.event.encounter)
            for line in self.all(EventReceived, since)
            if isinstance(line.message.event, Exchanged)
        ]

    def is_alive(self, robot: bytes) -> bool:
        """Whether a robot is on the network."""
        return any(name == robot.hex() for name, _, _ in self.update()._alive)

    def alive(self) -> set[bytes]:
        """Return who is on the network; arenas are not in it."""
        return {bytes.fromhex(name) for name, _, _ in self.update()._alive if name}

    def fresh(self, robots: Sequence[bytes], since_unix_s: float = 0.0) -> list[RobotState]:
        """Return what these robots have told of themselves just now, and not before the given time."""
        self.update()
        since_ms = 1000.0 * max(time.time() - 1.5, since_unix_s)
        states = [self.states[robot] for robot in robots if robot in self.states]
        return [state for state in states if state.unix_ms >= since_ms]

    def sees(self, robots: Sequence[bytes], peers: int, since_unix_s: float = 0.0) -> bool:
        """Whether these robots all have bodies and see so many others, at this moment."""
        states = self.fresh(robots, since_unix_s)
        return len(states) == len(robots) and all(
            state.peers == peers and state.arena for state in states
        )

    def all_see_all(self, robots: Sequence[bytes], since_unix_s: float = 0.0) -> bool:
        """Whether these robots have bodies and see each other, and nobody else, at this moment."""
        return self.sees(robots, len(robots) - 1, since_unix_s)

    def wait_for_matings(self, count: int, of: bytes | None = None) -> None:
        """Wait until there have been more matings, each side counting for itself."""
        before = self._matings_of(of)
        wait_until(lambda: self._matings_of(of) >= before + count, f"{count} more matings")

    def _matings_of(self, robot: bytes | None) -> int:
        matings = self.update().matings
        return matings.total() if robot is None else matings[robot]


class Colony:
    """Processes of one test. Without `before` (words in front of a command) they are on this machine's loopback."""

    def __init__(self, folder: Path, *more: str) -> None:
        self.folder = folder
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.arenas: list[Process] = []
        self.robots: list[Robot] = []
        self.processes: list[Process] = []
        self._settings = settings(*more)

    def arena(
        self, places: int, *words: str, name: str = "arena", before: tuple[str, ...] = ()
    ) -> Process:
        """Start an arena; it is where all others find each other, unless words say otherwise."""
        if not {"--listen", "--interface", "--client"} & set(words):
            words = (*words, "--listen", self.endpoint)
        out = ["--arena", name, "--robots", str(places), "--out", str(self.folder / name)]
        arena = self.start(name, "arena", *self._settings, *out, *words, before=before)
        self.arenas.append(arena)
        return arena

    def robot(self, *words: str, before: tuple[str, ...] = ()) -> Robot:
        """Start one more robot."""
        name = f"robot-{len(self.robots)}"
        folder = self.folder / name
        command = crcolony("robot", *self._settings, "--out", str(folder), *self._reach(words))
        robot = Robot(command, self.folder / f"{name}.log", before, folder=folder)
        self.robots.append(robot)
        self.processes.append(robot.start())
        return robot

    def observer(self, *words: str, before: tuple[str, ...] = ()) -> View:
        """Start somebody who watches."""
        log = self.folder / f"observer-{len(self.processes)}.jsonl"
        command = [sys.executable, "-m", "tests.support.observer", *self._reach(words)]
        process = Process(command, log, before)
        self.processes.append(process.start())
        return View(process)

    def dashboard(self) -> tuple[Process, str, Path]:
        """Start a dashboard; return it, where viewers find it, and where it records."""
        port = free_port()
        out = self.folder / f"watched-{port}"
        words = ("--port", str(port), "--out", str(out), "--connect", self.endpoint)
        process = self.start(f"dashboard-{port}", "dashboard", *words)
        process.wait_for("dashboard at ")
        return process, f"rerun+http://127.0.0.1:{port}/proxy", out

    def start(self, name: str, *words: str, before: tuple[str, ...] = ()) -> Process:
        """Start any command of crcolony."""
        process = Process(crcolony(*words), self.folder / f"{name}.log", before)
        self.processes.append(process.start())
        return process

    def _reach(self, words: Sequence[str]) -> list[str]:
        if {"--connect", "--interface"} & set(words):
            return list(words)
        return [*words, "--connect", self.endpoint]

    @property
    def ids(self) -> list[bytes]:
        """The robots, in the order they were started."""
        return [robot.id for robot in self.robots]

    @property
    def memories(self) -> list[Path]:
        """Where the robots' memories are."""
        return [robot.memory for robot in self.robots]

    def outcomes(self) -> Counter[str]:
        """Return what became of encounters so far (mated, refused, doubt, …), each robot counting for itself.

        By the robots' own logs: nothing on the network is believed.
        """
        found: Counter[str] = Counter()
        for robot in self.robots:
            for line in robot.log.read_text(errors="replace").splitlines():
                if line.startswith("mated with "):
                    found["mated"] += 1
                elif line.startswith("mating with "):
                    found[line.split(": ", 1)[1].split()[0]] += 1
        return found

    def calm_down(self, view: View) -> None:
        """Stop the arenas, let the robots end what is under way between them, and stop them, which saves them."""
        for arena in self.arenas:
            arena.stop()
        stopped_s = time.monotonic()

        def is_calm() -> bool:
            states = view.fresh(self.ids)
            is_over = time.monotonic() > stopped_s + MatingLimits().contact_s + 1.5
            return (
                is_over and len(states) == len(self.robots) and not any(s.waiting for s in states)
            )

        wait_until(is_calm, "no robot has a body or waits for another")
        self.stop_robots()

    def stop_robots(self) -> None:
        """Stop all robots, which saves them."""
        for robot in self.robots:
            robot.signal(signal.SIGTERM)
        for robot in self.robots:
            assert robot.wait() == 0, robot.said

    def kill_all(self) -> None:
        """End every process that was started here."""
        for process in self.processes:
            if process.is_running:
                children = psutil.Process(process.pid).children()  # of launch
                process.kill()
                for child in children:
                    child.kill()


def settle(made: Colony, view: View, within_s: float = 90.0) -> None:
    """Wait until all robots have bodies, see each other, and wait for nobody.

    By what they say from now on: a robot that has just been killed has said a moment ago that all is well.
    """
    ids, begun_unix_s = made.ids, time.time()

    def is_settled() -> bool:
        return view.all_see_all(ids, begun_unix_s) and not any(
            state.waiting for state in view.fresh(ids)
        )

    wait_until(is_settled, "all robots have bodies, see each other and wait for nobody", within_s)


def crcolony(*words: str) -> list[str]:
    """Return the command as a user types it."""
    return [sys.executable, "-m", "crcolony", *words]


@contextlib.contextmanager
def colony(folder: Path, *more: str) -> Iterator[Colony]:
    """A colony whose processes are gone when this is left."""
    made = Colony(folder, *more)
    try:
        yield made
    finally:
        made.kill_all()
