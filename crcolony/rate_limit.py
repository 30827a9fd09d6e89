"""A token bucket: a limit on how many times a second something is done for peers that need not be honest."""

from dataclasses import dataclass


@dataclass
class TokenBucket:
    """Allows `per_s` uses a second on average, and as many at once after a second without any."""

    per_s: float
    level: float = 0.0
    updated_s: float = 0.0

    def allow(self, now_s: float) -> bool:
        """Return whether one more use is allowed now; a clock that is set back allows no additional one."""
        elapsed_s = max(0.0, now_s - self.updated_s)
        self.level = min(self.per_s, self.level + elapsed_s * self.per_s)
        self.updated_s = now_s
        if self.level < 1.0:
            return False
        self.level -= 1.0
        return True
