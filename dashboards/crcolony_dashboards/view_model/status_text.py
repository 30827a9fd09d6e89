"""How colonies are, in a few words."""

from statistics import fmean

from crcolony_dashboards.view_model.colony_view import ColonyView


def now_in_words(view: ColonyView) -> list[str]:
    """Say how the colonies are now, as lines of Markdown."""
    monitor = view.monitor
    alive = len(view.alive)
    gone = sum(not status.is_alive for status in monitor.robots.values())
    if not monitor.robots and not monitor.arenas:
        return ["### Looking for a colony …", "", "Nobody is on the network yet."]
    robots = "robot" if alive == 1 else "robots"
    lines = [f"### {alive} {robots} alive" + (f", {gone} gone" if gone else "")]
    seen = {arena.name for arena in view.arenas}
    for name, arena in sorted(monitor.arenas.items()):
        scene = arena.scene
        if not arena.is_alive:
            lines.append(f"- arena **{name}** is gone")
        elif scene is not None and name in seen:
            clock = hours_of(scene.tick * scene.period_s)
            lines.append(f"- arena **{name}**: {clock} of its time, {len(scene.robots)} bodies")
    for name in sorted(view.colonies):
        lines += _colony_in_words(view, name)
    return lines


def _colony_in_words(view: ColonyView, name: str) -> list[str]:
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
    rates = view.rates(view.colonies[name])
    if rates is not None:
        lines.append(f"- in a robot's minute {rates[0]:.2f} matings, {rates[1]:.2f} batteries")
    doubts, orphaned = sum(s.doubts for s in states), sum(s.orphaned for s in states)
    if doubts or orphaned:
        lines.append(f"- {doubts} matings in doubt, {orphaned} orphaned")
    return lines


def hours_of(seconds: float) -> str:
    """Return a time as hours, minutes and seconds."""
    minutes, left = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{left:02d}"
