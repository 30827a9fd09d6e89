"""How often robots mate and capture batteries, per robot and minute of their colony's time."""

from collections import deque
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import RobotState

_WINDOW_S = 60.0
"""Rates are means over this much of the past (wall clock)"""


class Rates(NamedTuple):
    """Events per robot and minute."""

    matings: float
    captures: float


@dataclass(frozen=True)
class ProgressSample:
    """The counts of a colony at one moment."""

    minutes: float
    """The colony's own time"""
    robot_minutes: float
    """Minutes summed over all its robots"""
    matings: float
    captures: float


class ColonyRates:
    """Matings and captures of one colony since it is watched, and their rates over the last minute."""

    def __init__(self) -> None:
        self.matings = 0.0
        """Each mating counts once, half for each of its two robots"""
        self.captures = 0.0
        self.samples: deque[tuple[float, ProgressSample]] = deque()
        """Unix time (s) and sample, the oldest first"""

    def add_difference(self, before: RobotState, now: RobotState) -> None:
        """Add what a robot has done between two of its states; counts that fall are ignored."""
        self.matings += max(0, now.matings - before.matings) / 2.0
        self.captures += max(0, now.captures - before.captures)

    def add_sample(self, unix_s: float, minutes: float, robots: int) -> None:
        """Add a sample of the present counts and drop those older than the window."""
        last = self.samples[-1][1] if self.samples else None
        passed = max(0.0, minutes - last.minutes) if last else 0.0
        robot_minutes = (last.robot_minutes if last else 0.0) + passed * robots
        sample = ProgressSample(minutes, robot_minutes, self.matings, self.captures)
        self.samples.append((unix_s, sample))
        while unix_s - self.samples[0][0] > _WINDOW_S:
            self.samples.popleft()

    def per_robot_minute(self) -> Rates | None:
        """Return the rates over the window; None before two samples with robots in between."""
        if len(self.samples) < 2:
            return None
        first, last = self.samples[0][1], self.samples[-1][1]
        minutes = last.robot_minutes - first.robot_minutes
        if minutes <= 0.0:
            return None
        return Rates(
            2.0 * (last.matings - first.matings) / minutes,
            (last.captures - first.captures) / minutes,
        )


class RateCounter:
    """Updates the rates of all colonies from the states of their robots, about once a second."""

    def __init__(self) -> None:
        self._counted: dict[RobotId, RobotState] = {}
        """The last counted state of every robot"""
        self._clock = ""
        """The arena whose time the samples have; empty for the wall clock"""

    def count(self, robot: RobotId, state: RobotState, rates: ColonyRates) -> None:
        """Add what a robot has done since it was counted last; its first state only sets the start."""
        before = self._counted.get(robot)
        self._counted[robot] = state
        if before is not None and before is not state:
            rates.add_difference(before, state)

    def drop_absent(self, robots: Collection[RobotId]) -> None:
        """Drop the states of robots that are no longer tracked."""
        if len(self._counted) > len(robots):
            self._counted = {
                robot: state for robot, state in self._counted.items() if robot in robots
            }

    def set_clock(self, arena: str, colonies: Iterable[ColonyRates]) -> None:
        """Set the arena whose time the next samples have; samples by another clock are dropped."""
        if arena != self._clock:
            self._clock = arena
            for rates in colonies:
                rates.samples.clear()
