"""The lineage tab: the family tree of the last births, and the founders' shares in the colony's genes.

Every agent keeps its position in the graph: the column is given by its robot and its index in it, the row by its
generation. Its colour is that of the founder of most of its genes.
"""

from typing import TYPE_CHECKING

import numpy as np

from crcolony.protocol.identity import RobotId
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_layout import founders_view
from crcolony_dashboards.tabs.tab import entity_name, full_time_axis
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import Colony, ColonyView
from crcolony_dashboards.view_model.family_tree import Member
from crcolony_dashboards.view_model.naming import agent_number, agent_robot

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_PERIOD_S = 2.0
_MAX_NODES = 160
"""Agents in the graph"""
_MAX_FOUNDERS = 24
"""Founders with lines of their own"""
_MIN_SHARE = 0.01
"""A founder gets a line when its share reaches this"""
_MIN_GROWTH = 2.0
"""If there are many founders, its share must also be this many times the initial one"""
_ROW_HEIGHT = 200.0
"""Of the graph, in its own units"""
_COLUMN_WIDTH = 22.0
_MAX_COLUMNS = 200
"""If all robots together need more columns, those of agents that are not drawn are left out"""


class LineageTab:
    """Draws after births, at most every two seconds."""

    def __init__(self) -> None:
        self._throttle = Throttle(_PERIOD_S)
        self._births = ChangeDetector()
        self._lines: dict[str, set[int]] = {}
        """Of every colony the numbers of the founders with lines of their own"""

    def layout(self) -> "rrb.Container":
        """Return the family tree, with the founders' shares and the robots by founder below."""
        import rerun.blueprint as rrb

        return rrb.Vertical(
            rrb.GraphView(
                origin="/lineage/family",
                name="Family tree of the last births: generations down, robots across, colour of the main founder",
                force_link=rrb.archetypes.ForceLink(enabled=False),
                force_many_body=rrb.archetypes.ForceManyBody(enabled=False),
                force_position=rrb.archetypes.ForcePosition(enabled=False),
                force_collision_radius=rrb.archetypes.ForceCollisionRadius(enabled=False),
                force_center=rrb.archetypes.ForceCenter(enabled=False),
            ),
            rrb.Horizontal(
                rrb.TimeSeriesView(
                    origin="/lineage/founders",
                    name="Share of founders in the genes of all living agents",
                    axis_x=full_time_axis(),
                    axis_y=rrb.ScalarAxis(range=(-0.02, 1.02)),
                ),
                founders_view(),
                column_shares=[2, 1],
            ),
            row_shares=[1.6, 1],
            name="Lineage",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Draw nothing: there is nothing to draw yet."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw family tree and founders if there were births, and from time to time for viewers that connect late."""
        if not self._throttle.is_due(moment.unix_s):
            return
        colonies = [colony for colony in view.colonies.values() if len(colony.family)]
        if not colonies:
            return
        births = sum(colony.family.births for colony in colonies)
        if not self._births.is_due(births, moment.unix_s):
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
                    (
                        _COLUMN_WIDTH * columns[member.robot, member.index],
                        _ROW_HEIGHT * member.generation,
                    )
                    for member in members
                ],
                labels=[agent_number(member.agent) for member in members],
                show_labels=False,
                radii=np.full(len(members), 7.0),
                colors=palette.colour_array(
                    palette.founder_colour(member.founder) for member in members
                ),
            ),
            rr.GraphEdges(edges, graph_type="directed"),
        )

    def _draw_founders(self, streams: RerunStreams, view: ColonyView, colony: Colony) -> None:
        import rerun as rr

        is_new = colony.name not in self._lines
        lines = self._lines.setdefault(colony.name, set())
        others = f"/lineage/founders/{entity_name(colony.name)}_others"
        if is_new:
            style = rr.SeriesLines(names=["all others"], colors=[palette.DIM], widths=[1.0])
            streams.log(others, style, static=True)
        founders = len(colony.family.founders)
        min_share = _MIN_SHARE
        if founders > _MAX_FOUNDERS:
            min_share = max(_MIN_SHARE, _MIN_GROWTH / founders)
        shares = colony.family.shares(status.robot for status in view.alive)
        for number, share in shares.items():
            room = _MAX_FOUNDERS - sum(map(len, self._lines.values()))
            if number not in lines and share >= min_share and room > 0:
                lines.add(number)
                founder = colony.family.founders[number]
                name = f"{view.name_of(agent_robot(founder))} agent {agent_number(founder)}"
                colour = palette.founder_colour(number)
                style = rr.SeriesLines(names=[name], colors=[colour], widths=[1.6])
                streams.log(_founder_path(colony, number), style, static=True)
        for number in sorted(lines):  # also of founders that have died out
            streams.log(_founder_path(colony, number), rr.Scalars(shares.pop(number, 0.0)))
        streams.log(others, rr.Scalars(sum(shares.values())))


def _founder_path(colony: Colony, founder: int) -> str:
    return f"/lineage/founders/{entity_name(colony.name)}_{entity_name(colony.family.founders[founder])}"


def _columns(members: list[Member], robots: list[RobotId]) -> dict[tuple[RobotId, int], int]:
    """Return the column of every agent, by robot and index; a fixed one unless there are too many."""
    width = 1 + max((member.index for member in members), default=0)
    order = {robot: number for number, robot in enumerate(robots)}
    for member in members:
        order.setdefault(member.robot, len(order))
    columns = {
        (member.robot, member.index): width * order[member.robot] + member.index
        for member in members
    }
    if width * len(order) <= _MAX_COLUMNS:
        return columns
    return {
        key: rank for rank, key in enumerate(sorted(columns, key=lambda key: (columns[key], key)))
    }
