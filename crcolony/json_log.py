"""The output of a process as JSON lines, for programs that collect logs: one object a line, and nothing else.

Whatever is printed, by whichever module, becomes an object: standard output and standard error are replaced once, by
the command line.
"""

import contextlib
import io
import json
import os
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from typing import Literal, TextIO

LOG_FORMAT = "CRCOLONY_LOG_FORMAT"
"""Environment variable with the format of a process's output: that of an option, for all processes of a machine."""
FORMATS = ("lines", "json")

Level = Literal["info", "warning", "error", "critical"]


class JsonLog:
    """Formats messages of one process. `names` say which it is, and are added to as it becomes known."""

    def __init__(self, process: str, clock: Callable[[], float] = time.time) -> None:
        self.names: dict[str, str] = {}
        """Such as colony, arena and robot"""
        self._process, self._clock = process, clock

    def format(self, message: str, level: Level, **more: str) -> str:
        """Return a record as one line, in ASCII."""
        seconds, milliseconds = divmod(int(1000.0 * self._clock()), 1000)
        day = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds))
        record = {"time": f"{day}.{milliseconds:03d}Z", "level": level, "process": self._process}
        return json.dumps({**record, **self.names, "message": message, **more}) + "\n"


class JsonLines(io.TextIOBase):
    """A stream that writes each line as a record; lines of several threads are not mixed."""

    def __init__(self, target: TextIO, log: JsonLog, level: Level) -> None:
        self.log = log
        self._target, self._level, self._lock = target, level, threading.Lock()
        self._begun = threading.local()
        """What each thread has written since its last line end"""

    def write(self, text: str, /) -> int:
        """Write the lines that end in a text, and keep the rest until its line ends."""
        *lines, self._begun.text = (getattr(self._begun, "text", "") + text).split("\n")
        for line in lines:
            self.write_line(line, self._level)
        return len(text)

    def write_line(self, line: str, level: Level, **more: str) -> None:
        """Write one record, unless the line is empty."""
        message = line.removeprefix("crcolony: ").rstrip()
        if message:
            with self._lock:
                self._target.write(self.log.format(message, level, **more))
                self._target.flush()

    def close_line(self) -> None:
        """Write what has no line end yet."""
        if getattr(self._begun, "text", ""):
            self.write("\n")

    def flush(self) -> None:
        """Flush what was written; a line that has not ended stays."""
        self._target.flush()

    def fileno(self) -> int:
        """Return the descriptor behind it."""
        return self._target.fileno()

    def writable(self) -> bool:
        """Return True."""
        return True

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Records are ASCII, so a message may hold anything."""
        return "utf-8"


@contextlib.contextmanager
def json_output(process: str) -> Iterator[None]:
    """Let this process, and those that it starts, print JSON lines inside the context.

    A bug that ends the process is a record too: raises SystemExit in its place.
    """
    log = JsonLog(process)
    stdout, stderr, before = sys.stdout, sys.stderr, os.environ.get(LOG_FORMAT)
    output, errors = JsonLines(stdout, log, "info"), JsonLines(stderr, log, "error")
    sys.stdout, sys.stderr = output, errors
    os.environ[LOG_FORMAT] = "json"
    try:
        yield
    except Exception as bug:
        text = "".join(traceback.format_exception(bug))
        errors.write_line(f"{type(bug).__name__}: {bug}", "critical", traceback=text)
        raise SystemExit(1) from None
    finally:
        output.close_line()
        errors.close_line()
        sys.stdout, sys.stderr = stdout, stderr
        if before is None:
            del os.environ[LOG_FORMAT]
        else:
            os.environ[LOG_FORMAT] = before


def message_of(line: str) -> str:
    """Return the message of a line of a log, which may be a record or plain text."""
    if line.startswith("{"):
        with contextlib.suppress(ValueError, KeyError, TypeError):
            return str(json.loads(line)["message"])
    return line.removeprefix("crcolony: ")
