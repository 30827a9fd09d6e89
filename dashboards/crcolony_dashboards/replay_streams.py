"""Where a replay is drawn: a recording on disk with a timeline of its own for the stretch that it opens with.

A viewer begins at the start of the timeline that it shows. On that timeline the stretch begins with all that was drawn
before, so that no view is empty.
"""

from collections import deque
from typing import Any

from crcolony_dashboards.rerun_streams import ARENA_TIMELINE, Moment, RerunStreams
from crcolony_dashboards.rrd_file import RrdFile

_MAX_LINES = 100


class ReplayStreams(RerunStreams):
    """Logs to a recording, and keeps the last drawing of every entity."""

    def __init__(self, rrd: RrdFile) -> None:
        super().__init__(None, rrd)
        self.is_open = False
        """Whether the stretch has begun"""
        self._is_shown = False
        self._drawn: dict[str, tuple[Any, ...]] = {}
        self._lines: deque[tuple[str, tuple[Any, ...]]] = deque(maxlen=_MAX_LINES)
        """The last lines of the log, of which a viewer shows more than the last of each entity"""
        self._moment: Moment | None = None

    def set_time(self, moment: Moment) -> None:
        """Set the time of everything that is logged next, also on the timeline of the stretch."""
        super().set_time(moment)
        self._moment = moment
        for stream in self._all():
            if self._is_shown:
                stream.set_time(ARENA_TIMELINE, duration=moment.sim_s)
            else:
                stream.disable_timeline(ARENA_TIMELINE)

    def log(self, path: str, *components: Any, static: bool = False) -> None:
        """Log archetypes to an entity."""
        import rerun as rr

        super().log(path, *components, static=static)
        if any(isinstance(component, rr.Clear) for component in components):
            self._drawn.pop(path, None)
            for below in [below for below in self._drawn if below.startswith(f"{path}/")]:
                del self._drawn[below]
        elif isinstance(components[0], rr.TextLog):
            self._lines.append((path, components))
        elif not static:
            self._drawn[path] = components

    def open(self) -> None:
        """Begin the stretch at the time that was set last, with the last drawing of every entity."""
        self.is_open = self._is_shown = True
        if self._moment is None:
            return
        self.set_time(self._moment)
        for path, components in [*self._lines, *self._drawn.items()]:
            super().log(path, *components)

    def show(self, has_scenes: bool) -> None:
        """Interrupt the stretch while there are no scenes."""
        self._is_shown = self.is_open and has_scenes
