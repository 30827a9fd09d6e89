"""Colonies of real processes, for tests: started, killed, stopped, paused, and watched from outside."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import msgspec
import psutil

from crcolony.colony.messages import Encounter
from crcolony.colony.network import free_port
from crcolony.colony.telemetry import Exchanged, State
from tests.system.observer import Happened, Line, Stated, Token

ROOT = Path(__file__).parents[2]

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


def wait_until(condition: Callable[[], object], what: str, within_s: float = 60.0) -> float:
    """Wait for a condition, and return how long it took; fails, naming what was waited for."""
    begun_s = time.monotonic()
    while not condition():
        if time.monotonic() - begun_s > within_s:
            raise AssertionError(f"in {within_s:g} s it did not happen: {what}")
        time.sleep(0.02)
    return time.monotonic() - begun_s


@dataclass
class Process:
    """A process whose output goes into a file. `before` are words in front of the command (another namespace)."""

    command: list[str]
    log: Path
    before: tuple[str, ...] = ()
    cwd: Path = ROOT
    _running: subprocess.Popen[bytes] | None = None
    _life_at: int = 0
    """Where in the log its present life begins"""

    def start(self) -> "Process":
        """Start it, or start it again after it has ended."""
        assert not self.is_running, "it runs already"
        with self.log.open("ab") as log:
            self._life_at = log.tell()
            self._running = subprocess.Popen(
                [*self.before, *self.command],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=self.cwd,
                env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
                start_new_session=True,
            )
        return self

    @property
    def is_running(self) -> bool:
        return self._running is not None and self._running.poll() is None

    @property
    def pid(self) -> int:
        assert self._running is not None
        return self._running.pid

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal, by its own pid."""
        assert self._running is not None
        self._running.send_signal(number)

    def kill(self) -> None:
        """kill -9, and wait until it is gone."""
        assert self._running is not None
        self._running.kill()
        self._running.wait()

    def stop(self, within_s: float = 30.0) -> float:
        """SIGTERM; return how long it took to end well."""
        begun_s = time.monotonic()
        self.signal(signal.SIGTERM)
        assert self.wait(within_s) == 0, self.said
        return time.monotonic() - begun_s

    def wait(self, within_s: float = 60.0) -> int:
        """Wait until it has ended by itself, and return its exit code."""
        assert self._running is not None
        return self._running.wait(within_s)

    @property
    def said(self) -> str:
        """What it has said in its present life."""
        with self.log.open("rb") as log:
            log.seek(self._life_at)
            return log.read().decode(errors="replace")

    def wait_for(self, words: str, count: int = 1, within_s: float = 60.0) -> None:
        """Wait until it has said something, so many times, in its present life."""

        def has_said() -> bool:
            return self.said.count(words) >= count or not self.is_running

        wait_until(has_said, f"{self.log.name} says {words!r}", within_s)
        assert self.said.count(words) >= count, f"it ended without {words!r}: {self.said}"


@dataclass
class Robot(Process):
    """A robot's process, and its memory."""

    folder: Path = Path()

    @property
    def id(self) -> bytes:
        """Its id, once it has said it."""
        self.wait_for("robot ")
        _, _, after = self.said.partition("robot ")
        return bytes.fromhex(after.split()[0])

    @property
    def memory(self) -> Path:
        return self.folder / "memory.sqlite"

    @property
    def has_body(self) -> bool:
        """Whether it has had a body in its present life."""
        return "has body" in self.said


Kind = TypeVar("Kind", Token, Stated, Happened)


@dataclass
class View:
    """What an observer has heard, as a list and by robot."""

    process: Process
    lines: list[Line] = field(default_factory=list)
    states: dict[bytes, State] = field(default_factory=dict)
    lives: dict[bytes, list[int]] = field(default_factory=dict)
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
            case Token(robot=robot, life=life, session=session, there=there):
                (self._alive.add if there else self._alive.discard)((robot, life, session))
                lives = self.lives.setdefault(bytes.fromhex(robot), [])
                if there and life not in lives:
                    lives.append(life)
            case Stated(state=state):
                self.states[state.robot] = state
            case Happened(told=told) if isinstance(told.event, Exchanged):
                self.matings[told.robot] += 1

    def all(self, kind: type[Kind], since: int = 0) -> list[Kind]:
        """Return the lines of one kind, from the given line on."""
        return [line for line in self.update().lines[since:] if isinstance(line, kind)]

    def exchanges(self, since: int = 0) -> list[tuple[bytes, Encounter]]:
        """Return who has told of which mating, from the given line on."""
        return [
            (line.told.robot, line.told.event.encounter)
            for line in self.all(Happened, since)
            if isinstance(line.told.event, Exchanged)
        ]

    def is_alive(self, robot: bytes) -> bool:
        """Whether a robot is on the network."""
        return any(name == robot.hex() for name, _, _ in self.update()._alive)

    def alive(self) -> set[bytes]:
        """Return who is on the network; arenas are not in it."""
        return {bytes.fromhex(name) for name, _, _ in self.update()._alive if name}

    def fresh(self, robots: Sequence[bytes], within_s: float = 1.5) -> list[State]:
        """Return what these robots have told of themselves just now."""
        self.update()
        since_ms = 1000.0 * (time.time() - within_s)
        states = [self.states[robot] for robot in robots if robot in self.states]
        return [state for state in states if state.unix_ms >= since_ms]

    def sees(self, robots: Sequence[bytes], peers: int) -> bool:
        """Whether these robots all have bodies and see so many others, at this moment."""
        states = self.fresh(robots)
        return len(states) == len(robots) and all(
            state.peers == peers and state.arena for state in states
        )

    def all_see_all(self, robots: Sequence[bytes]) -> bool:
        """Whether these robots have bodies and see each other, and nobody else, at this moment."""
        return self.sees(robots, len(robots) - 1)

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
        return self.start(name, "arena", *self._settings, *out, *words, before=before)

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
        command = [sys.executable, "-m", "tests.system.observer", *self._reach(words)]
        process = Process(command, log, before)
        self.processes.append(process.start())
        return View(process)

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
    """Wait until all robots have bodies, see each other, and wait for nobody."""
    ids = made.ids

    def is_settled() -> bool:
        return view.all_see_all(ids) and not any(state.waiting for state in view.fresh(ids))

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
