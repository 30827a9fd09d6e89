"""The present state of the colonies as a few lines of Markdown."""

from statistics import fmean

from crcolony_dashboards.view_model.colony_view import ColonyView


def format_status(view: ColonyView) -> list[str]:
    """Return lines of Markdown: robots online, arenas, and every colony with its counts and rates."""
    monitor = view.monitor
    alive = len(view.alive)
    offline = sum(not status.is_alive for status in monitor.robots.values())
    if not monitor.robots and not monitor.arenas:
        return ["### Waiting for a colony …", "", "No robot is on the network yet."]
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
    for name in sorted(view.colonies):
        lines += _format_colony(view, name)
    return lines


def _format_colony(view: ColonyView, name: str) -> list[str]:
    states = view.states(name)
    if not states:
        return []
    generations = sorted({state.generation for state in states})
    newest = f" to {generations[-1]}" if len(generations) > 1 else ""
    lines = [
        "",
        f"**{name}**: generation {generations[0]}{newest}",
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


def format_duration(seconds: float) -> str:
    """Return a duration as H:MM:SS."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
