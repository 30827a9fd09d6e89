"""Leaving some out of what is too much, evenly over time and over all whom it comes from."""

_GOLDEN = 0.6180339887498949
"""Multiples of it, but for their whole parts, are spread evenly from 0 to 1, as are every second, third … of them"""


class Downsampler:
    """Keeps about so many bytes a second. How much is too much is known from the second before."""

    def __init__(self, bytes_per_s: int) -> None:
        self._most = bytes_per_s
        self._second = -1
        self._heard = self._kept = 0
        """Bytes in this second"""
        self._share = 1.0
        """Of what comes, to be kept"""
        self._count = 0

    def should_keep(self, size: int, unix_ms: int) -> bool:
        """Tell whether to keep so many bytes that came at that time."""
        second = unix_ms // 1000
        if second != self._second:
            was_before = second == self._second + 1
            self._share = min(1.0, self._most / max(self._heard, 1)) if was_before else 1.0
            self._second, self._heard, self._kept = second, 0, 0
        self._heard += size
        self._count += 1
        is_kept = self._kept < self._most and (self._count * _GOLDEN) % 1.0 < self._share
        self._kept += size if is_kept else 0
        return is_kept
