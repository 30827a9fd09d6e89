"""Streams that keep what is drawn, in place of a viewer, and one tab that draws on them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs.palette import Colour
from crcolony_dashboards.tabs.tab import Tab
from crcolony_dashboards.view_model.colony_view import ColonyView

from tests.support.fake_telemetry import FakeTelemetry


@dataclass(frozen=True)
class Drawing:
    """One call of `RerunStreams.log`: the components by their names, and the time."""

    path: str
    moment: Moment | None
    is_static: bool
    """Whether it is valid at all times"""
    parts: dict[str, Any]


class RecordingStreams(RerunStreams):
    """Keeps every drawing, and what a viewer would show now: of every component of an entity the latest.

    It also logs to a stream of Rerun in memory, which raises on what cannot be drawn.
    """

    def __init__(self) -> None:
        super().__init__(rr.RecordingStream("crcolony"), None)
        self.drawings: list[Drawing] = []
        self._moment: Moment | None = None
        self._shown: dict[str, dict[str, Any]] = {}

    def set_time(self, moment: Moment) -> None:
        super().set_time(moment)
        self._moment = moment

    def log(self, path: str, *components: Any, static: bool = False) -> None:
        super().log(path, *components, static=static)
        parts = {
            str(batch.component_descriptor().component).rpartition(":")[2]: batch.as_arrow_array()
            for component in components
            for batch in component.as_component_batches()
        }
        self.drawings.append(Drawing(path, self._moment, static, parts))
        if "is_recursive" not in parts:
            self._shown.setdefault(path, {}).update(parts)
            return
        self._shown.pop(path, None)
        if parts["is_recursive"].to_pylist() == [True]:
            for old in [old for old in self._shown if old.startswith(f"{path}/")]:
                del self._shown[old]

    def clear(self) -> None:
        """Drop the drawings so far; what is shown stays."""
        self.drawings.clear()

    def paths(self) -> list[str]:
        """Return the entities of all drawings, in order."""
        return [drawing.path for drawing in self.drawings]

    def times(self, path: str) -> int:
        """Return how often an entity was drawn."""
        return self.paths().count(path)

    def shown(self, path: str, part: str) -> list[Any]:
        """Return what a viewer shows of one component; empty if it was never drawn."""
        values = self._shown.get(path, {}).get(part)
        return [] if values is None else list(values.to_pylist())

    def entities(self, under: str) -> list[str]:
        """Return the entities shown under a path, without that path."""
        return sorted(path[len(under) :] for path in self._shown if path.startswith(under))

    def colours(self, path: str) -> list[Colour]:
        """Return the colours that are shown."""
        return [(c >> 24, c >> 16 & 255, c >> 8 & 255) for c in self.shown(path, "colors")]

    def scalars(self, path: str) -> list[list[float]]:
        """Return the values that were drawn of one or several lines, in order."""
        found = [
            d.parts["scalars"] for d in self.drawings if d.path == path and "scalars" in d.parts
        ]
        return [list(values.to_pylist()) for values in found]

    def text(self, path: str) -> str:
        """Return the text that is shown."""
        return "".join(self.shown(path, "text"))

    def picture(self, path: str) -> np.ndarray:
        """Return the picture that is shown, (height, width, 3)."""
        (form,) = self.shown(path, "format")
        pixels = self._shown[path]["buffer"].flatten().to_numpy()
        return np.asarray(pixels).reshape(form["height"], form["width"], 3)


class TabHarness:
    """One tab that draws made-up telemetry on recording streams."""

    def __init__(self, tab: Tab) -> None:
        self.tab, self.streams, self.telemetry = tab, RecordingStreams(), FakeTelemetry()
        self.view: ColonyView = self.telemetry.view
        tab.setup(self.streams)

    def draw(self, after_s: float = 0.0) -> RecordingStreams:
        """Let time pass and the tab draw; return the streams with the drawings of this call only."""
        self.telemetry.advance_s(after_s)
        self.streams.clear()
        moment = self.telemetry.moment()
        self.streams.set_time(moment)
        self.view.update_generations(moment.unix_s)
        self.tab.draw(self.streams, self.view, moment)
        return self.streams
