"""A terminal into which a test types as a person does, and whose screen it reads."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import pexpect
import pyte

COLUMNS, LINES = 120, 40
_POLL_S = 0.2


class Terminal:
    """One command in a pseudo-terminal; `screen` is what a person sees of it, `text` all that it has printed."""

    def __init__(self, command: str, folder: Path, environment: dict[str, str]) -> None:
        self.text = ""
        self._pyte_screen = pyte.Screen(COLUMNS, LINES)
        self._stream = pyte.Stream(self._pyte_screen)
        self._child: pexpect.spawn[str] = pexpect.spawn(
            "/bin/sh",
            ["-c", f"exec {command}"],
            cwd=str(folder),
            env={**os.environ, **environment, "TERM": "xterm-256color"},
            dimensions=(LINES, COLUMNS),
            encoding="utf-8",
        )

    @property
    def screen(self) -> str:
        """The lines on the screen, without colours and cursor movements."""
        return "\n".join(line.rstrip() for line in self._pyte_screen.display).rstrip()

    def wait_for(self, condition: Callable[[str], object], what: str, within_s: float) -> None:
        """Wait until a condition of the screen holds; fails with the screen, after a time or when the command ends."""
        until_s = time.monotonic() + within_s
        while not condition(self.screen):
            assert time.monotonic() < until_s, f"not within {within_s:g} s: {what}\n{self.screen}"
            if not self._read():
                assert condition(self.screen), f"it ended without {what}\n{self.screen}"
                return

    def press_ctrl_c(self) -> None:
        """Press Ctrl-C."""
        self._child.sendintr()

    def wait_for_end(self, within_s: float) -> int:
        """Wait until the command has ended, and return its exit code."""
        until_s = time.monotonic() + within_s
        while self._read():
            assert time.monotonic() < until_s, f"it has not ended\n{self.screen}"
        self._child.close()
        return int(self._child.exitstatus if self._child.exitstatus is not None else -1)

    def close(self) -> None:
        """End the command if it still runs."""
        self._child.close(force=True)

    def _read(self) -> bool:
        """Read what was printed meanwhile; return False when the command has ended."""
        try:
            printed = self._child.read_nonblocking(65536, _POLL_S)
        except pexpect.TIMEOUT:
            return True
        except pexpect.EOF:
            return False
        self.text += printed
        self._stream.feed(printed)
        return True
