"""Whether this host reaches the endpoints to which its services connect, and lets others reach its own."""

import re
from collections.abc import Iterator

from crcolony.transport.connection_check import reasons_unreachable
from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import HostState, output_of


def check_firewall(host: HostState) -> Iterator[Finding]:
    """Connect to every endpoint, and read the policy of iptables where that may be read."""
    endpoints = sorted({e for service in host.services for e in service.values("--connect")})
    reasons = reasons_unreachable(endpoints)
    for reason in reasons:
        yield problem(
            reason, "is that host on, its service active, its firewall open for the port?"
        )
    if endpoints and not reasons:
        yield ok(f"{len(endpoints)} endpoints answer")
    rules = output_of("iptables", "-S", "INPUT")
    if rules is None or not re.search(r"^-P INPUT (DROP|REJECT)$", rules, re.MULTILINE):
        return
    for service in host.services:
        for port in service.ports:
            if not re.search(rf"--dports? (\S*,)?{port}\b.* -j ACCEPT", rules):
                yield warning(
                    f"the firewall drops what it does not know, and has no rule for port {port}",
                    f"iptables -A INPUT -p tcp --dport {port} -j ACCEPT",
                )
