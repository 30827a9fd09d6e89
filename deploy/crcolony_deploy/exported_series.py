"""Which robots and arenas a metrics exporter has series for: bounded, since anyone can publish any name."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

from crcolony.protocol.identity import RobotId

MAX_ROBOTS = 1_000
"""Robots that have series at one time."""
MAX_ARENAS = 100
"""Arenas that have series at one time."""
KEEP_ABSENT_S = 86_400.0
"""One that is offline makes room for another after so long: no more than the maximum become new in a day."""

Name = TypeVar("Name", bound=RobotId | str)


@dataclass
class _Entry:
    label: str
    online_s: float
    """When it was online for the last time, unix seconds"""


class ExportedSeries(Generic[Name]):
    """The labels of what has series, by name.

    One that comes online gets a label and keeps it: an alert that it is offline must not end because a monitor has
    forgotten it. The names in `expected` have their place from the start, and if there are any, no others are exported.
    """

    def __init__(
        self,
        max_entries: int,
        label_of: Callable[[Name], str],
        expected: Iterable[Name] | None = None,
    ) -> None:
        self._max_entries = max_entries
        self._label_of = label_of
        self._is_open = expected is None
        self._entries: dict[Name, _Entry] = {}
        self._labels: set[str] = set()
        self.omitted: set[Name] = set()
        """Those that were online at the last update and have no place"""
        for name in expected or ():
            self._add(name, 0.0)

    @property
    def labels(self) -> dict[Name, str]:
        """The label of every name that has series."""
        return {name: entry.label for name, entry in self._entries.items()}

    def update(self, online: Iterable[Name], unix_s: float) -> None:
        """Give a place to those that are online now, as far as there is one."""
        self.omitted = set()
        has_room = self._is_open
        for name in online:
            entry = self._entries.get(name)
            if entry is not None:
                entry.online_s = unix_s
                continue
            has_room = has_room and self._has_room(unix_s)  # looked for once, not for each of many
            if has_room:
                self._add(name, unix_s)
            else:
                self.omitted.add(name)

    def _has_room(self, unix_s: float) -> bool:
        if len(self._entries) < self._max_entries:
            return True
        oldest = min(self._entries, key=lambda name: self._entries[name].online_s)
        if unix_s - self._entries[oldest].online_s < KEEP_ABSENT_S:
            return False
        self._labels.discard(self._entries.pop(oldest).label)
        return True

    def _add(self, name: Name, unix_s: float) -> None:
        """Add a name under its short label, or under its whole name if another has that label."""
        label = self._label_of(name)
        if label in self._labels:
            label = name.hex() if isinstance(name, bytes) else name
        self._labels.add(label)
        self._entries[name] = _Entry(label, unix_s)
