"""The present state of the colonies and the last events, as a few lines of Markdown."""

import re
from collections.abc import Iterable
from statistics import fmean

from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from crcolony_dashboards.view_model.colony_view import ColonyView
from crcolony_dashboards.view_model.expected_end import format_wait
from crcolony_dashboards.view_model.log_lines import LogLine

_ESCAPED = r"\\\1"
_MARKUP = re.compile(r"([\\`*_{}\[\]<>()#+!|~-])")

_MAX_ACTIVITIES = 5
"""Robots and arenas that are not at work yet, and have a line each"""


def format_status(view: ColonyView, unix_s: float) -> list[str]:
    """Return lines of Markdown: robots online, arenas, and every colony with its counts and rates."""
    monitor = view.monitor
    alive = len(view.alive)
    offline = sum(not status.is_alive for status in monitor.robots.values())
    if not monitor.robots and not monitor.arenas:
        return ["### Waiting for a colony …", "", *(f"- {line}" for line in view.notices)]
    robots = "robot" if alive == 1 else "robots"
    lines = [f"### {alive} {robots} online" + (f", {offline} offline" if offline else "")]
    drawn = {arena.name for arena in view.arenas}
    for name, arena in sorted(monitor.arenas.items()):
        scene = arena.scene
        if not arena.is_alive:
            lines.append(f"- arena **{name}** is offline")
        elif scene is not None and name in drawn:
            clock = format_duration(scene.tick * scene.period_s)
            lines.append(f"- arena **{name}**: time {clock}, {len(scene.robots)} bodies")
            age_s = unix_s - arena.updated_s
            if age_s > SILENT_AFTER_S:
                lines.append(
                    f"- **no positions for {format_wait(age_s)}**: robots are grey where they were last seen"
                )
    lines += _format_activities(view)
    lines += [f"- **{line}**" for line in view.notices]
    for name in sorted(view.colonies):
        lines += _format_colony(view, name)
    return lines


def _format_activities(view: ColonyView) -> list[str]:
    """Return a line for every robot and arena that is not at work yet, as many as there is room for."""
    names = list(view.activities)
    lines = [
        f"- {name}: {_MARKUP.sub(_ESCAPED, view.activities[name])}"
        for name in names[:_MAX_ACTIVITIES]
    ]
    if len(names) > _MAX_ACTIVITIES:
        lines.append(f"- and {len(names) - _MAX_ACTIVITIES} more")
    return lines


def _format_colony(view: ColonyView, name: str) -> list[str]:
    states = view.states(name)
    if not states:
        return []
    generations = sorted({state.generation for state in states})
    newest = f" to {generations[-1]}" if len(generations) > 1 else ""
    end = view.expected_end(view.colonies[name])
    lines = [
        "",
        f"**{name}**: generation {generations[0]}{newest}"
        + (f", ends in about {format_wait(end.remaining_s)}" if end is not None else ""),
        f"- mean energy {fmean(state.energy for state in states):.2f}",
        f"- {sum(state.matings for state in states) / 2:,.0f} matings,"
        f" {sum(state.conceptions for state in states):,} offspring conceived",
        f"- {sum(state.captures for state in states):,} batteries captured",
    ]
    rates = view.colonies[name].rates.per_robot_minute()
    if rates is not None:
        lines.append(
            f"- per robot and minute {rates.matings:.2f} matings, {rates.captures:.2f} batteries"
        )
    doubts, orphaned = sum(s.doubts for s in states), sum(s.orphaned for s in states)
    if doubts or orphaned:
        lines.append(f"- {doubts} matings in doubt, {orphaned} orphaned")
    return lines


def format_events(events: Iterable[LogLine], period_s: float | None) -> str:
    """Return events as a list in Markdown, the newest first, with the colony's time if its period is known."""
    lines = [f"- {_MARKUP.sub(_ESCAPED, format_line(event, period_s))}" for event in events]
    return "\n".join(reversed(lines)) or "Nothing has happened yet."


def format_line(line: LogLine, period_s: float | None) -> str:
    """Return a log line with the colony's time at which it happened, if that is known."""
    if line.tick is None or period_s is None:
        return line.text
    return f"{format_duration(line.tick * period_s)}  {line.text}"


def format_duration(seconds: float) -> str:
    """Return a duration as H:MM:SS."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
