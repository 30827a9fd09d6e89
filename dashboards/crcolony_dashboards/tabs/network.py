"""Network: who sees whom, how much is said, how old it is, what is lost, and which matings hang in the air."""

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from crcolony.telemetry.robot_status import RobotStatus
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_MAX_SEEN = 32
"""Robots in the picture of who sees whom; they are asked in turn"""
_PICTURE = 512
"""Its size (pixels); a cell is as large as fits"""
_MAX_ROWS = 40
"""Of the table"""
SEES, SEES_NOT, ITSELF, UNKNOWN = palette.GOOD, palette.BAD, palette.FAINT, (30, 33, 40)
_LINES = {
    "rates": ("states", "events", "scenes", "kB"),
    "ages": ("median", "90 %", "oldest"),
    "peers": ("fewest", "median", "most"),
    "losses": ("missed here", "dropped by robots", "refused by robots", "malformed", "faults"),
    "matings": ("waiting", "in doubt", "orphaned"),
    "presence": ("alive", "silent", "restarts"),
}


class NetworkTab:
    """Draws once a second."""

    def __init__(self) -> None:
        self._beat = Throttle(1.0)
        self._before: tuple[float, Counter[str], int] | None = None
        self._sights = ChangeDetector()

    def layout(self) -> "rrb.Container":
        """Return the place of who sees whom and of the table, with lines beside them."""
        import rerun.blueprint as rrb

        def lines(name: str, title: str) -> rrb.View:
            return rrb.TimeSeriesView(origin=f"/network/{name}", name=title)

        return rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial2DView(
                    origin="/network/sees",
                    name=f"Who (row) sees whom (column): green yes, red no ({_MAX_SEEN} at most)",
                    background=palette.BACKGROUND,
                    visual_bounds=rrb.VisualBounds2D(
                        x_range=(-0.12 * _PICTURE, 1.02 * _PICTURE),
                        y_range=(-0.1 * _PICTURE, 1.02 * _PICTURE),
                    ),
                ),
                rrb.TextDocumentView(origin="/network/robots", name="Robots"),
                row_shares=[1.2, 1],
            ),
            rrb.Grid(
                lines("rates", "Messages a second, as this dashboard hears them"),
                lines("ages", "Age of robots' last states (s)"),
                lines("peers", "Robots that a robot sees"),
                lines("losses", "Lost or refused, in all"),
                lines("matings", "Matings that wait, are in doubt, are orphaned"),
                lines("presence", "Robots alive, silent; restarts in all"),
                grid_columns=2,
            ),
            column_shares=[1, 1.6],
            name="Network",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Name the lines."""
        import rerun as rr

        for name, names in _LINES.items():
            colours = [palette.series_colour(k) for k in range(len(names))]
            style = rr.SeriesLines(names=list(names), colors=colours)
            streams.log(f"/network/{name}", style, static=True)

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw how the network is."""
        if not self._beat.is_due(moment.unix_s):
            return
        self._draw_sights(streams, view, moment)
        self._draw_lines(streams, view, moment)
        self._draw_table(streams, view, moment)

    def _draw_sights(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        import rerun as rr

        by_colony = sorted(view.alive, key=lambda status: status.colony)
        shown = by_colony[:_MAX_SEEN]
        picture = np.empty((len(shown), len(shown), 3), dtype=np.uint8)
        for row, status in enumerate(shown):
            peers = set(status.metadata.peers) if status.metadata is not None else None
            for column, other in enumerate(shown):
                if row == column:
                    colour = ITSELF
                elif peers is None:
                    colour = UNKNOWN
                else:
                    colour = SEES if other.robot in peers else SEES_NOT
                picture[row, column] = colour
        names = [view.call(status.robot) for status in shown]
        if not self._sights.is_due((picture.tobytes(), names), moment.unix_s):
            return
        if not shown:
            streams.log("/network/sees", rr.Clear(recursive=True))
            return
        cell = _PICTURE // len(shown)
        streams.log("/network/sees", rr.Image(picture.repeat(cell, axis=0).repeat(cell, axis=1)))
        middles = [(k + 0.5) * cell for k in range(len(shown))]
        streams.log(
            "/network/sees/names",
            rr.Points2D(
                [(x, -0.04 * _PICTURE) for x in middles] + [(-0.05 * _PICTURE, y) for y in middles],
                labels=names + names,
                radii=0.1,
                colors=[palette.DIM],
                show_labels=True,
            ),
        )

    def _draw_lines(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        import rerun as rr

        monitor, states = view.monitor, view.states()
        if self._before is not None:
            then_s, counts, size = self._before
            passed_s = max(1e-3, moment.unix_s - then_s)
            kinds = [monitor.samples[kind] - counts[kind] for kind in ("state", "event", "scene")]
            rates = [*kinds, (monitor.bytes - size) / 1000.0]
            streams.log("/network/rates", rr.Scalars([rate / passed_s for rate in rates]))
        self._before = (moment.unix_s, Counter(monitor.samples), monitor.bytes)
        alive = view.alive
        ages = [moment.unix_s - status.updated_s for status in alive if status.state is not None]
        if ages:
            streams.log("/network/ages", rr.Scalars(np.quantile(ages, (0.5, 0.9, 1.0))))
        if states:
            peers = np.quantile([state.peers for state in states], (0.0, 0.5, 1.0))
            streams.log("/network/peers", rr.Scalars(peers))
        missed = sum(status.missed for status in monitor.robots.values())
        lost = [
            missed,
            sum(state.dropped for state in states),
            sum(state.refused for state in states),
            monitor.malformed,
            sum(state.faults for state in states),
        ]
        streams.log("/network/losses", rr.Scalars(lost))
        hanging = [
            sum(state.waiting for state in states),
            sum(state.doubts for state in states),
            sum(state.orphaned for state in states),
        ]
        streams.log("/network/matings", rr.Scalars(hanging))
        silent = sum(age_s > SILENT_AFTER_S for age_s in ages)
        restarts = sum(status.restarts for status in monitor.robots.values())
        streams.log("/network/presence", rr.Scalars([len(alive), silent, restarts]))

    @staticmethod
    def _draw_table(streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        import rerun as rr

        robots = view.monitor.all
        lines = [
            "| robot | | energy | gen | matings | children | sees | doubt | age | restarts |",
            "|---|---|---|---|---|---|---|---|---|---|",
            *(_row(view, status, moment) for status in robots[:_MAX_ROWS]),
        ]
        if len(robots) > _MAX_ROWS:
            lines += ["", f"… and {len(robots) - _MAX_ROWS} more"]
        text = "\n".join(lines) if robots else "Nobody is on the network yet."
        streams.log("/network/robots", rr.TextDocument(text, media_type="text/markdown"))


def _row(view: ColonyView, status: RobotStatus, moment: Moment) -> str:
    state, name = status.state, view.call(status.robot)
    is_stale = view.is_stale(status, moment.unix_s)
    how = "gone" if not status.is_alive else "silent" if is_stale else "alive"
    if state is None:
        return f"| {name} | {how} | | | | | | | | |"
    age_s = max(0.0, moment.unix_s - status.updated_s)
    doubt = f"{state.doubts}" + (f" ({state.orphaned} orphaned)" if state.orphaned else "")
    return (
        f"| {name} | {how} | {state.energy:.2f} | {state.generation} | {state.matings}"
        f" | {state.conceptions} | {state.peers} | {doubt} | {age_s:.1f} s | {status.restarts} |"
    )
