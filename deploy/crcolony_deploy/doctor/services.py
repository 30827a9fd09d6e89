"""Whether every service of this host runs, and how often it had to be started again."""

from collections.abc import Iterator

from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import HostState, output_of


def check_services(host: HostState) -> Iterator[Finding]:
    """Ask systemd for the state of every unit."""
    running = 0
    for service in host.services:
        text = output_of(
            "systemctl", "show", service.unit, "-p", "ActiveState,NRestarts,StatusText"
        )
        if text is None:
            yield warning("systemd does not answer", "crcolony's units need systemd")
            return
        state = dict(line.partition("=")[::2] for line in text.splitlines())
        look = f"journalctl -u {service.unit} -n 50"
        match state.get("ActiveState"):
            case "active":
                running += 1
            case "activating":
                doing = state.get("StatusText") or "starting"
                yield problem(f"{service.unit} is not ready yet: {doing}", look)
            case other:
                yield problem(
                    f"{service.unit} is {other or 'unknown'}",
                    f"{look}; then systemctl reset-failed and start {service.unit}",
                )
        if (restarts := state.get("NRestarts", "0")) != "0":
            yield warning(f"{service.unit} was restarted {restarts} times", look)
    if running:
        yield ok(f"{running} of {len(host.services)} services run")
    elif not host.services:
        yield warning("no service of crcolony is installed here", "deploy with site.yml")
