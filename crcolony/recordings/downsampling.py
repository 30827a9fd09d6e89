"""Limits a data rate by leaving items out, evenly over time and over their sources."""

_GOLDEN = 0.6180339887498949
"""The fractions of its multiples, and of every second, third … multiple, are spread evenly over 0 to 1."""


class Downsampler:
    """Keeps about `bytes_per_s`. The share of items to keep follows from the bytes of the second before."""

    def __init__(self, bytes_per_s: int) -> None:
        self._bytes_per_s = bytes_per_s
        self._second = -1
        self._offered = 0
        """Bytes of this second"""
        self._kept = 0
        """Bytes of this second that are kept"""
        self._share = 1.0
        """Of the items, to be kept"""
        self._count = 0

    def should_keep(self, size_bytes: int, unix_ms: int) -> bool:
        """Return whether to keep an item of this size and time; times do not decrease."""
        second = unix_ms // 1000
        if second != self._second:
            is_next = second == self._second + 1
            self._share = min(1.0, self._bytes_per_s / max(self._offered, 1)) if is_next else 1.0
            self._second, self._offered, self._kept = second, 0, 0
        self._offered += size_bytes
        self._count += 1
        is_kept = self._kept < self._bytes_per_s and (self._count * _GOLDEN) % 1.0 < self._share
        self._kept += size_bytes if is_kept else 0
        return is_kept
