"""Lineage: the family of the last births, and how much of the colony goes back to which founder.

Every agent has its own place in the graph, which it keeps: across by its robot and its number in it, down by its
generation. Its colour is that of the founder of most of its genes.
"""

from typing import TYPE_CHECKING

import numpy as np

from crcolony.protocol.identity import RobotId
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.tab import safe, whole_past
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import Colony, ColonyView
from crcolony_dashboards.view_model.family_tree import Member
from crcolony_dashboards.view_model.log_lines import number_of, robot_of

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_MAX_NODES = 160
_MAX_FOUNDERS = 24
"""With lines of their own; a founder whose share is small has none"""
_LEAST_SHARE, _GROWN = 0.01, 2.0
"""Whoever has a line has so much at least; of many founders, so many times what each had in the beginning"""
_ROW, _COLUMN = 200.0, 22.0
"""Of the graph, in its own units"""
_MAX_COLUMNS = 200


class LineageTab:
    """Draws the family when it has grown, every two seconds at most."""

    def __init__(self) -> None:
        self._beat = Throttle(2.0)
        self._changes = ChangeDetector()
        self._lines: dict[str, set[int]] = {}
        """Of every colony the founders with lines of their own"""

    def layout(self) -> "rrb.Container":
        """Return the place of the family, with the founders' shares below."""
        import rerun.blueprint as rrb

        return rrb.Vertical(
            rrb.GraphView(
                origin="/lineage/family",
                name="Family of the last births: generations down, robots across, colour of the main founder",
                force_link=rrb.archetypes.ForceLink(enabled=False),
                force_many_body=rrb.archetypes.ForceManyBody(enabled=False),
                force_position=rrb.archetypes.ForcePosition(enabled=False),
                force_collision_radius=rrb.archetypes.ForceCollisionRadius(enabled=False),
                force_center=rrb.archetypes.ForceCenter(enabled=False),
            ),
            rrb.TimeSeriesView(
                origin="/lineage/founders",
                name="Share of founders in the genes of all who live",
                axis_x=whole_past(),
                axis_y=rrb.ScalarAxis(range=(-0.02, 1.02)),
            ),
            row_shares=[2, 1],
            name="Lineage",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Nothing is there before somebody is born."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw family and founders, if anybody was born since, and now and then."""
        if not self._beat.is_due(moment.unix_s):
            return
        colonies = [colony for colony in view.colonies.values() if len(colony.family)]
        if not colonies:
            return
        changes = sum(colony.family.changes for colony in colonies)
        if not self._changes.is_due(changes, moment.unix_s):
            return
        self._draw_family(streams, view, colonies)
        for colony in colonies:
            self._draw_founders(streams, view, colony)

    def _draw_family(self, streams: RerunStreams, view: ColonyView, colonies: list[Colony]) -> None:
        import rerun as rr

        members: list[Member] = []
        for colony in colonies:
            members += colony.family.last_births(_MAX_NODES // len(colonies))
        shown = {member.agent for member in members}
        edges = [
            (parent, member.agent)
            for member in members
            for parent in (member.mother, member.father)
            if parent in shown and parent is not None
        ]
        columns = _columns(members, [status.robot for status in view.monitor.all])
        streams.log(
            "/lineage/family",
            rr.GraphNodes(
                [member.agent for member in members],
                positions=[
                    (_COLUMN * columns[member.robot, member.place], _ROW * member.generation)
                    for member in members
                ],
                labels=[number_of(member.agent) for member in members],
                show_labels=False,
                radii=np.full(len(members), 7.0),
                colors=palette.colours(
                    palette.founder_colour(member.founder) for member in members
                ),
            ),
            rr.GraphEdges(edges, graph_type="directed"),
        )

    def _draw_founders(self, streams: RerunStreams, view: ColonyView, colony: Colony) -> None:
        import rerun as rr

        is_new = colony.name not in self._lines
        lines = self._lines.setdefault(colony.name, set())
        others = f"/lineage/founders/{safe(colony.name)}_others"
        if is_new:
            style = rr.SeriesLines(names=["all others"], colors=[palette.DIM], widths=[1.0])
            streams.log(others, style, static=True)
        founders = len(colony.family.founders)
        least = _LEAST_SHARE if founders <= _MAX_FOUNDERS else max(_LEAST_SHARE, _GROWN / founders)
        shares = colony.family.shares(status.robot for status in view.alive)
        for number, share in shares.items():
            room = _MAX_FOUNDERS - sum(map(len, self._lines.values()))
            if number not in lines and share >= least and room > 0:
                lines.add(number)
                founder = colony.family.founders[number]
                name = f"{view.call(robot_of(founder))} agent {number_of(founder)}"
                colour = palette.founder_colour(number)
                style = rr.SeriesLines(names=[name], colors=[colour], widths=[1.6])
                streams.log(_line_of(colony, number), style, static=True)
        for number in sorted(lines):  # who has died out too
            streams.log(_line_of(colony, number), rr.Scalars(shares.pop(number, 0.0)))
        streams.log(others, rr.Scalars(sum(shares.values())))


def _line_of(colony: Colony, founder: int) -> str:
    return f"/lineage/founders/{safe(colony.name)}_{safe(colony.family.founders[founder])}"


def _columns(members: list[Member], robots: list[RobotId]) -> dict[tuple[RobotId, int], int]:
    """Return the column of every place in every robot: its own for good, or of so many robots only of those shown."""
    places = 1 + max((member.place for member in members), default=0)
    order = {robot: number for number, robot in enumerate(robots)}
    for member in members:
        order.setdefault(member.robot, len(order))
    slots = {
        (member.robot, member.place): places * order[member.robot] + member.place
        for member in members
    }
    if places * len(order) <= _MAX_COLUMNS:
        return slots
    return {key: rank for rank, key in enumerate(sorted(slots, key=lambda key: (slots[key], key)))}
