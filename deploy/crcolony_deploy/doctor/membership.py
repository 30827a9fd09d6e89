"""Whether the members of this host are in the roster of their deployment, for what its services do."""

from collections.abc import Iterator

from crcolony.protocol.roster import Member, Role
from crcolony.transport.interface import NetworkError
from crcolony.transport.network_settings import NetworkSettings, check_endpoints
from crcolony_deploy.doctor.credential_folder import WATCHING, CredentialFolder
from crcolony_deploy.doctor.finding import Finding, ok, problem
from crcolony_deploy.doctor.host_state import HostState
from crcolony_deploy.doctor.installed_services import InstalledService

_ROLES: dict[str, tuple[Role, ...]] = {"router": ("router",), "dashboard": WATCHING}
"""Which roles may do what a service of some kinds does."""


def check_membership(host: HostState) -> Iterator[Finding]:
    """Look for every member of this host in its newest roster."""
    for one in host.credential_folders:
        if one.credentials is None:  # what is wrong is said of its certificate
            continue
        found = [*_of_member(one), *_of_networks(one)]
        if (member := one.credentials.member) is not None:
            for service in one.services:
                found += _of_service(service, member, host.own_robots.get(service.name))
        yield from found
        if not found:
            roster = one.credentials.roster
            name = one.credentials.record.common_name
            yield ok(f"{name} is in roster {roster.serial} of colony {roster.colony}")


def _of_member(one: CredentialFolder) -> Iterator[Finding]:
    assert one.credentials is not None
    record, roster, member = (
        one.credentials.record,
        one.credentials.roster,
        one.credentials.member,
    )
    if member is None:
        yield problem(
            f"{record.common_name} is not in roster {roster.serial}: nobody hears it",
            f"crcolony enroll {record.role} {record.name} --out {one.folder} …",
        )
    elif member.is_revoked:
        yield problem(
            f"{record.common_name} is revoked since roster {roster.serial} or before: nobody hears it",
            f"if that was a mistake: crcolony authority reinstate AUTHORITY {record.common_name}",
        )


def _of_networks(one: CredentialFolder) -> Iterator[Finding]:
    assert one.credentials is not None
    for network in dict.fromkeys(one.networks):
        if reason := _wrong_endpoint(network):
            yield problem(reason, "every endpoint of a service with --credentials is tls/HOST:PORT")
    routers = [member for member in one.credentials.roster.admitted if member.role == "router"]
    if not routers and any(network.role == "client" for network in one.networks):
        yield problem(
            f"roster {one.credentials.roster.serial} has no router: a client believes nobody else",
            "crcolony authority invite AUTHORITY router NAME, and enroll it where the router runs",
        )


def _wrong_endpoint(network: NetworkSettings) -> str:
    try:
        check_endpoints(network)
    except NetworkError as error:
        return str(error)
    return ""


def _of_service(
    service: InstalledService, member: Member, robot: bytes | None
) -> Iterator[Finding]:
    """Yield what a service does to which its member is not entitled."""
    remedy = f"enroll it for that, into a folder of its own: --credentials of {service.instance}"
    roles = _ROLES.get(service.kind)
    if roles is not None and member.role not in roles:
        yield problem(
            f"{service.instance} has the certificate of {member.common_name}; it needs that of"
            f" {' or '.join(roles)}",
            remedy,
        )
    if member.role == "router":  # which is believed whatever it passes on
        return
    if service.kind in ("arena", "bridge") and service.name not in member.arenas:
        yield problem(
            f"{member.common_name} does not carry arena {service.name}: nobody hears it", remedy
        )
    if service.kind == "robot" and robot is not None and robot not in member.robots:
        yield problem(
            f"{member.common_name} does not speak for robot {service.name} ({robot.hex()[:8]}):"
            " nobody hears it",
            remedy,
        )
