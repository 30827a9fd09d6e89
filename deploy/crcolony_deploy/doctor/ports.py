"""Whether services listen where they should, and nowhere else."""

import pwd
from collections.abc import Iterator
from pathlib import Path

from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import USER, HostState

_LISTENING = "0A"
"""The state of a socket in /proc/net/tcp."""
_ANY = {"0" * 8, "0" * 32}
"""All addresses, as /proc/net/tcp has them."""


def check_ports(host: HostState) -> Iterator[Finding]:
    """Compare the ports of the inventory with the sockets of this host."""
    sockets = _listening(host.proc)
    expected = {port: service for service in host.services for port in service.ports}
    for port, service in expected.items():
        owners = {uid for _, number, uid in sockets if number == port}
        if not owners:
            yield problem(
                f"port {port}: {service.instance} does not listen there",
                f"journalctl -u {service.unit} -n 50",
            )
        elif (uid := _uid()) is not None and uid not in owners:
            yield problem(
                f"port {port} of {service.instance} is taken by another program",
                f"ss -ltnp 'sport = {port}' names it; or set crcolony_first_port",
            )
        else:
            yield ok(f"port {port}: {service.instance} listens")
    viewers = {
        int(value)
        for service in host.of_kind("dashboard")
        for option in ("--port", "--web-port")
        for value in service.values(option)
    }
    uid = _uid()
    for address, port, owner in sorted(sockets):
        if owner == uid and port not in expected and port not in viewers:
            yield warning(
                f"port {port}: a service listens there, which no option says",
                f"ss -ltnp 'sport = {port}' names it",
            )
        elif owner == uid and address in _ANY and port in expected:
            yield warning(
                f"port {port} is open on all interfaces", "set crcolony_address to one address"
            )


def _listening(proc: Path) -> set[tuple[str, int, int]]:
    """Return address, port and user of every TCP socket that listens."""
    found = set()
    for name in ("tcp", "tcp6"):
        try:
            lines = (proc / "net" / name).read_text().splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            words = line.split()
            if len(words) > 7 and words[3] == _LISTENING:
                address, _, port = words[1].partition(":")
                found.add((address, int(port, 16), int(words[7])))
    return found


def _uid() -> int | None:
    try:
        return pwd.getpwnam(USER).pw_uid
    except KeyError:
        return None
