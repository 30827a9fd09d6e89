"""The robots of all arenas as arrays, one row a robot: their positions on the picture, and their colours.

Positions change with every scene. Colours depend on the robots' states, which are published twice a second, and are
updated less often than scenes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import SILENT_AFTER_S, Scene
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.palette import Colours
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView

GAP_M = 0.4
"""Between two arenas"""
_BODY_RADIUS_M = 0.11
_MIN_RADIUS_SHARE = 0.0055
"""A robot's radius on the picture is at least this share of its arena's size"""
_COLOURS_PERIOD_S = 0.4
"""How often colours are updated"""
_MAX_CACHED_FOUNDERS = 20_000

Points = NDArray[np.float64]
"""(n, 2) metres"""


def arena_offsets_m(scenes: Sequence[Scene]) -> list[float]:
    """Return the x coordinate of every arena's centre on the picture; the first is at 0, the others to its right."""
    offsets, right_m = [], 0.0
    for number, scene in enumerate(scenes):
        middle_m = right_m + 0.5 * scene.width_m if number else 0.0
        offsets.append(middle_m)
        right_m = middle_m + 0.5 * scene.width_m + GAP_M
    return offsets


@dataclass(frozen=True)
class RobotMarkers:
    """Positions of robots on the picture."""

    robots: list[RobotId]
    points: Points
    headings: NDArray[np.float64]
    """(n,) radians"""
    radius_m: float
    """Of all robots on the picture; in a large arena larger than a body"""


def robot_markers(scenes: Sequence[Scene]) -> RobotMarkers:
    """Return the markers of all robots, in the order of the scenes and of the robots in them."""
    robots = [robot.robot for scene in scenes for robot in scene.robots]
    rows = [
        (robot.x_m + offset_m, robot.y_m, robot.heading_rad)
        for scene, offset_m in zip(scenes, arena_offsets_m(scenes), strict=True)
        for robot in scene.robots
    ]
    poses = np.array(rows, dtype=float).reshape(-1, 3)
    size_m = max((max(scene.width_m, scene.height_m) for scene in scenes), default=0.0)
    radius_m = max(_BODY_RADIUS_M, _MIN_RADIUS_SHARE * size_m)
    return RobotMarkers(robots, poses[:, :2], poses[:, 2], radius_m)


@dataclass(frozen=True)
class RobotColours:
    """Colours of robots, in the order of `RobotMarkers.robots`; (n, 3) each."""

    robots: list[RobotId]
    energy: Colours
    module: Colours
    """Of the learning module in control"""
    founder: Colours
    """Of the founder of most genes of the agent in control"""
    is_stale: list[bool]


class ColourLookup:
    """Computes the colours of robots, and keeps them for a moment."""

    def __init__(self) -> None:
        self._throttle = Throttle(_COLOURS_PERIOD_S)
        empty = palette.colour_array([])
        self._colours = RobotColours([], empty, empty, empty, [])
        self._founders: dict[RobotId, tuple[str, palette.Colour]] = {}
        """Of every robot its agent and the colour of that agent's founder"""

    def colours(self, view: ColonyView, markers: RobotMarkers, unix_s: float) -> RobotColours:
        """Return the colours of all robots; a robot is grey if its state or its arena's scene is stale."""
        if self._throttle.is_due(unix_s) or markers.robots != self._colours.robots:
            self._colours = self._compute(view, markers, unix_s)
        return self._colours

    def _compute(self, view: ColonyView, markers: RobotMarkers, unix_s: float) -> RobotColours:
        in_stale_arenas = {
            robot.robot
            for arena in view.arenas
            if arena.scene is not None and unix_s - arena.updated_s > SILENT_AFTER_S
            for robot in arena.scene.robots
        }
        is_stale, energies, modules, founders = [], [], [], []
        for robot in markers.robots:
            status = view.monitor.robots.get(robot)
            state = status.state if status is not None else None
            is_stale.append(
                state is None or robot in in_stale_arenas or view.is_stale(status, unix_s)
            )
            energies.append(state.energy if state is not None else 0.0)
            modules.append(palette.module_colour(state.module if state is not None else -1))
            founders.append(self._founder_colour(view, robot, state.agent if state else ""))
        grey = np.array(is_stale, dtype=bool)[:, None]

        def shaded(colours: Colours) -> Colours:
            return np.where(grey, np.array(palette.STALE, dtype=np.uint8), colours)

        return RobotColours(
            markers.robots,
            shaded(palette.energy_colours(energies)),
            shaded(palette.colour_array(modules)),
            shaded(palette.colour_array(founders)),
            is_stale,
        )

    def _founder_colour(self, view: ColonyView, robot: RobotId, agent: str) -> palette.Colour:
        cached = self._founders.get(robot)
        if cached is not None and cached[0] == agent:
            return cached[1]
        colony = view.colony_of(robot)
        member = colony.family[agent] if colony is not None else None
        if member is None:
            return palette.DIM
        if len(self._founders) > _MAX_CACHED_FOUNDERS:
            self._founders.clear()
        colour = palette.founder_colour(member.founder)
        self._founders[robot] = (agent, colour)
        return colour
