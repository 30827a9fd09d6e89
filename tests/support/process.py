"""One process of a test: started, restarted, killed, paused, stopped, and waited for by what it prints."""

import os
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.support.paths import PYTHONPATH, ROOT

PATIENCE_S = 180.0
"""For what must happen but may happen late: by chance (when two robots want to mate), or on a machine with much else to
do. A promise about time names its own."""


def wait_until(condition: Callable[[], object], what: str, within_s: float = PATIENCE_S) -> float:
    """Wait for a condition, and return how long it took (s); fails, naming the condition, after `within_s`."""
    started_s = time.monotonic()
    while not condition():
        if time.monotonic() - started_s > within_s:
            raise AssertionError(f"not within {within_s:g} s: {what}")
        time.sleep(0.02)
    return time.monotonic() - started_s


@dataclass
class Process:
    """A process whose output goes into a file. `before` is put in front of the command (for another namespace)."""

    command: list[str]
    log: Path
    before: tuple[str, ...] = ()
    cwd: Path = ROOT
    _running: subprocess.Popen[bytes] | None = None
    _start_offset: int = 0
    """Where in the log the output of its latest start begins"""

    def start(self) -> "Process":
        """Start it, or restart it after it has exited."""
        assert not self.is_running, "it is running"
        with self.log.open("ab") as log:
            self._start_offset = log.tell()
            self._running = subprocess.Popen(
                [*self.before, *self.command],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=self.cwd,
                env=os.environ
                | {
                    "PYTHONPATH": PYTHONPATH,
                    "PYTHONUNBUFFERED": "1",
                    "CRCOLONY_OPEN_NETWORK": "yes",  # and --open-network where a test leaves loopback
                },
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
        """Send SIGKILL, and wait until it has exited."""
        assert self._running is not None
        self._running.kill()
        self._running.wait()

    def stop(self, within_s: float = 30.0) -> float:
        """Send SIGTERM; return how long it took to exit with 0 (s)."""
        started_s = time.monotonic()
        self.signal(signal.SIGTERM)
        assert self.wait(within_s) == 0, self.output
        return time.monotonic() - started_s

    def wait(self, within_s: float = PATIENCE_S) -> int:
        """Wait until it has exited, and return its exit code."""
        assert self._running is not None
        return self._running.wait(within_s)

    @property
    def output(self) -> str:
        """What it has printed since its latest start."""
        with self.log.open("rb") as log:
            log.seek(self._start_offset)
            return log.read().decode(errors="replace")

    def wait_for(self, text: str, count: int = 1, within_s: float = PATIENCE_S) -> None:
        """Wait until it has printed a text, so many times, since its latest start."""

        def has_printed() -> bool:
            return self.output.count(text) >= count or not self.is_running

        try:
            wait_until(has_printed, f"{self.log.name} prints {text!r}", within_s)
        except AssertionError as error:
            error.add_note(f"It printed: {self.output[-2000:]}")
            raise
        assert self.output.count(text) >= count, f"it exited without {text!r}: {self.output}"


@dataclass
class Robot(Process):
    """A robot's process, with the folder of its store."""

    folder: Path = Path()

    @property
    def id(self) -> bytes:
        """Its id, once it has printed it."""
        self.wait_for("robot ")
        _, _, after = self.output.partition("robot ")
        return bytes.fromhex(after.split()[0])

    @property
    def store(self) -> Path:
        """The file of its store."""
        return self.folder / "robot.sqlite"

    @property
    def has_body(self) -> bool:
        """Whether it has had a body since its latest start."""
        return "has body" in self.output
