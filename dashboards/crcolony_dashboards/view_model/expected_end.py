"""When the next generation of a colony ends, by the lifetimes of its robots: an estimate for people who wait."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from statistics import median

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import RobotState
from crcolony.robot.settings import Life
from crcolony_dashboards.view_model.generation_history import MIN_DRAWN, GenerationHistory


@dataclass(frozen=True)
class ExpectedEnd:
    """When the present generation ends, and how long one takes."""

    remaining_s: float
    generation_s: float


def expected_end(
    states: Iterable[RobotState], starts: Mapping[RobotId, tuple[int, int]], life: Life | None
) -> ExpectedEnd | None:
    """Return when the lowest generation of all robots ends; None if that is unknown.

    `starts` has of every robot the number of a generation and the tick at which it began. A robot that has not
    reported its begin is left out.
    """
    states = list(states)
    if life is None or not states:
        return None
    lowest = min(state.generation for state in states)
    ticks = life.agents * life.slices * life.slice_steps
    remaining = [
        start[1] + ticks - state.tick
        for state in states
        if state.generation == lowest
        and (start := starts.get(state.robot)) is not None
        and start[0] == lowest
    ]
    period_s = median(state.period_ms for state in states) / 1000.0
    if not remaining or period_s <= 0.0:
        return None
    return ExpectedEnd(max(0, *remaining) * period_s, ticks * period_s)


def format_waiting(history: GenerationHistory, end: ExpectedEnd | None) -> str:
    """Return what is said in place of a figure until there are enough generations."""
    needed = f"a figure needs {MIN_DRAWN}"
    if history.count == 0:
        when = f"ends in about {format_wait(end.remaining_s)}" if end else "has not ended yet"
        return f"The first generation {when};\n{needed}."
    ended = "1 generation has" if history.count == 1 else f"{history.count} generations have"
    if end is not None:
        others = max(0, MIN_DRAWN - history.count - 1)
        needed += f": in about {format_wait(end.remaining_s + others * end.generation_s)}"
    return f"{ended} ended;\n{needed}."


def format_wait(seconds: float) -> str:
    """Return a duration in the unit that a person would use."""
    if seconds < 90.0:
        return f"{max(1, round(seconds))} s"
    if seconds < 5_400.0:
        return f"{round(seconds / 60.0)} min"
    return f"{round(seconds / 3_600.0)} h"
