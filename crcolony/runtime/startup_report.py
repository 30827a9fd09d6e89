"""Says what a process does before it can do its work: to observers twice a second, and to its user in lines."""

import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import NamedTuple

from crcolony.protocol.codec import encode
from crcolony.protocol.telemetry_messages import Activity
from crcolony.telemetry.event_text import format_activity

_PUBLISH_PERIOD_S = 0.5
_LINE_PERIOD_S = 5.0
"""The shortest time between two lines about the same activity."""


class Progress(NamedTuple):
    """What a process does, and how many parts of it are done, of how many; of 0: unknown."""

    doing: str
    done: int = 0
    total: int = 0


class StartupReport:
    """Publishes what `follow` was given, on a thread of its own inside the context: compiling holds the main thread."""

    def __init__(self, publish: Callable[[bytes], None], print_line: Callable[[str], None]) -> None:
        self._publish, self._print_line = publish, print_line
        self._progress: Callable[[], Progress] | None = None
        self._printed = Progress("")
        self._line_due_s = 0.0
        self._is_closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="startup report", daemon=True)

    def __enter__(self) -> "StartupReport":
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._is_closed.set()
        self._thread.join()

    def follow(self, progress: Callable[[], Progress]) -> None:
        """Report from now on what `progress` returns; it is called on another thread."""
        self._progress = progress

    def counting(self, doing: str) -> Callable[[int, int], None]:
        """Return a function that reports this activity, with how many parts are done and of how many."""

        def report(done: int, total: int) -> None:
            progress = Progress(doing, done, total)
            self._progress = lambda: progress

        return report

    def _run(self) -> None:
        while not self._is_closed.wait(_PUBLISH_PERIOD_S):
            if self._progress is not None:
                self._report(self._progress())

    def _report(self, progress: Progress) -> None:
        activity = Activity(int(1000.0 * time.time()), *progress)
        self._publish(encode(activity))
        now_s = time.monotonic()
        is_other = progress.doing != self._printed.doing
        if is_other or (progress != self._printed and now_s >= self._line_due_s):
            self._printed, self._line_due_s = progress, now_s + _LINE_PERIOD_S
            self._print_line(format_activity(activity))
