"""Why a robot has no body, for people: it waits for its arena, or the arena is full. That is information, no fault."""

import math

_PATIENCE_S = 3.0
"""At the start an arena may take this long without a line."""


class WaitingForBody:
    """The reason, published while it lasts, and printed once."""

    def __init__(self, arena: str) -> None:
        self._arena = arena
        self._waiting = self.reason = f"waiting for arena {arena}"
        self._printed = ""
        self._print_due_s = math.inf

    def start(self, now_s: float) -> None:
        """Begin to wait for the first body."""
        self._print_due_s = now_s + _PATIENCE_S

    def handle_denial(self, reason: str) -> None:
        """Handle that the arena has denied a body."""
        self.reason = f"no body from {self._arena}: {reason}"

    def handle_loss(self) -> str:
        """Handle that the arena is offline and the body lost; return the line to print."""
        self.reason = self._printed = self._waiting
        return f"the arena is offline; {self.reason}"

    def line_due(self, now_s: float) -> str | None:
        """Return the reason if it is to be printed now."""
        if self.reason == self._printed or now_s < self._print_due_s:
            return None
        self._printed = self.reason
        return self.reason
