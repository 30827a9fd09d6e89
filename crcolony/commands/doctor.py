"""`crcolony doctor`: say what is wrong on this host, one line each with the remedy."""

import argparse
from pathlib import Path

from crcolony.commands.network_options import add_network, network_of
from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK, EXIT_PROBLEMS, did_you_mean


def add_doctor(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony doctor`."""
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="CHECK",
        help="make this check alone; may be repeated (default: all)",
    )
    parser.add_argument(
        "--within",
        type=float,
        default=0.0,
        metavar="S",
        help="repeat for so many seconds, as long as there is a problem (default 0)",
    )
    parser.add_argument(
        "--seconds", type=float, default=3.0, metavar="S", help="time to listen (default 3)"
    )
    parser.add_argument(
        "--services",
        type=Path,
        default=Path("/etc/crcolony"),
        metavar="DIR",
        help="folder with the options of this host's services (default /etc/crcolony)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON, for programs")
    add_network(parser)
    parser.set_defaults(command=_doctor)
    add_examples(
        parser,
        ("crcolony doctor", "all checks of this host; exit code 1 if there is a problem"),
        ("crcolony doctor --only clock --only disk", "these two"),
        (
            "crcolony doctor --credentials credentials/me --only access",
            "prove that certificates and access control are in force",
        ),
    )


def _doctor(options: argparse.Namespace) -> int:
    import time

    import msgspec
    from crcolony_deploy.doctor.examine import CHECKS, examine, has_problem, print_findings
    from crcolony_deploy.doctor.host_state import HostState
    from crcolony_deploy.doctor.installed_services import (
        network_of_services,
        observer_network,
        read_services,
    )

    from crcolony.runtime.console import print_line

    for name in options.only:
        if name not in CHECKS:
            hint = did_you_mean(name, CHECKS)
            raise UsageError(f"--only {name!r}: one of {', '.join(CHECKS)}{hint}")
    if not 0.0 < options.seconds <= 600.0:
        raise UsageError(f"--seconds {options.seconds:g}: must be above 0 and at most 600")
    if not 0.0 <= options.within <= 3600.0:
        raise UsageError(f"--within {options.within:g}: must be from 0 to 3600")
    given = network_of(options)
    end_s = time.monotonic() + options.within
    while True:
        services = read_services(options.services)
        is_given = options.connect or options.listen or options.interface or options.client
        network = given
        if services and not is_given:
            network = observer_network(options.services) or network_of_services(services)
        if options.credentials is not None:
            network = msgspec.structs.replace(network, credentials=options.credentials)
        findings = examine(
            HostState(tuple(services), network, options.seconds), options.only or list(CHECKS)
        )
        if not has_problem(findings) or time.monotonic() >= end_s:
            break
    print_findings(findings, options.json, print_line)
    return EXIT_PROBLEMS if has_problem(findings) else EXIT_OK
