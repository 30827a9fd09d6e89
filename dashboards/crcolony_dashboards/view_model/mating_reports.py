"""Matings in words: both robots report each one, and it stands once in the log."""

from collections import OrderedDict

from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Encounter
from crcolony.protocol.telemetry_messages import EventMessage, Exchanged
from crcolony_dashboards.view_model.log_lines import LogLine
from crcolony_dashboards.view_model.naming import NameLookup

_PATIENCE_S = 3.0
"""Without the second robot's report for so long, a mating is written as one of them reported it"""
_MAX_WAITING = 4_000
"""Reports that wait for the other robot's; of more the oldest are written"""
_MAX_WRITTEN = 20_000
"""Matings that are recognised when the second report arrives later"""


class MatingReports:
    """Joins the two reports of every mating."""

    def __init__(self) -> None:
        self._waiting: OrderedDict[Encounter, tuple[EventMessage, Exchanged, float]] = OrderedDict()
        """The first report of a mating, and when it was received"""
        self._written: OrderedDict[Encounter, None] = OrderedDict()
        """Matings that were written after one report only"""

    def add(
        self, message: EventMessage, event: Exchanged, unix_s: float, name_of: NameLookup
    ) -> LogLine | None:
        """Add one robot's report; return the line of the mating if the other robot has reported before."""
        if event.encounter in self._written:
            return None
        first = self._waiting.get(event.encounter)
        if first is None:
            self._waiting[event.encounter] = (message, event, unix_s)
            return None
        if first[0].robot == message.robot:
            return None
        del self._waiting[event.encounter]
        sides = {first[0].robot: first[1], message.robot: event}
        return _line(event.encounter, sides, name_of)

    def pop_overdue(self, unix_s: float, name_of: NameLookup) -> list[LogLine]:
        """Return the lines of matings of which the second report has not arrived in time."""
        lines = []
        while self._waiting:
            encounter, (message, event, received_s) = next(iter(self._waiting.items()))
            is_overdue = abs(unix_s - received_s) > _PATIENCE_S
            if not is_overdue and len(self._waiting) <= _MAX_WAITING:
                break
            del self._waiting[encounter]
            self._written[encounter] = None
            if len(self._written) > _MAX_WRITTEN:
                self._written.popitem(last=False)
            lines.append(_line(encounter, {message.robot: event}, name_of))
        return lines


def _line(encounter: Encounter, sides: dict[RobotId, Exchanged], name_of: NameLookup) -> LogLine:
    """Return the line of a mating, by the reports of its robots."""
    robots = (encounter.initiator, encounter.responder)
    parents = [name_of(robot) for robot in robots if robot in sides and sides[robot].conceived]
    silent = [name_of(robot) for robot in robots if robot not in sides]
    text = f"{name_of(robots[0])} and {name_of(robots[1])} mated; {_conception(parents, sides)}"
    if silent:
        text += f" ({silent[0]} has not reported)"
    return LogLine("mating", text, tick=next(iter(sides.values())).tick)


def _conception(parents: list[str], sides: dict[RobotId, Exchanged]) -> str:
    if len(parents) == 2:
        return "both conceived"
    if parents:
        return f"{parents[0]} conceived"
    is_late = any(side.too_late for side in sides.values())
    return "too late for offspring" if is_late else "no offspring"
