"""What a person should know beside the table of robots: what is awaited, and what cannot be reached."""

from collections.abc import Iterator, Sequence

from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.event_text import readable
from crcolony.telemetry.robot_status import ArenaStatus
from crcolony.telemetry.status_changes import ArenaChanged

_TOKEN_TIMEOUT_S = 3.0
"""A robot's token arrives well within this time after the robot is seen in a scene."""
_REMOVAL_TIMEOUT_S = 35.0
"""A body stays in the scene for up to 30 s after its robot has gone."""


def notices(monitor: ColonyMonitor, unix_s: float, problems: Sequence[str] = ()) -> list[str]:
    """Return lines for people; `problems` are those of the network connection."""
    return [*problems, *_awaited(monitor, unix_s, problems), *unreachable_robots(monitor, unix_s)]


def unreachable_robots(monitor: ColonyMonitor, unix_s: float) -> Iterator[str]:
    """Yield a line for every arena with robots whose messages do not arrive here, though the arena has them."""
    for name, arena in sorted(monitor.arenas.items()):
        count = _count_unreachable(monitor, arena, unix_s)
        if count and arena.scene is not None:
            yield (
                f"{count} of {len(arena.scene.robots)} robots in arena {name} cannot be reached from here:"
                " open their ports, or use --client"
            )


def format_arena_change(change: ArenaChanged) -> str:
    """Return what has changed in an arena."""
    changes = readable(", ".join(change.changes))
    return f"arena {change.arena} has other settings than before: {changes}"


def _awaited(monitor: ColonyMonitor, unix_s: float, problems: Sequence[str]) -> Iterator[str]:
    """Yield what is awaited while no robot is online."""
    if monitor.alive or problems:
        return
    if any(status.doing(unix_s) for status in monitor.robots.values()):
        return
    if not any(arena.is_alive or arena.doing(unix_s) for arena in monitor.arenas.values()):
        yield "waiting for robots and an arena to come online …"
    else:
        yield "waiting for robots to come online …"


def _count_unreachable(monitor: ColonyMonitor, arena: ArenaStatus, unix_s: float) -> int:
    """Return how many robots the arena has had for so long that their tokens should be here."""
    if not arena.is_alive:
        return 0
    known = monitor.robots
    return sum(
        unix_s - since_s > (_REMOVAL_TIMEOUT_S if robot in known else _TOKEN_TIMEOUT_S)
        for robot, since_s in arena.without_token.items()
    )
