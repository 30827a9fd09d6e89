"""Whether an arena of one name runs once: of two, each takes the other's robots."""

from collections.abc import Iterator

from crcolony_deploy.doctor.finding import Finding, ok, problem
from crcolony_deploy.doctor.host_state import HostState


def check_arenas(host: HostState) -> Iterator[Finding]:
    """Count the liveliness tokens of every arena."""
    for arena in host.colony.arenas:
        runs = len(arena.tokens)
        if runs > 1:
            yield problem(
                f"{runs} arenas of the name {arena.name} are online",
                "give one another name, or a network of its own",
            )
        elif runs == 1:
            yield ok(f"arena {arena.name} is online once")
    for status in host.colony.robots:
        if len({session for _, session in status.tokens}) > 1:
            yield problem(
                f"robot {status.robot.hex()[:8]} is online in two processes",
                "its key was copied: delete the folder of one of them, key and all",
            )
