"""A queue between threads that is bounded in items and in bytes."""

import threading
from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")


class BoundedQueue(Generic[Item]):
    """A first-in, first-out queue: an item that does not fit is dropped and counted, and no call waits."""

    def __init__(self, max_items: int, max_bytes: int) -> None:
        self.dropped = 0
        """Items that did not fit"""
        self._max_items, self._max_bytes = max_items, max_bytes
        self._entries: deque[tuple[Item, int]] = deque()
        """Items and their sizes (bytes)"""
        self._bytes = 0
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._entries)

    def put(self, item: Item, size_bytes: int, limit_factor: float = 1.0) -> bool:
        """Append an item, from any thread; return whether it fitted.

        `limit_factor` multiplies both limits for this item: `math.inf` exempts it from them.
        """
        with self._lock:
            if (
                len(self._entries) >= limit_factor * self._max_items
                or self._bytes + size_bytes > limit_factor * self._max_bytes
            ):
                self.dropped += 1
                return False
            self._entries.append((item, size_bytes))
            self._bytes += size_bytes
        return True

    def get(self) -> Item | None:
        """Remove the oldest item and return it; return None if the queue is empty."""
        with self._lock:
            if not self._entries:
                return None
            item, size_bytes = self._entries.popleft()
            self._bytes -= size_bytes
        return item

    def get_all(self) -> list[Item]:
        """Remove all items and return them, the oldest first."""
        with self._lock:
            entries, self._entries, self._bytes = self._entries, deque(), 0
        return [item for item, _ in entries]
