"""When a process has to shut down: on Ctrl-C, on SIGTERM, or after a given time. It then saves and exits."""

import signal
import time
from collections.abc import Callable
from types import FrameType


class ShutdownSignal:
    """Returns, when called, whether to shut down.

    `wake` is called at once in the signal handler, to end a wait. A second Ctrl-C raises KeyboardInterrupt.
    """

    def __init__(
        self, minutes: float | None = None, wake: Callable[[], None] | None = None
    ) -> None:
        self._deadline_s = time.monotonic() + 60.0 * minutes if minutes else None
        self._is_requested = False
        self._wake = wake
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._handle_signal)

    def _handle_signal(self, number: int, _frame: FrameType | None) -> None:
        self._is_requested = True
        signal.signal(number, signal.default_int_handler)
        if self._wake is not None:
            self._wake()

    def __call__(self) -> bool:
        if self._deadline_s is not None and time.monotonic() > self._deadline_s:
            return True
        return self._is_requested
