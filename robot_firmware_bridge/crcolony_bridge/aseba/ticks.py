"""How long a tick of an Aseba robot lasts: measured, because it differs between real robots and simulators."""

import math
import statistics
from collections import deque

_WINDOW = 64
_MIN_S, _MIN_TICKS, _MIN_READINGS = 0.3, 8, 4
"""From when on a measurement is taken: readings arrive within some milliseconds of their time."""
_WRAP, _MOST = 1 << 16, (1 << 15) - 1


class TickClock:
    """Counts a robot's ticks, as its readings report them, against this machine's clock."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque(maxlen=_WINDOW)
        self._ticks = 0
        self._time_s = 0.0

    def add(self, host_s: float, ticks: int) -> None:
        """Add a reading that has just arrived, with the robot's count, which wraps at 16 bits.

        Readings that have waited must not be added: by them ticks would seem shorter than they are.
        """
        passed = (ticks - self._ticks) % _WRAP if self._seen else 0
        self._ticks += passed if self._seen else ticks
        self._seen.append((host_s, self._ticks))
        self._time_s += passed * self.tick_s

    @property
    def is_calibrated(self) -> bool:
        """Whether enough ticks have been counted to rely on."""
        return (
            len(self._seen) >= _MIN_READINGS
            and self._seen[-1][0] - self._seen[0][0] >= _MIN_S
            and self._seen[-1][1] - self._seen[0][1] >= _MIN_TICKS
        )

    @property
    def tick_s(self) -> float:
        """The length of a tick over the last readings, 0 before the second one; a late one hardly counts."""
        seen = list(self._seen)
        half = len(seen) // 2
        lengths_s = [
            (late_s - early_s) / (late - early)
            for (early_s, early), (late_s, late) in zip(seen, seen[half:], strict=False)
            if late > early
        ]
        return statistics.median(lengths_s) if lengths_s else 0.0

    @property
    def period_s(self) -> float:
        """The time between two readings; 0 before the second one."""
        if len(self._seen) < 2:
            return 0.0
        return (self._seen[-1][0] - self._seen[0][0]) / (len(self._seen) - 1)

    @property
    def time_s(self) -> float:
        """The time by the robot's own clock, since the first reading."""
        return self._time_s

    def count_of(self, duration_s: float) -> int:
        """Return how many ticks a duration takes; one that has begun is completed."""
        tick_s = self.tick_s
        if duration_s <= 0.0 or tick_s <= 0.0:
            return 0
        return min(math.ceil(round(duration_s / tick_s, 3)), _MOST)
