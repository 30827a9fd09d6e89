"""A stage that remembers what is drawn on it, in place of a viewer."""

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
    """One thing that was drawn: its parts by their names, and when."""

    path: str
    moment: Moment | None
    is_static: bool
    """Whether it is so at all times"""
    parts: dict[str, Any]


class RecordingStage(RerunStreams):
    """Remembers every drawing, and what a viewer shows now: of every part of an entity the latest.

    It also draws into Rerun's memory, which refuses what cannot be drawn.
    """

    def __init__(self) -> None:
        super().__init__(rr.RecordingStream("crcolony"), None)
        self.drawings: list[Drawing] = []
        self._moment: Moment | None = None
        self._shown: dict[str, dict[str, Any]] = {}

    def set_time(self, moment: Moment) -> None:
        super().set_time(moment)
        self._moment = moment

    def log(self, path: str, *what: Any, static: bool = False) -> None:
        super().log(path, *what, static=static)
        parts = {
            str(batch.component_descriptor().component).partition(":")[2]: batch.as_arrow_array()
            for one in what
            for batch in one.as_component_batches()
        }
        self.drawings.append(Drawing(path, self._moment, static, parts))
        if "is_recursive" not in parts:
            self._shown.setdefault(path, {}).update(parts)
            return
        self._shown.pop(path, None)
        if parts["is_recursive"].to_pylist() == [True]:
            for old in [old for old in self._shown if old.startswith(f"{path}/")]:
                del self._shown[old]

    def forget(self) -> None:
        """Forget the drawings so far; what is shown is shown on."""
        self.drawings.clear()

    def paths(self) -> list[str]:
        """Return where something was drawn, in order."""
        return [drawing.path for drawing in self.drawings]

    def times(self, path: str) -> int:
        """Return how often something was drawn there."""
        return self.paths().count(path)

    def shown(self, path: str, part: str) -> list[Any]:
        """Return what a viewer shows of one part; nothing if it was never drawn."""
        values = self._shown.get(path, {}).get(part)
        return [] if values is None else list(values.to_pylist())

    def entities(self, under: str) -> list[str]:
        """Return what is shown under a path, by the rest of its own path."""
        return sorted(path[len(under) :] for path in self._shown if path.startswith(under))

    def colours(self, path: str) -> list[Colour]:
        """Return the colours that are shown."""
        return [(c >> 24, c >> 16 & 255, c >> 8 & 255) for c in self.shown(path, "colors")]

    def scalars(self, path: str) -> list[list[float]]:
        """Return the values that were drawn of a line, or of some lines, in order."""
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


class Show:
    """One tab, drawn on a recording stage with what is heard."""

    def __init__(self, tab: Tab) -> None:
        self.tab, self.streams, self.sample = tab, RecordingStage(), FakeTelemetry()
        self.view: ColonyView = self.sample.view
        tab.setup(self.streams)

    def draw(self, after_s: float = 0.0) -> RecordingStage:
        """Let time pass and the tab draw; return the stage, with what was drawn now only."""
        self.sample.pass_s(after_s)
        self.streams.forget()
        moment = self.sample.moment()
        self.streams.set_time(moment)
        self.tab.draw(self.streams, self.view, moment)
        return self.streams
