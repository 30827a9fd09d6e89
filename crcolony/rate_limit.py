"""A limit on how often a second something may be done for strangers."""

from dataclasses import dataclass


@dataclass
class TokenBucket:
    """Lets so much pass a second, and no more (token bucket)."""

    per_s: float
    level: float = 0.0
    at_s: float = 0.0

    def allow(self, now_s: float) -> bool:
        """Tell whether one more may pass now; a clock that is set back lets none pass that another would not."""
        passed_s = max(0.0, now_s - self.at_s)
        self.level = min(self.per_s, self.level + passed_s * self.per_s)
        self.at_s = now_s
        if self.level < 1.0:
            return False
        self.level -= 1.0
        return True
