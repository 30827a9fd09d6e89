"""`crcolony enroll`: get the credentials of a member of a deployment, or its next certificate."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.deployment_options import ROLES, check_packages, host_and_port
from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK

if TYPE_CHECKING:
    from crcolony_deploy.member_folder import Applicant


def add_enroll(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony enroll`."""
    parser.add_argument("role", nargs="?", choices=ROLES, metavar="ROLE", help=", ".join(ROLES))
    parser.add_argument("name", nargs="?", metavar="NAME", help="as it was invited")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder of the credentials"
    )
    parser.add_argument(
        "--key",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="secret key of a robot for which the member speaks; may be repeated for a host",
    )
    parser.add_argument(
        "--arena",
        action="append",
        default=[],
        metavar="NAME",
        help="an arena, of the roles arena, bridge and host; may be repeated",
    )
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument(
        "--invitation",
        metavar="TEXT",
        help="as crcolony authority invite printed it; -: ask for it, so that no list of processes has it",
    )
    how.add_argument("--renew", action="store_true", help="get the next certificate")
    how.add_argument(
        "--request", type=Path, metavar="FILE", help="write a request, to be brought by file"
    )
    how.add_argument(
        "--install", type=Path, metavar="FILE", help="use what crcolony authority issue answered"
    )
    parser.add_argument("--at", default="", metavar="HOST:PORT", help="address of the authority")
    parser.add_argument(
        "--if-due",
        action="store_true",
        help="renew only if a third of the certificate's life is over (for a timer)",
    )
    parser.set_defaults(command=_enroll)
    add_examples(
        parser,
        (
            "crcolony enroll robot kitchen --key runs/kitchen/key --out credentials/kitchen"
            " --at 10.0.0.5:7448 --invitation 12345678-0123456789abcdef",
            "then crcolony robot --credentials credentials/kitchen",
        ),
        ("crcolony enroll --renew --if-due --out credentials/kitchen", "from time to time"),
    )


def _enroll(options: argparse.Namespace) -> int:
    check_packages()
    if options.renew:
        return _renew(options)
    if options.install is not None:
        return _install(options)
    import msgspec
    from crcolony_deploy.enrollment_client import enroll
    from crcolony_deploy.member_folder import request_membership, write_enrollment

    from crcolony.durable_files import replace_file

    applicant = _applicant(options)
    if options.request is not None:
        request = request_membership(options.out, applicant)
        replace_file(options.request, lambda file: file.write(msgspec.json.encode(request)))
        print(f"{options.request}: request of {applicant.common_name}")
    else:
        host, port = host_and_port(options.at)
        invitation = options.invitation if options.invitation != "-" else _asked_invitation()
        enroll(host, port, invitation, applicant, options.out)
        print(f"{options.out}: credentials of {applicant.common_name}")
    write_enrollment(options.out, options.at, options.key, options.arena)
    return EXIT_OK


def _asked_invitation() -> str:
    """Return an invitation that is typed, without showing it, or piped in."""
    import getpass
    import sys

    return getpass.getpass("invitation: ") if sys.stdin.isatty() else sys.stdin.readline()


def _renew(options: argparse.Namespace) -> int:
    import time

    from crcolony_deploy.enrollment_client import renew
    from crcolony_deploy.member_folder import read_enrollment, request_membership, validity_in

    if options.if_due and time.time() < validity_in(options.out).renewal_unix_s:
        print(f"{options.out}: not due")
        return EXIT_OK
    applicant, at = read_enrollment(options.out)
    host, port = host_and_port(options.at or at)
    renew(host, port, request_membership(options.out, applicant), options.out)
    print(f"{options.out}: another certificate of {applicant.common_name}")
    return EXIT_OK


def _install(options: argparse.Namespace) -> int:
    from crcolony_deploy.member_folder import install_grant
    from crcolony_deploy.membership_request import MAX_REQUEST_BYTES, decode_grant

    with options.install.open("rb") as file:
        grant = decode_grant(file.read(2 * MAX_REQUEST_BYTES))
    install_grant(options.out, grant)
    print(f"{options.out}: credentials of {grant.record.common_name}")
    return EXIT_OK


def _applicant(options: argparse.Namespace) -> "Applicant":
    from crcolony_deploy.authority import check_member_name
    from crcolony_deploy.member_folder import Applicant

    from crcolony.protocol.identity import load_key

    if options.role is None or options.name is None:
        raise UsageError("which member? crcolony enroll ROLE NAME …")
    check_member_name(options.name)
    robots = tuple(load_key(key) for key in options.key)
    return Applicant(options.role, options.name, robots, tuple(options.arena))
