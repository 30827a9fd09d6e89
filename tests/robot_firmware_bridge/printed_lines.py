"""The lines that an emulator or a simulated robot has printed, which a test waits for."""

import re
import threading


class PrintedLines:
    """Collects lines on one thread, for another one that waits."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._changed = threading.Condition()

    def wait_for(self, pattern: str, within_s: float = 10.0, since: int = 0) -> re.Match[str]:
        """Wait for a line from number `since` on that matches, and return the match."""

        with self._changed:
            match = self._changed.wait_for(lambda: self.match(pattern, since), within_s)
            assert match is not None, self.lines
            return match

    def match(self, pattern: str, since: int) -> re.Match[str] | None:
        """Return the first match among the lines from number `since` on that have been printed so far."""
        matches = (re.match(pattern, line) for line in self.lines[since:])
        return next(filter(None, matches), None)

    def _add(self, line: str) -> None:
        with self._changed:
            self.lines.append(line)
            self._changed.notify_all()
