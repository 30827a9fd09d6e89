"""Whether this host sees its own robots online, with bodies."""

from collections.abc import Iterator

from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import HostState


def check_robots(host: HostState) -> Iterator[Finding]:
    """Compare the robots that are installed with those that are online."""
    if not host.of_kind("robot"):
        return
    view, own = host.colony, host.own_robots
    if view.problem:
        yield problem(
            f"the colony cannot be reached: {view.problem}", "see ports and firewall below"
        )
        return
    online = {status.robot: status for status in view.robots}
    for service in host.of_kind("robot"):
        robot = own.get(service.name)
        status = online.get(robot) if robot is not None else None
        if robot is None:
            yield problem(
                f"robot {service.name}: its key cannot be read", "run as root, or start it once"
            )
        elif status is None:
            yield problem(
                f"robot {service.name} ({robot.hex()[:8]}) is not online",
                f"journalctl -u {service.unit} -n 50",
            )
        elif not host.may_watch:
            yield ok(f"robot {service.name} is online; with an observer's credentials more is seen")
        elif status.state is None or not status.state.arena:
            arena = service.value("--arena", "arena")
            yield problem(
                f"robot {service.name} has no body",
                f"does arena {arena} run, with a slot for it? crcolony status shows it",
            )
        else:
            yield ok(f"robot {service.name} lives in arena {status.state.arena}")
    known = {service.value("--arena", "arena") for service in host.of_kind("robot")}
    known |= {service.name for service in host.of_kind("arena", "bridge")}
    colonies = {service.value("--colony", "colony") for service in host.of_kind("robot")}
    strange = sorted(
        {
            status.state.arena
            for status in view.robots
            if status.colony in colonies and status.state and status.state.arena
        }
        - known
    )
    if strange:
        yield warning(
            f"robots of this host's colony live in arenas that it does not know: {', '.join(strange)}",
            "another colony of the same name? Give one of them another crcolony_colony",
        )
