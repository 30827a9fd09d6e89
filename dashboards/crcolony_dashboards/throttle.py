"""When something that is done every so often is due, or done when it has changed."""


class Throttle:
    """Tells when something that is done every so often is due. The first time is at once."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._next_s = -float("inf")

    def is_due(self, unix_s: float) -> bool:
        """Return whether it is, and begin to wait for the next time; a clock that was set back holds nothing up."""
        if 0.0 < self._next_s - unix_s < 2.0 * self._period_s:
            return False
        due_s = min(self._next_s, unix_s)
        self._next_s = max(due_s + self._period_s, unix_s + 0.5 * self._period_s)
        return True


class ChangeDetector:
    """Tells when something is to be drawn anew: it has changed, or was drawn so long ago that it may be forgotten."""

    def __init__(self, again_s: float = 15.0) -> None:
        self._again_s = again_s
        self._last: object = None
        self._last_s = -float("inf")

    def is_due(self, what: object, unix_s: float) -> bool:
        """Return whether to draw it; `what` it is looks the same while it is the same."""
        if what == self._last and abs(unix_s - self._last_s) < self._again_s:
            return False
        self._last, self._last_s = what, unix_s
        return True
