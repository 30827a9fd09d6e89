"""`crcolony authority`: admit the members of a deployment, and revoke them."""

import argparse
import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from crcolony.commands.deployment_options import (
    AUTHORITY_PORT,
    ROLES,
    check_packages,
    host_and_port,
)
from crcolony.commands.network_options import NAME_RULE, add_network, check_names, network_of
from crcolony.commands.options import UsageError, add_examples
from crcolony.errors import EXIT_OK

if TYPE_CHECKING:
    from crcolony_deploy.authority import Authority

    Actions = argparse._SubParsersAction[argparse.ArgumentParser]

_AS_OPERATOR = " --credentials operator --connect tls/10.0.0.1:7447"
_CREATE = "crcolony authority create authority"
_SERVE = f"crcolony authority serve authority --at 10.0.0.5:{AUTHORITY_PORT}"
_INVITE = "crcolony authority invite authority robot kitchen"
_REVOKE = f"crcolony authority revoke authority kitchen{_AS_OPERATOR}"


def add_authority(parser: argparse.ArgumentParser) -> None:
    """Add the options of `crcolony authority`."""
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    create = _action(actions, "create", _create, "make an authority in a new folder")
    create.add_argument("--colony", default="colony", metavar="NAME", help=f"name: {NAME_RULE}")
    create.add_argument(
        "--lifetime-h",
        type=float,
        default=24.0,
        metavar="H",
        help="how long a certificate is valid, and a revoked member can connect at most (default 24)",
    )
    add_examples(create, (f"{_CREATE} --colony lab", "on one machine, once; keep the folder safe"))
    members = _action(actions, "members", _members, "print who belongs to the deployment")
    add_examples(members, ("crcolony authority members authority", "those revoked are marked"))
    _add_invite(actions)
    serve = _action(
        actions, "serve", _serve, "enroll members by invitation, and renew certificates"
    )
    serve.add_argument(
        "--at",
        default=f"127.0.0.1:{AUTHORITY_PORT}",
        metavar="HOST:PORT",
        help=f"address to listen on (default 127.0.0.1:{AUTHORITY_PORT})",
    )
    add_examples(serve, (_SERVE, "while members enroll, or always"))
    issue = _action(actions, "issue", _issue, "answer a request that was brought by file")
    issue.add_argument("request", type=Path, metavar="REQUEST", help="as crcolony enroll wrote it")
    issue.add_argument("grant", type=Path, metavar="GRANT", help="file for the answer")
    add_examples(
        issue,
        ("crcolony authority issue authority kitchen.request kitchen.grant", "carried by hand"),
    )
    _add_changes(actions)
    add_examples(
        parser,
        (f"{_CREATE} --colony lab", "on one machine, once; keep the folder safe"),
        (_SERVE, "while members enroll, or always"),
        (_INVITE, "prints what to type on the robot"),
        (_REVOKE, "within a second, wherever the colony is reached"),
    )


def _add_invite(actions: "Actions") -> None:
    invite = _action(actions, "invite", _invite, "print an invitation, with which a member enrolls")
    invite.add_argument("role", choices=ROLES, metavar="ROLE", help=", ".join(ROLES))
    invite.add_argument("name", metavar="NAME", help="letters, digits, _ and -, at most 48")
    invite.add_argument(
        "--minutes", type=float, default=15.0, metavar="M", help="how long it is valid (default 15)"
    )
    add_examples(invite, (_INVITE, "prints what to type on the robot"))


def _add_changes(actions: "Actions") -> None:
    """Add what changes the roster, or publishes it."""
    for name, function, summary in (
        ("revoke", _revoke, "revoke a member: nobody mates with it or hears it any more"),
        ("reinstate", _reinstate, "admit a revoked member again"),
        ("publish", _publish, "publish the roster to the colony again"),
    ):
        change = _action(actions, name, function, summary)
        if name != "publish":
            change.add_argument("name", metavar="NAME", help="as crcolony authority members has it")
        add_network(change)
        member = " kitchen" if name != "publish" else ""
        add_examples(
            change, (f"crcolony authority {name} authority{member}{_AS_OPERATOR}", "everywhere")
        )


def _action(
    actions: "Actions",
    name: str,
    function: Callable[[argparse.Namespace], int],
    summary: str,
) -> argparse.ArgumentParser:
    parser = actions.add_parser(name, help=summary, description=summary)
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of the authority")
    parser.set_defaults(command=lambda options: _run(function, options))
    return parser


def _run(function: Callable[[argparse.Namespace], int], options: argparse.Namespace) -> int:
    check_packages()
    return function(options)


def _create(options: argparse.Namespace) -> int:
    from crcolony_deploy.authority import Authority, AuthoritySettings
    from crcolony_deploy.invitations import fingerprint_of

    options.arena = "arena"
    check_names(options)
    settings = AuthoritySettings(options.colony, options.lifetime_h)
    authority = Authority.create(options.folder, settings)
    fingerprint = fingerprint_of(authority.identity.public_key)
    print(f"authority {fingerprint} of colony {options.colony} in {options.folder}")
    print(f"{options.folder}/authority.key admits anybody: keep it safe, and a copy of the folder")
    return EXIT_OK


def _members(options: argparse.Namespace) -> int:
    with _opened(options) as authority:
        roster = authority.roster
    print(f"colony {roster.colony}, roster {roster.serial}, {len(roster.members)} members")
    for member in roster.members:
        speaks = [robot.hex() for robot in member.robots] + [
            f"arena {one}" for one in member.arenas
        ]
        state = "  REVOKED" if member.is_revoked else ""
        print(f"{member.common_name:<32} {' '.join(speaks)}{state}")
    return EXIT_OK


def _invite(options: argparse.Namespace) -> int:
    import time

    from crcolony_deploy.authority import check_member_name
    from crcolony_deploy.invitations import InvitationBook, fingerprint_of

    check_member_name(options.name)
    if not 0.0 < options.minutes <= 24 * 60:
        raise UsageError(f"--minutes {options.minutes:g}: must be above 0 and at most a day")
    with _opened(options) as authority:
        book = InvitationBook(options.folder)
        pin = book.invite(options.role, options.name, time.time(), 60.0 * options.minutes)
        fingerprint = fingerprint_of(authority.identity.public_key)
        authority.record("invite", member=f"{options.role}.{options.name}")
    print(f"invitation for {options.role}.{options.name}, {options.minutes:g} minutes, shown once:")
    key = " --key FILE" if options.role in ("robot", "host") else ""
    arena = " --arena NAME" if options.role in ("arena", "bridge", "host") else ""
    print(
        f"  crcolony enroll {options.role} {options.name}{key}{arena} --out DIR --at HOST:PORT"
        f" --invitation {pin}-{fingerprint}"
    )
    return EXIT_OK


def _serve(options: argparse.Namespace) -> int:
    import threading

    from crcolony_deploy.enrollment_service import EnrollmentService, serving

    from crcolony.runtime.console import print_line
    from crcolony.shutdown import ShutdownSignal

    host, port = host_and_port(options.at)
    wake = threading.Event()
    stop = ShutdownSignal(wake=wake.set)
    service = EnrollmentService(options.folder, print_line)
    try:
        with serving(service, options.folder, host, port) as bound:
            print_line(f"authority of colony {service.colony} at {host}:{bound}")
            while not stop():
                wake.wait(1.0)
    except OSError as error:
        raise UsageError(f"--at {options.at}: {error.strerror}") from None
    return EXIT_OK


def _issue(options: argparse.Namespace) -> int:
    import msgspec
    from crcolony_deploy.membership_request import MAX_REQUEST_BYTES, decode_request

    from crcolony.durable_files import replace_file

    with options.request.open("rb") as file:
        request = decode_request(file.read(MAX_REQUEST_BYTES + 1))
    with _opened(options) as authority:
        grant = authority.admit(request)
    replace_file(options.grant, lambda file: file.write(msgspec.json.encode(grant)))
    print(f"{options.grant}: for {grant.record.common_name}")
    return EXIT_OK


def _revoke(options: argparse.Namespace) -> int:
    with _opened(options) as authority:
        member = authority.revoke(options.name)
        print(f"{member.common_name} is revoked in roster {authority.roster.serial}")
        return _push(options, authority)


def _reinstate(options: argparse.Namespace) -> int:
    with _opened(options) as authority:
        member = authority.reinstate(options.name)
        print(f"{member.common_name} is admitted in roster {authority.roster.serial}")
        return _push(options, authority)


def _publish(options: argparse.Namespace) -> int:
    with _opened(options) as authority:
        return _push(options, authority)


def _push(options: argparse.Namespace, authority: "Authority") -> int:
    """Publish the roster, and return whether everybody has it as an exit code; without credentials say how to."""
    from crcolony_deploy.roster_push import push_roster

    from crcolony.errors import CrcolonyError

    if options.credentials is None:
        print("not published: name an operator's --credentials, and --connect where the colony is")
        return EXIT_OK
    distribution = push_roster(authority, network_of(options))
    if distribution.newer is not None:
        authority.adopt(distribution.newer)
        raise CrcolonyError(
            f"the colony has roster {authority.roster.serial} already: {authority.folder} was an old"
            " copy. It has that roster now; repeat what you changed"
        )
    print(f"{distribution.have_it} of {distribution.online} processes that are online have it")
    return EXIT_OK if distribution.is_complete else 1


def _opened(options: argparse.Namespace) -> "contextlib.AbstractContextManager[Authority]":
    from crcolony_deploy.authority import Authority

    return Authority.opened(options.folder)
