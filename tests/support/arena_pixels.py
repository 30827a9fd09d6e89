"""Measures the arena of a dashboard on a picture of a viewer."""

import numpy as np
from crcolony_dashboards.tabs import palette

from crcolony.protocol.telemetry_messages import Scene, SceneRobot
from tests.support.rerun_viewer import Picture
from tests.support.telemetry_recorder import BODY_M

ROOM_M = 0.2
"""A robot is isolated if nothing is nearer to its centre than this: nothing hides its disc"""
WALL_PX = 5.0
"""Width of the walls on a picture"""


class Pixels:
    """Converts metres of an arena to pixels of a picture, by the walls in it."""

    def __init__(self, picture: Picture, scene: Scene) -> None:
        self.picture = picture
        is_wall = np.all(np.abs(picture.astype(int) - palette.DIM) < 14, axis=-1)
        columns = np.flatnonzero(is_wall.sum(axis=0) > 0.5 * is_wall.sum(axis=0).max())
        rows = np.flatnonzero(is_wall.sum(axis=1) > 0.5 * is_wall.sum(axis=1).max())
        self._left, self._right = float(columns.min()), float(columns.max())
        self._top, self._bottom = float(rows.min()), float(rows.max())
        self.per_m = (self._right - self._left - WALL_PX) / scene.width_m

    def of(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the column and the row of a position."""
        middle = (0.5 * (self._left + self._right), 0.5 * (self._top + self._bottom))
        return middle[0] + self.per_m * x_m, middle[1] - self.per_m * y_m

    def disc(self, robot: SceneRobot) -> tuple[float, float] | None:
        """Return the centre of the disc that is drawn near a robot's position, by its edges; None if there is none."""
        column, row = self.of(robot.x_m, robot.y_m)
        rows, columns = np.indices(self.picture.shape[:2])
        is_near = np.hypot(rows - row, columns - column) < (ROOM_M - 0.01) * self.per_m
        is_disc = is_near & (np.ptp(self.picture.astype(int), axis=-1) > 50)
        least = 0.25 * BODY_M * self.per_m  # more than what is thin: the line of a mating
        high = np.flatnonzero(is_disc.sum(axis=1) > least)
        wide = np.flatnonzero(is_disc.sum(axis=0) > least)
        if not len(high) or not len(wide):
            return None
        return 0.5 * (wide[0] + wide[-1]), 0.5 * (high[0] + high[-1])

    def off_px(self, robots: list[SceneRobot]) -> float:
        """Return the largest distance between a robot's position and the disc that is drawn of it."""
        worst = 0.0
        for robot in robots:
            found = self.disc(robot)
            if found is None:
                return float("inf")
            column, row = self.of(robot.x_m, robot.y_m)
            worst = max(worst, float(np.hypot(found[0] - column, found[1] - row)))
        return worst

    def ring(self, robot: SceneRobot) -> np.ndarray:
        """Return the median colour of a robot's ring, (3,)."""
        angles = robot.heading_rad + np.linspace(0.7, 2 * np.pi - 0.7, 40)
        places = [
            self.of(
                robot.x_m + 0.84 * BODY_M * np.cos(angle), robot.y_m + 0.84 * BODY_M * np.sin(angle)
            )
            for angle in angles
        ]
        colours = [self.picture[round(row), round(column)] for column, row in places]
        return np.asarray(np.median(np.array(colours, dtype=float), axis=0))
