"""What a base is commanded: a motion for as long as it may last, and nothing else than standing still while latched."""

import threading
import time
from collections.abc import Callable

_PERIOD_S = 0.1
"""Between commands to stand still."""
_REPEATS = 3
"""How often that is said when a motion is over: a sample may be dropped where the network is congested."""


class WheelCommands:
    """Sends commands with `send`, speed ahead (m/s) and turning rate (rad/s), and stops the base in time.

    A thread of this process ends a motion whose time is over, and repeats while latched that the base has to stand
    still: somebody else may command it, too. Any thread may call the methods. `send` raises nothing.
    """

    def __init__(self, send: Callable[[float, float], None], *, is_latched: bool) -> None:
        self._send = send
        self._changed = threading.Condition()
        self._is_latched, self._latched_s = is_latched, time.monotonic()
        self._is_closed = False
        self._zeros_left = 0
        self._due_s = 0.0
        """When the base has to be told to stand still"""
        self._thread = threading.Thread(target=self._run, name="wheel commands", daemon=True)
        self._thread.start()

    @property
    def latched_s(self) -> float | None:
        """Since when nothing but standing still is commanded; None if motion is."""
        with self._changed:
            return self._latched_s if self._is_latched else None

    def drive(self, ahead_m_s: float, turn_rad_s: float, ttl_s: float) -> None:
        """Command a motion that lasts for so long, unless another command comes before."""
        with self._changed:
            if self._is_latched or self._is_closed:
                return  # the thread repeats that it has to stand still, or ends no motion any more
            if ttl_s <= 0.0:
                ahead_m_s = turn_rad_s = 0.0
            self._send(ahead_m_s, turn_rad_s)
            self._plan(time.monotonic() + ttl_s, _REPEATS if ahead_m_s or turn_rad_s else 0)

    def stand_still(self) -> None:
        """Command to stand still."""
        self.drive(0.0, 0.0, 0.0)

    def latch(self) -> None:
        """Stop at once, and command nothing else until `release`."""
        with self._changed:
            if not self._is_latched:
                self._is_latched, self._latched_s = True, time.monotonic()
            self._send(0.0, 0.0)
            self._plan(time.monotonic() + _PERIOD_S, 0)

    def release(self) -> None:
        """Allow motion again."""
        with self._changed:
            self._is_latched = False

    def close(self) -> None:
        """Stop, and end the thread."""
        with self._changed:
            if not self._is_closed:
                self._is_closed = True
                self._send(0.0, 0.0)
                self._changed.notify_all()
        self._thread.join()

    def _plan(self, due_s: float, zeros: int) -> None:
        self._due_s, self._zeros_left = due_s, zeros
        self._changed.notify_all()

    def _run(self) -> None:
        with self._changed:
            while not self._is_closed:
                if not (self._zeros_left or self._is_latched):
                    self._changed.wait()
                elif (left_s := self._due_s - time.monotonic()) > 0.0:
                    self._changed.wait(left_s)
                else:
                    self._send(0.0, 0.0)
                    self._plan(time.monotonic() + _PERIOD_S, max(self._zeros_left - 1, 0))
