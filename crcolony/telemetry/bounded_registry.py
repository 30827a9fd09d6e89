"""A bounded table of entries by name: absent ones make room for new ones."""

from collections.abc import Callable
from typing import Generic, TypeVar

Name = TypeVar("Name")
Entry = TypeVar("Entry")


class BoundedRegistry(Generic[Name, Entry]):
    """Entries by name, at most `max_entries`.

    When it is full a new entry evicts an absent one, the one without activity for longest; entries marked present are
    never evicted. `on_removed` is called with the name of every entry that is removed.
    """

    def __init__(
        self, max_entries: int, on_removed: Callable[[Name], None] = lambda name: None
    ) -> None:
        self.entries: dict[Name, Entry] = {}
        self._max_entries, self._on_removed = max_entries, on_removed
        self._last_active_s: dict[Name, float] = {}
        """Of the absent entries, the one without activity for longest first"""

    def get_or_create(self, name: Name, now_s: float, create: Callable[[], Entry]) -> Entry | None:
        """Return an entry that is active now, created if it is new; return None if there is no room for it."""
        entry = self.entries.get(name)
        if entry is None:
            if len(self.entries) >= self._max_entries and not self._evict():
                return None
            entry = self.entries[name] = create()
            self._last_active_s[name] = now_s
        elif self._last_active_s.pop(name, None) is not None:
            self._last_active_s[name] = now_s
        return entry

    def mark_present(self, name: Name) -> None:
        """Protect an entry from being removed."""
        self._last_active_s.pop(name, None)

    def mark_absent(self, name: Name, now_s: float) -> None:
        """Let an entry be removed again."""
        self._last_active_s[name] = now_s

    def remove_absent_before(self, before_s: float) -> None:
        """Remove all absent entries without activity since a time."""
        while self._last_active_s and next(iter(self._last_active_s.values())) < before_s:
            self._evict()

    def _evict(self) -> bool:
        """Remove the absent entry without activity for longest; return whether there was one."""
        name = next(iter(self._last_active_s), None)
        if name is None:
            return False
        del self._last_active_s[name], self.entries[name]
        self._on_removed(name)
        return True
