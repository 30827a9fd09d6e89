"""The network tab: peers of every robot, message rates and ages, losses, and matings that are not decided."""

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

MATRIX = "/network/peer_matrix"
_PERIOD_S = 1.0
_MAX_MATRIX = 32
"""Robots in the matrix of peers"""
_MATRIX_PIXELS = 512
"""Size of the matrix; a cell has as many whole pixels as fit"""
_MAX_ROWS = 40
"""Of the table"""
IS_PEER = palette.YES
NO_PEER = palette.NO
ITSELF = palette.FAINT
UNKNOWN = (30, 33, 40)
"""The robot has not published its peers yet"""
_SERIES = {
    "rates": ("states", "events", "scenes", "kB"),
    "ages": ("median", "90 %", "oldest"),
    "peers": ("fewest", "median", "most"),
    "losses": (
        "missed by the dashboard",
        "dropped by robots",
        "refused by robots",
        "malformed",
        "faults",
    ),
    "matings": ("waiting", "in doubt", "orphaned"),
    "presence": ("online", "silent", "restarts"),
}


class NetworkTab:
    """Draws once a second."""

    def __init__(self) -> None:
        self._throttle = Throttle(_PERIOD_S)
        self._counted: tuple[float, Counter[str], int] | None = None
        """When samples were counted last, how many of each kind, and their bytes"""
        self._matrix = ChangeDetector()

    def layout(self) -> "rrb.Container":
        """Return matrix and table of robots, with plots beside them."""
        import rerun.blueprint as rrb

        def plot(name: str, title: str) -> rrb.View:
            return rrb.TimeSeriesView(origin=f"/network/{name}", name=title)

        return rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial2DView(
                    origin=MATRIX,
                    name=f"Peers: robot (row) sees robot (column), blue yes, orange no; at most {_MAX_MATRIX}",
                    background=palette.BACKGROUND,
                    visual_bounds=rrb.VisualBounds2D(
                        x_range=(-0.12 * _MATRIX_PIXELS, 1.02 * _MATRIX_PIXELS),
                        y_range=(-0.1 * _MATRIX_PIXELS, 1.02 * _MATRIX_PIXELS),
                    ),
                ),
                rrb.TextDocumentView(origin="/network/robots", name="Robots"),
                row_shares=[1.2, 1],
            ),
            rrb.Grid(
                plot("rates", "Messages a second received by this dashboard"),
                plot("ages", "Age of the robots' last states (s)"),
                plot("peers", "Peers of a robot"),
                plot("losses", "Messages lost or refused, in total"),
                plot("matings", "Matings waiting, in doubt, orphaned"),
                plot("presence", "Robots online, silent; restarts in total"),
                grid_columns=2,
            ),
            column_shares=[1, 1.6],
            name="Network",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Name the lines."""
        import rerun as rr

        for name, names in _SERIES.items():
            colours = [palette.series_colour(k) for k in range(len(names))]
            style = rr.SeriesLines(names=list(names), colors=colours)
            streams.log(f"/network/{name}", style, static=True)

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw matrix, plots and table."""
        if not self._throttle.is_due(moment.unix_s):
            return
        self._draw_matrix(streams, view, moment)
        self._draw_plots(streams, view, moment)
        self._draw_table(streams, view, moment)

    def _draw_matrix(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        import rerun as rr

        by_colony = sorted(view.alive, key=lambda status: status.colony)
        robots = by_colony[:_MAX_MATRIX]
        picture = np.empty((len(robots), len(robots), 3), dtype=np.uint8)
        for row, status in enumerate(robots):
            peers = set(status.metadata.peers) if status.metadata is not None else None
            for column, other in enumerate(robots):
                if row == column:
                    colour = ITSELF
                elif peers is None:
                    colour = UNKNOWN
                else:
                    colour = IS_PEER if other.robot in peers else NO_PEER
                picture[row, column] = colour
        names = [view.name_of(status.robot) for status in robots]
        if not self._matrix.is_due((picture.tobytes(), names), moment.unix_s):
            return
        if not robots:
            streams.log(MATRIX, rr.Clear(recursive=True))
            return
        cell = _MATRIX_PIXELS // len(robots)
        streams.log(MATRIX, rr.Image(picture.repeat(cell, axis=0).repeat(cell, axis=1)))
        middles = [(k + 0.5) * cell for k in range(len(robots))]
        streams.log(
            f"{MATRIX}/names",
            rr.Points2D(
                [(x, -0.04 * _MATRIX_PIXELS) for x in middles]
                + [(-0.05 * _MATRIX_PIXELS, y) for y in middles],
                labels=names + names,
                radii=0.1,
                colors=[palette.DIM],
                show_labels=True,
            ),
        )

    def _draw_plots(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        import rerun as rr

        monitor, states = view.monitor, view.states()
        if self._counted is not None:
            then_s, counts, size = self._counted
            passed_s = max(1e-3, moment.unix_s - then_s)
            kinds = [monitor.samples[kind] - counts[kind] for kind in ("state", "event", "scene")]
            rates = [*kinds, (monitor.bytes - size) / 1000.0]
            streams.log("/network/rates", rr.Scalars([rate / passed_s for rate in rates]))
        self._counted = (moment.unix_s, Counter(monitor.samples), monitor.bytes)
        alive = view.alive
        ages = [moment.unix_s - status.updated_s for status in alive if status.state is not None]
        if ages:
            streams.log("/network/ages", rr.Scalars(np.quantile(ages, (0.5, 0.9, 1.0))))
        if states:
            peers = np.quantile([state.peers for state in states], (0.0, 0.5, 1.0))
            streams.log("/network/peers", rr.Scalars(peers))
        missed = sum(status.missed for status in monitor.robots.values())
        losses = [
            missed,
            sum(state.dropped for state in states),
            sum(state.refused for state in states),
            monitor.malformed,
            sum(state.faults for state in states),
        ]
        streams.log("/network/losses", rr.Scalars(losses))
        undecided = [
            sum(state.waiting for state in states),
            sum(state.doubts for state in states),
            sum(state.orphaned for state in states),
        ]
        streams.log("/network/matings", rr.Scalars(undecided))
        silent = sum(age_s > SILENT_AFTER_S for age_s in ages)
        restarts = sum(status.restarts for status in monitor.robots.values())
        streams.log("/network/presence", rr.Scalars([len(alive), silent, restarts]))

    @staticmethod
    def _draw_table(streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        import rerun as rr

        robots = view.monitor.all
        lines = [
            "| robot | | arena | energy | gen | matings | offspring | peers | doubt | age | restarts |",
            "|---|---|---|---|---|---|---|---|---|---|---|",
            *(_row(view, status, moment) for status in robots[:_MAX_ROWS]),
        ]
        if len(robots) > _MAX_ROWS:
            lines += ["", f"… and {len(robots) - _MAX_ROWS} more"]
        text = "\n".join(lines) if robots else "No robot is on the network yet."
        streams.log("/network/robots", rr.TextDocument(text, media_type="text/markdown"))


def _row(view: ColonyView, status: RobotStatus, moment: Moment) -> str:
    state, name = status.state, view.name_of(status.robot)
    is_stale = view.is_stale(status, moment.unix_s)
    presence = "offline" if not status.is_alive else "silent" if is_stale else "online"
    if state is None:
        return f"| {name} | {presence} | | | | | | | | | |"
    age_s = max(0.0, moment.unix_s - status.updated_s)
    doubt = f"{state.doubts}" + (f" ({state.orphaned} orphaned)" if state.orphaned else "")
    return (
        f"| {name} | {presence} | {state.arena} | {state.energy:.2f} | {state.generation} | {state.matings}"
        f" | {state.conceptions} | {state.peers} | {doubt} | {age_s:.1f} s | {status.restarts} |"
    )
