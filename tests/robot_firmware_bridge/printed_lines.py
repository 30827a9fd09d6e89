"""The lines that an emulator or a simulated robot has printed, which a test waits for."""

import re
import subprocess
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


class LineProcess(PrintedLines):
    """A process that prints lines, and is told others on its standard input."""

    _process: "subprocess.Popen[str]"
    _reading: threading.Thread

    def _begin(self, process: "subprocess.Popen[str]") -> None:
        """Collect from now on what a process prints that has just been started, with pipes."""
        self._process = process
        self._reading = threading.Thread(target=self._read, args=(process,), daemon=True)
        self._reading.start()

    def tell(self, line: str) -> None:
        """Have it read a line."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")

    def kill(self) -> None:
        """Kill it, if it runs."""
        end_process(self._process, self._reading)

    def _read(self, process: "subprocess.Popen[str]") -> None:
        assert process.stdout is not None
        for line in process.stdout:
            self._add(line.strip())


def end_process(process: "subprocess.Popen[str]", reading: threading.Thread) -> None:
    """Kill a process whose output a thread reads, and close its pipes."""
    process.kill()
    process.wait()
    reading.join()
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        pipe.close()
