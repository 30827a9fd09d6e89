"""A process that a launch starts on this machine: it is restarted when it dies, and terminated at the end."""

import contextlib
import signal
import subprocess
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

from crcolony.errors import EXIT_OK, EXIT_WRONG_INPUT

_MAX_STARTS = 5
"""A process that dies after this many starts within a minute is not restarted."""
_START_WINDOW_S = 60.0
_RESTART_DELAY_S = 0.5
DASHBOARD = "dashboard"
"""Name of the process that shows the colony in a browser."""


@dataclass
class ChildProcess:
    """A process that was started here. Its output goes into `log`."""

    name: str
    command: list[str]
    log: Path
    process: subprocess.Popen[bytes] | None = None
    starts: deque[float] = field(default_factory=lambda: deque(maxlen=_MAX_STARTS))
    """Times of the latest starts"""
    ended: str = ""
    """Why it is not restarted; empty: it runs, or will be restarted"""
    restart_at_s: float | None = None
    restarts: int = 0

    def start(self, now_s: float) -> None:
        """Start the process, in a session of its own, so that Ctrl-C here does not reach it."""
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
        """Restart the process, after a delay, if it has died; return what happened as text, or None."""
        if self.restart_at_s is not None and now_s >= self.restart_at_s:
            self.restarts += 1
            self.start(now_s)
            return f"{self.name} is restarted"
        if self.process is None or self.process.poll() is None:
            return None
        code, self.process = self.process.returncode, None
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

    def terminate(self) -> None:
        """Send SIGTERM, on which it saves and exits."""
        if self.process is not None and self.process.poll() is None:
            self.process.terminate()

    def wait(self, until_s: float) -> None:
        """Wait until it has exited; kill it at `until_s`."""
        if self.process is None:
            return
        try:
            self.process.wait(max(until_s - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def dashboard_address(log: Path) -> str | None:
    """Return the address that a dashboard has printed into its log, or None."""
    with contextlib.suppress(OSError):
        for line in log.read_text("utf-8", "replace").splitlines():
            if "http://" in line and "browser" in line:
                return line[line.index("http://") :]
    return None


def last_line(log: Path) -> str:
    """Return the last line of a log."""
    try:
        lines = log.read_text("utf-8", "replace").strip().splitlines()
    except OSError:
        return "it printed nothing"
    return lines[-1].removeprefix("crcolony: ") if lines else "it printed nothing"
