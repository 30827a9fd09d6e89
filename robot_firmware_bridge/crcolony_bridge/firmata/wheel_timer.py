"""The time to live of a command, kept by this process because the robot keeps none."""

import threading
import time
from collections.abc import Callable


class WheelTimer:
    """Stops the wheels when the time to live is over, on a thread of its own that lives while they turn.

    The thread does not need whoever drives, and the interpreter does not end before it. It needs this process to run
    and the link to carry: of a process that is killed or frozen, or behind a pulled cable, the wheels turn on.

    `mutex` is held while wheels are commanded; `stop` is called with it, so that no stop overtakes a fresh command.
    """

    def __init__(self, mutex: threading.RLock, stop: Callable[[], None]) -> None:
        self._changed = threading.Condition(mutex)
        self._stop = stop
        self._due_s = 0.0
        self._thread: threading.Thread | None = None

    @property
    def is_running(self) -> bool:
        """Whether a command is alive."""
        return time.monotonic() < self._due_s

    def start(self, ttl_s: float) -> None:
        """Stop the wheels in so many seconds from now, and not when it was said before."""
        with self._changed:
            self._due_s = time.monotonic() + ttl_s
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="wheel timer")
                self._thread.start()
            self._changed.notify()

    def end(self) -> None:
        """Stop the wheels now."""
        with self._changed:
            self._due_s = 0.0
            self._changed.notify()

    def _run(self) -> None:
        with self._changed:
            while (left_s := self._due_s - time.monotonic()) > 0.0:
                self._changed.wait(left_s)
            self._thread = None
            self._stop()
