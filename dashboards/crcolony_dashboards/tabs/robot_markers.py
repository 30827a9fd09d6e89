"""Everybody in all arenas: where they are on the picture, and in which colours. Arrays, one row a robot.

Positions are new with every scene. Colours come from what robots tell of themselves, twice a second, and are looked up
less often than scenes come.
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
"""Between two arenas, which stand side by side"""
_BODY_M = 0.11
_SMALLEST = 0.0055
"""A robot's radius on the picture is at least this share of its arena's size"""
_LOOKS_S = 0.4
"""How often colours are looked up"""

Points = NDArray[np.float64]
"""(n, 2) metres"""


def offsets_m(scenes: Sequence[Scene]) -> list[float]:
    """Return where the middle of each arena is on the picture, from left to right."""
    offsets, right_m = [], 0.0
    for number, scene in enumerate(scenes):
        middle_m = right_m + 0.5 * scene.width_m if number else 0.0
        offsets.append(middle_m)
        right_m = middle_m + 0.5 * scene.width_m + GAP_M
    return offsets


@dataclass(frozen=True)
class Looks:
    """The colours of robots, in the order of `Crowd.robots`; (n, 3)."""

    robots: list[RobotId]
    rings: Colours
    """Energy"""
    faces: Colours
    """Module in use"""
    founders: Colours
    """The founder of most genes of the agent in control"""
    stale: list[bool]


@dataclass(frozen=True)
class Crowd:
    """Robots where they are now."""

    robots: list[RobotId]
    points: Points
    headings: NDArray[np.float64]
    """(n,) radians"""
    radius_m: float
    """Of a robot on the picture: in a large arena larger than it is"""


def crowd_of(scenes: Sequence[Scene]) -> Crowd:
    """Return everybody who is in a scene."""
    robots = [seen.robot for scene in scenes for seen in scene.robots]
    rows = [
        (seen.x_m + offset_m, seen.y_m, seen.heading_rad)
        for scene, offset_m in zip(scenes, offsets_m(scenes), strict=True)
        for seen in scene.robots
    ]
    where = np.array(rows, dtype=float).reshape(-1, 3)
    extent_m = max((max(scene.width_m, scene.height_m) for scene in scenes), default=0.0)
    return Crowd(robots, where[:, :2], where[:, 2], max(_BODY_M, _SMALLEST * extent_m))


class LooksOf:
    """Looks up colours, and remembers them for a moment."""

    def __init__(self) -> None:
        self._beat = Throttle(_LOOKS_S)
        nobody = palette.colours([])
        self._looks = Looks([], nobody, nobody, nobody, [])
        self._founders: dict[RobotId, tuple[str, palette.Colour]] = {}

    def of(self, view: ColonyView, crowd: Crowd, unix_s: float) -> Looks:
        """Return how robots look now; who is silent, or whose arena is, is grey."""
        if self._beat.is_due(unix_s) or crowd.robots != self._looks.robots:
            self._looks = self._look(view, crowd, unix_s)
        return self._looks

    def _look(self, view: ColonyView, crowd: Crowd, unix_s: float) -> Looks:
        robots = view.monitor.robots
        quiet = {
            seen.robot
            for arena in view.arenas
            if arena.scene is not None and unix_s - arena.updated_s > SILENT_AFTER_S
            for seen in arena.scene.robots
        }
        stale, energies, modules, founders = [], [], [], []
        for robot in crowd.robots:
            status = robots.get(robot)
            state = status.state if status is not None else None
            is_stale = state is None or robot in quiet or view.is_stale(status, unix_s)
            stale.append(is_stale)
            energies.append(state.energy if state is not None else 0.0)
            modules.append(palette.module_colour(state.module if state is not None else -1))
            founders.append(self._founder(view, robot, state.agent if state else ""))
        grey = np.array(stale, dtype=bool)[:, None]

        def shaded(colours: Colours) -> Colours:
            return np.where(grey, np.array(palette.STALE, dtype=np.uint8), colours)

        return Looks(
            crowd.robots,
            shaded(palette.energy_colours(energies)),
            shaded(palette.colours(modules)),
            shaded(palette.colours(founders)),
            stale,
        )

    def _founder(self, view: ColonyView, robot: RobotId, agent: str) -> palette.Colour:
        known = self._founders.get(robot)
        if known is not None and known[0] == agent:
            return known[1]
        colony = view.colony_of(robot)
        member = colony.family[agent] if colony is not None else None
        if member is None:
            return palette.DIM
        if len(self._founders) > 20_000:
            self._founders.clear()
        colour = palette.founder_colour(member.founder)
        self._founders[robot] = (agent, colour)
        return colour
