"""One process of a test: started, started again, killed, paused, stopped, and waited for by what it says."""

import os
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.support.paths import PYTHONPATH, ROOT


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
                env=os.environ | {"PYTHONPATH": PYTHONPATH, "PYTHONUNBUFFERED": "1"},
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
        return self.folder / "robot.sqlite"

    @property
    def has_body(self) -> bool:
        """Whether it has had a body in its present life."""
        return "has body" in self.said
