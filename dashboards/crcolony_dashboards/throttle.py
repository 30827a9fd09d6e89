"""When something is due that is done periodically, or when a value has changed."""


class Throttle:
    """Limits something to once a period; the first call is due at once."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._next_s = -float("inf")

    def is_due(self, unix_s: float) -> bool:
        """Return whether it is due, and if so start the next period; a clock that was set back does not block it."""
        if 0.0 < self._next_s - unix_s < 2.0 * self._period_s:
            return False
        due_s = min(self._next_s, unix_s)
        self._next_s = max(due_s + self._period_s, unix_s + 0.5 * self._period_s)
        return True


class ChangeDetector:
    """Detects when something must be drawn again: its value has changed, or it was drawn long ago.

    Viewers that connect late have lost what was drawn before the server's memory was full. Where time passes in jumps
    longer than that, as in the replay of a run without scenes, there are none, and nothing is repeated.
    """

    def __init__(self, repeat_s: float = 15.0) -> None:
        self._repeat_s = repeat_s
        self._last: object = None
        self._last_s, self._checked_s = -float("inf"), float("inf")

    def is_due(self, value: object, unix_s: float) -> bool:
        """Return whether to draw something that depends on `value` only."""
        is_jump = unix_s - self._checked_s >= self._repeat_s
        self._checked_s = unix_s
        is_recent = abs(unix_s - self._last_s) < self._repeat_s
        if value == self._last and (is_recent or is_jump):
            return False
        self._last, self._last_s = value, unix_s
        return True
