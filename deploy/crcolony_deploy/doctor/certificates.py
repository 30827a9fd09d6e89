"""Whether certificates can be used: complete, for their keys, issued by the authority, and valid for long enough."""

import pwd
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from crcolony.transport.credentials import AUTHORITY_FILE, IDENTITY_FILE, Credentials
from crcolony.transport.network_settings import exposed_endpoints
from crcolony_deploy.doctor.finding import Finding, ok, problem, warning
from crcolony_deploy.doctor.host_state import USER, HostState

_HOUR_S = 3600.0


def check_certificates(host: HostState) -> Iterator[Finding]:
    """Read every folder of credentials that services of this host use, or the one who asks."""
    for service in host.services:
        if service.credentials is None and (exposed := list(exposed_endpoints(service.network))):
            yield warning(
                f"{service.instance} has no credentials: whoever reaches {exposed[0]} may steer every body",
                "docs/secure_a_colony.md: crcolony authority, crcolony enroll",
            )
    for one in host.credential_folders:
        if one.credentials is None:
            yield problem(one.problem, f"crcolony enroll ROLE NAME --out {one.folder} …")
            continue
        if one.services and not _may_be_read(one.folder / IDENTITY_FILE):
            yield problem(
                f"{one.folder}: user {USER} cannot read it", f"chown -R {USER}: {one.folder}"
            )
        if find_spec("cryptography") is None:
            yield warning(
                f"{one.folder}: its certificate cannot be examined without the package cryptography",
                "pip install 'crcolony[deploy]'",
            )
            continue
        yield from _examine(one.credentials, time.time())


def _examine(credentials: Credentials, now_unix_s: float) -> Iterator[Finding]:
    """Yield what is wrong with a certificate, or how long it is valid."""
    # Robots that have their certificates need no more than the core: cryptography may be missing.
    from crcolony_deploy.certificates import CertificateError

    try:
        if reason := _misfit(credentials):
            yield problem(reason, _enroll_again(credentials))
        else:
            yield _validity(credentials, now_unix_s)
    except CertificateError as error:
        path = credentials.folder / IDENTITY_FILE
        yield problem(f"{path}: {error}", _enroll_again(credentials))


def _misfit(credentials: Credentials) -> str:
    """Return which parts of the credentials do not belong together; empty if all do. Raises CertificateError."""
    from crcolony_deploy.certificates import (
        common_name_of,
        is_issued_by,
        public_half,
        public_key_of,
    )

    folder, record = credentials.folder, credentials.record
    identity = (folder / IDENTITY_FILE).read_bytes()
    authority = (folder / AUTHORITY_FILE).read_bytes()
    if public_half(identity) != public_key_of(identity):
        return f"{folder / IDENTITY_FILE}: the key is not that of the certificate"
    if not is_issued_by(identity, authority) or public_key_of(authority) != record.key_bytes:
        return f"{folder / IDENTITY_FILE}: not issued by the authority of this deployment"
    if common_name_of(identity) != record.common_name:
        name = common_name_of(identity)
        return f"{folder / IDENTITY_FILE}: is of {name}, not of {record.common_name}"
    return ""


def _validity(credentials: Credentials, now_unix_s: float) -> Finding:
    from crcolony_deploy.certificates import validity_of

    name = f"certificate of {credentials.record.common_name}"
    valid = validity_of((credentials.folder / IDENTITY_FILE).read_bytes())
    renewal = f"crcolony enroll --renew --out {credentials.folder}"
    if now_unix_s < valid.begins_unix_s:
        hours = (valid.begins_unix_s - now_unix_s) / _HOUR_S
        return problem(
            f"{name}: not valid before {hours:.1f} h from now: this clock is behind, or its authority's ahead",
            "timedatectl set-ntp true",
        )
    age_h = (now_unix_s - valid.begins_unix_s) / _HOUR_S
    left_s = valid.ends_unix_s - now_unix_s
    if left_s <= 0.0:
        return problem(
            f"{name}: expired {-left_s / _HOUR_S:.1f} h ago: nobody connects with it", renewal
        )
    text = f"{name}: began {age_h:.1f} h ago, ends in {left_s / _HOUR_S:.1f} h"
    if left_s < (valid.ends_unix_s - valid.begins_unix_s) / 3.0:
        return warning(f"{text}: the renewal timer does not run", renewal)
    due_s = valid.renewal_unix_s - now_unix_s
    due = f"in {due_s / _HOUR_S:.1f} h" if due_s > 0.0 else "now"
    return ok(f"{text}, is to be renewed {due}")


def _may_be_read(identity: Path) -> bool:
    """Return whether a file of mode 0600 is the services' own, where their user exists."""
    try:
        return identity.stat().st_uid == pwd.getpwnam(USER).pw_uid
    except KeyError:
        return True


def _enroll_again(credentials: Credentials) -> str:
    record = credentials.record
    return f"crcolony enroll {record.role} {record.name} --out {credentials.folder} …"
