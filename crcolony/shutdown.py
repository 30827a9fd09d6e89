"""How a process is told to stop: Ctrl-C or SIGTERM, or its time is over. It then saves, says goodbye and is gone."""

import signal
import time
from collections.abc import Callable
from types import FrameType


class ShutdownSignal:
    """Tells whether to stop. `wake` is called at once when a signal comes; a second Ctrl-C interrupts hard."""

    def __init__(
        self, minutes: float | None = None, wake: Callable[[], None] | None = None
    ) -> None:
        self._deadline_s = time.monotonic() + 60.0 * minutes if minutes else None
        self._asked = False
        self._wake = wake
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)

    def _ask(self, number: int, _frame: FrameType | None) -> None:
        self._asked = True
        signal.signal(number, signal.default_int_handler)
        if self._wake is not None:
            self._wake()

    def __call__(self) -> bool:
        if self._deadline_s is not None and time.monotonic() > self._deadline_s:
            return True
        return self._asked
