"""A process that a launch starts on this machine: it is restarted when it dies, and ends with the launch."""

import contextlib
import os
import shutil
import signal
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from crcolony.errors import EXIT_OK, EXIT_WRONG_INPUT
from crcolony.json_log import message_of
from crcolony.runtime.started_process import StartedProcess, StartProcess, start_program

_MAX_STARTS = 5
"""A process that dies after this many starts within a minute is not restarted."""
_START_WINDOW_S = 60.0
_RESTART_DELAY_S = 0.5
_SHUTDOWN_TIMEOUT_S = 30.0
"""How long processes may take to save and exit before they are killed; a starved machine needs some of it."""
_URGENT_TIMEOUT_S = 5.0
"""The same after a second Ctrl-C."""
_POLL_S = 0.02
MAX_LOG_BYTES = 10 * 2**20
"""A longer log of a process goes on in an empty file; one earlier part of it is kept."""
DASHBOARD = "dashboard"
"""Name of the process that shows the colony in a browser."""


@dataclass
class ChildProcess:
    """A process that was started here. Its output goes into `log`."""

    name: str
    command: list[str]
    log: Path
    start_process: StartProcess = start_program
    process: StartedProcess | None = None
    starts: deque[float] = field(default_factory=lambda: deque(maxlen=_MAX_STARTS))
    """Times of the latest starts"""
    ended: str = ""
    """Why it is not restarted; empty: it runs, or will be restarted"""
    restart_at_s: float | None = None
    restarts: int = 0

    def start(self, now_s: float) -> None:
        """Start the process."""
        self.starts.append(now_s)
        self.restart_at_s = None
        with self.log.open("ab") as log:
            self.process = self.start_process(self.command, log)

    def shorten_log(self) -> None:
        """Move what a long log holds into `.1` beside it, in place of what was there; the process writes on.

        It writes at the end of the file, wherever that is. What it writes while the file is copied may be lost.
        """
        with contextlib.suppress(OSError):  # a full disk: the log goes on as it is
            if self.log.stat().st_size > MAX_LOG_BYTES:
                shutil.copyfile(self.log, self.log.with_name(f"{self.log.name}.1"))
                os.truncate(self.log, 0)

    def restart_if_dead(self, now_s: float) -> str | None:
        """Restart the process, after a delay, if it has died; return what happened as text, or None."""
        if self.restart_at_s is not None and now_s >= self.restart_at_s:
            self.restarts += 1
            self.start(now_s)
            return f"{self.name} is restarted"
        if self.process is None or self.process.poll() is None:
            return None
        code = self.process.returncode
        assert code is not None
        self.release()
        if code == EXIT_OK:
            self.ended = "done"
            return None
        if code == EXIT_WRONG_INPUT:
            self.ended = last_line(self.log)
            return f"{self.name} cannot run: {self.ended}"
        how = f"killed by {signal.Signals(-code).name}" if code < 0 else f"ended with {code}"
        if len(self.starts) == _MAX_STARTS and now_s - self.starts[0] < _START_WINDOW_S:
            self.ended = f"{how}, {_MAX_STARTS} times in a minute"
            return f"{self.name}: {self.ended}; see {self.log}"
        self.restart_at_s = now_s + _RESTART_DELAY_S
        return f"{self.name}: {how}"

    @property
    def is_robot(self) -> bool:
        """Whether it is the process of a robot."""
        return self.name.startswith("robot")

    @property
    def is_observer(self) -> bool:
        """Whether the colony runs without it."""
        return self.name == DASHBOARD

    @property
    def is_over(self) -> bool:
        """Whether it has ended and is not restarted."""
        return bool(self.ended)

    @property
    def is_running(self) -> bool:
        """Whether there is a process now."""
        return self.process is not None and self.process.poll() is None

    def terminate(self) -> None:
        """Send SIGTERM, on which it saves and exits; one that is stopped is continued."""
        if self.process is not None and self.is_running:
            self.process.send_signal(signal.SIGTERM)
            self.process.send_signal(signal.SIGCONT)

    def release(self) -> None:
        """Kill the process if it is still running, and close its pipe."""
        if self.process is not None:
            self.process.send_signal(signal.SIGKILL)
            with self.process:
                self.process = None


def end_all(children: Sequence[ChildProcess], is_urgent: Callable[[], bool]) -> None:
    """Terminate the robots, then the others, and wait for each; if urgent, all at once, and for a shorter time."""
    robots = [child for child in children if child.is_robot]
    for child in robots:
        child.terminate()
    _wait_for(robots, lambda: 0.0 if is_urgent() else _SHUTDOWN_TIMEOUT_S)
    for child in children:
        child.terminate()
    _wait_for(children, lambda: _URGENT_TIMEOUT_S if is_urgent() else _SHUTDOWN_TIMEOUT_S)
    for child in children:
        child.release()


def _wait_for(children: Sequence[ChildProcess], timeout_s: Callable[[], float]) -> None:
    """Wait until these processes have ended, at most for a time that may become shorter meanwhile."""
    started_s = time.monotonic()
    while (
        any(child.is_running for child in children) and time.monotonic() - started_s < timeout_s()
    ):
        time.sleep(_POLL_S)


def dashboard_address(log: Path) -> str | None:
    """Return the address that a dashboard has printed into its log, or None."""
    with contextlib.suppress(OSError):
        for line in map(message_of, log.read_text("utf-8", "replace").splitlines()):
            if "http://" in line and "browser" in line:
                return line[line.index("http://") :]
    return None


def last_line(log: Path) -> str:
    """Return the last line of a log."""
    try:
        lines = log.read_text("utf-8", "replace").strip().splitlines()
    except OSError:
        return "it printed nothing"
    return message_of(lines[-1]) if lines else "it printed nothing"
