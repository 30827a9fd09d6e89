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

_MOST_SEEN = 32
"""Robots in the picture of who sees whom; they are asked in turn"""
_PICTURE = 512
"""Its size (pixels); a cell is as large as fits"""
_MOST_ROWS = 40
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
                    name=f"Who (row) sees whom (column): green yes, red no ({_MOST_SEEN} at most)",
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

    def setup(self, stage: RerunStreams) -> None:
        """Name the lines."""
        import rerun as rr

        for name, names in _LINES.items():
            colours = [palette.series_colour(k) for k in range(len(names))]
            style = rr.SeriesLines(names=list(names), colors=colours)
            stage.log(f"/network/{name}", style, static=True)

    def draw(self, stage: RerunStreams, spectator: ColonyView, moment: Moment) -> None:
        """Draw how the network is."""
        if not self._beat.is_due(moment.unix_s):
            return
        self._draw_sights(stage, spectator, moment)
        self._draw_lines(stage, spectator, moment)
        self._draw_table(stage, spectator, moment)

    def _draw_sights(self, stage: RerunStreams, spectator: ColonyView, moment: Moment) -> None:
        import rerun as rr

        by_colony = sorted(spectator.alive, key=lambda watched: watched.colony)
        shown = by_colony[:_MOST_SEEN]
        picture = np.empty((len(shown), len(shown), 3), dtype=np.uint8)
        for row, watched in enumerate(shown):
            peers = set(watched.metadata.peers) if watched.metadata is not None else None
            for column, other in enumerate(shown):
                if row == column:
                    colour = ITSELF
                elif peers is None:
                    colour = UNKNOWN
                else:
                    colour = SEES if other.robot in peers else SEES_NOT
                picture[row, column] = colour
        names = [spectator.call(watched.robot) for watched in shown]
        if not self._sights.is_due((picture.tobytes(), names), moment.unix_s):
            return
        if not shown:
            stage.log("/network/sees", rr.Clear(recursive=True))
            return
        cell = _PICTURE // len(shown)
        stage.log("/network/sees", rr.Image(picture.repeat(cell, axis=0).repeat(cell, axis=1)))
        middles = [(k + 0.5) * cell for k in range(len(shown))]
        stage.log(
            "/network/sees/names",
            rr.Points2D(
                [(x, -0.04 * _PICTURE) for x in middles] + [(-0.05 * _PICTURE, y) for y in middles],
                labels=names + names,
                radii=0.1,
                colors=[palette.DIM],
                show_labels=True,
            ),
        )

    def _draw_lines(self, stage: RerunStreams, spectator: ColonyView, moment: Moment) -> None:
        import rerun as rr

        watch, states = spectator.monitor, spectator.states()
        if self._before is not None:
            then_s, counts, size = self._before
            passed_s = max(1e-3, moment.unix_s - then_s)
            kinds = [watch.samples[kind] - counts[kind] for kind in ("state", "event", "scene")]
            rates = [*kinds, (watch.bytes - size) / 1000.0]
            stage.log("/network/rates", rr.Scalars([rate / passed_s for rate in rates]))
        self._before = (moment.unix_s, Counter(watch.samples), watch.bytes)
        alive = spectator.alive
        ages = [moment.unix_s - watched.updated_s for watched in alive if watched.state is not None]
        if ages:
            stage.log("/network/ages", rr.Scalars(np.quantile(ages, (0.5, 0.9, 1.0))))
        if states:
            peers = np.quantile([state.peers for state in states], (0.0, 0.5, 1.0))
            stage.log("/network/peers", rr.Scalars(peers))
        missed = sum(watched.missed for watched in watch.robots.values())
        lost = [
            missed,
            sum(state.dropped for state in states),
            sum(state.refused for state in states),
            watch.malformed,
            sum(state.faults for state in states),
        ]
        stage.log("/network/losses", rr.Scalars(lost))
        hanging = [
            sum(state.waiting for state in states),
            sum(state.doubts for state in states),
            sum(state.orphaned for state in states),
        ]
        stage.log("/network/matings", rr.Scalars(hanging))
        silent = sum(age_s > SILENT_AFTER_S for age_s in ages)
        restarts = sum(watched.restarts for watched in watch.robots.values())
        stage.log("/network/presence", rr.Scalars([len(alive), silent, restarts]))

    @staticmethod
    def _draw_table(stage: RerunStreams, spectator: ColonyView, moment: Moment) -> None:
        import rerun as rr

        robots = spectator.monitor.all
        lines = [
            "| robot | | energy | gen | matings | children | sees | doubt | age | restarts |",
            "|---|---|---|---|---|---|---|---|---|---|",
            *(_row(spectator, watched, moment) for watched in robots[:_MOST_ROWS]),
        ]
        if len(robots) > _MOST_ROWS:
            lines += ["", f"… and {len(robots) - _MOST_ROWS} more"]
        text = "\n".join(lines) if robots else "Nobody is on the network yet."
        stage.log("/network/robots", rr.TextDocument(text, media_type="text/markdown"))


def _row(spectator: ColonyView, watched: RobotStatus, moment: Moment) -> str:
    state, name = watched.state, spectator.call(watched.robot)
    is_stale = spectator.is_stale(watched, moment.unix_s)
    how = "gone" if not watched.is_alive else "silent" if is_stale else "alive"
    if state is None:
        return f"| {name} | {how} | | | | | | | | |"
    age_s = max(0.0, moment.unix_s - watched.updated_s)
    doubt = f"{state.doubts}" + (f" ({state.orphaned} orphaned)" if state.orphaned else "")
    return (
        f"| {name} | {how} | {state.energy:.2f} | {state.generation} | {state.matings}"
        f" | {state.conceptions} | {state.peers} | {doubt} | {age_s:.1f} s | {watched.restarts} |"
    )
