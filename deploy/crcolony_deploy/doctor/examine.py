"""Makes all checks of a host, in order, and prints what they find."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace

from crcolony_deploy.doctor.access import check_access
from crcolony_deploy.doctor.arenas import check_arenas
from crcolony_deploy.doctor.certificates import check_certificates
from crcolony_deploy.doctor.clock import check_clock
from crcolony_deploy.doctor.compiled_code import check_compiled_code
from crcolony_deploy.doctor.finding import Finding
from crcolony_deploy.doctor.firewall import check_firewall
from crcolony_deploy.doctor.host_state import HostState
from crcolony_deploy.doctor.membership import check_membership
from crcolony_deploy.doctor.multicast import check_multicast
from crcolony_deploy.doctor.ports import check_ports
from crcolony_deploy.doctor.resources import check_disk, check_memory
from crcolony_deploy.doctor.robots import check_robots
from crcolony_deploy.doctor.serial_devices import check_serial_devices
from crcolony_deploy.doctor.services import check_services
from crcolony_deploy.doctor.versions import check_versions

Check = Callable[[HostState], Iterator[Finding]]

CHECKS: dict[str, Check] = {
    "services": check_services,
    "ports": check_ports,
    "firewall": check_firewall,
    "multicast": check_multicast,
    "serial": check_serial_devices,
    "disk": check_disk,
    "memory": check_memory,
    "compiled": check_compiled_code,
    "robots": check_robots,
    "arenas": check_arenas,
    "versions": check_versions,
    "clock": check_clock,
    "certificates": check_certificates,
    "membership": check_membership,
    "access": check_access,
}
"""Every check by its name, in the order in which they are made."""

_MARKS = {"ok": "ok      ", "warning": "warning ", "problem": "PROBLEM "}


def examine(host: HostState, names: Sequence[str]) -> list[Finding]:
    """Return what the named checks find."""
    return [replace(finding, check=name) for name in names for finding in CHECKS[name](host)]


def print_findings(
    findings: Sequence[Finding], as_json: bool, print_line: Callable[[str], None]
) -> None:
    """Print a line for each finding, or all as JSON."""
    if as_json:
        print_line(json.dumps([asdict(finding) for finding in findings], indent=2))
        return
    for finding in findings:
        remedy = f"; {finding.remedy}" if finding.remedy else ""
        print_line(f"{_MARKS[finding.level]}{finding.check}: {finding.what}{remedy}")


def has_problem(findings: Sequence[Finding]) -> bool:
    """Return whether anything keeps a service from its work."""
    return any(finding.level == "problem" for finding in findings)
