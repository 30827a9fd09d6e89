"""The authority of a deployment: it admits members, signs their short-lived certificates, and revokes them.

It is a folder of the operator, not a server of the colony: robots live, meet and mate without it. What it alone can do
is to admit somebody, to renew a certificate, and to sign the next roster.
"""

import contextlib
import datetime
import fcntl
import os
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import msgspec

from crcolony.durable_files import replace_file
from crcolony.errors import CrcolonyError
from crcolony.protocol.codec import Name, WireError
from crcolony.protocol.identity import Identity, create_key, load_key
from crcolony.protocol.roster import Member, Roster, open_roster, sign_roster
from crcolony.storage.files import make_folder
from crcolony.transport.credentials import MemberRecord
from crcolony_deploy.audit_log import AuditLog, record_action
from crcolony_deploy.certificates import authority_certificate, sign_request
from crcolony_deploy.membership_request import Grant, MembershipRequest, check_request, conflicts

KEY_FILE = "authority.key"
"""The secret key of the deployment: who has it can admit anybody."""
CERTIFICATE_FILE = "authority.pem"
ROSTER_FILE = "roster"
AUDIT_FILE = "audit.jsonl"
"""What was done with the authority, signed by its key (`crcolony audit`)."""
SETTINGS_FILE = "authority.json"

DEFAULT_LIFETIME_H = 24.0
MAX_LIFETIME_H = 24.0 * 90


class AuthorityError(CrcolonyError):
    """The authority cannot do what it is asked for; the message says why."""


class AuthoritySettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What was decided when an authority was made."""

    colony: Name
    lifetime_h: float = DEFAULT_LIFETIME_H
    """Of a member's certificate: the longest time for which a revoked member can still connect"""


def check_member_name(name: str) -> None:
    """Raise AuthorityError for a name that no member can have."""
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,48}", name):
        raise AuthorityError(f"{name!r}: a member's name has letters, digits, _ and -, at most 48")


def _now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC)


@dataclass
class Authority:
    """An authority, as it stands in its folder."""

    folder: Path
    settings: AuthoritySettings
    identity: Identity
    seed: bytes
    certificate: bytes
    roster: Roster
    now: Callable[[], datetime.datetime] = _now

    @classmethod
    def create(cls, folder: Path, settings: AuthoritySettings) -> Self:
        """Make an authority in a new or empty folder; raises AuthorityError, FolderError."""
        if not 0.0 < settings.lifetime_h <= MAX_LIFETIME_H:
            raise AuthorityError(
                f"{settings.lifetime_h:g} h: certificates are valid for at most {MAX_LIFETIME_H:g} h"
            )
        if folder.exists() and any(folder.iterdir()):
            raise AuthorityError(f"{folder}: not empty; an authority is never overwritten")
        make_folder(folder)
        folder.chmod(0o700)
        create_key(folder / KEY_FILE)
        seed = _read_seed(folder)
        certificate = authority_certificate(seed, settings.colony, _now())
        _write(folder / CERTIFICATE_FILE, certificate)
        _write(folder / SETTINGS_FILE, msgspec.json.format(msgspec.json.encode(settings)) + b"\n")
        roster = Roster(settings.colony, 1, ())
        _write(folder / ROSTER_FILE, sign_roster(roster, Identity(seed)))
        made = cls(folder, settings, Identity(seed), seed, certificate, roster)
        made.record("create", colony=settings.colony)
        return made

    @classmethod
    @contextlib.contextmanager
    def opened(cls, folder: Path) -> Iterator[Self]:
        """Have an authority inside the context, to which no other process changes anything; raises as `load`."""
        lock = _lock(folder)
        try:
            yield cls.load(folder)
        finally:
            os.close(lock)

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Read an authority; raises AuthorityError, IdentityError."""
        try:
            settings = msgspec.json.decode(
                (folder / SETTINGS_FILE).read_bytes(), type=AuthoritySettings
            )
            certificate = (folder / CERTIFICATE_FILE).read_bytes()
            signed = (folder / ROSTER_FILE).read_bytes()
        except OSError as error:
            raise AuthorityError(f"{error.filename}: {error.strerror}") from None
        except msgspec.DecodeError as error:
            raise AuthorityError(f"{folder / SETTINGS_FILE}: {error}") from None
        identity = load_key(folder / KEY_FILE)
        try:
            roster = open_roster(signed, identity.public_key)
        except WireError as error:
            raise AuthorityError(f"{folder / ROSTER_FILE}: {error}") from None
        return cls(folder, settings, identity, _read_seed(folder), certificate, roster)

    @property
    def signed_roster(self) -> bytes:
        """The roster as it is passed on."""
        return (self.folder / ROSTER_FILE).read_bytes()

    def admit(self, request: MembershipRequest) -> Grant:
        """Admit a member, or give it another certificate; raises RequestError, CertificateError, AuthorityError.

        The roster grows only if the member is new, or speaks for others than before.
        """
        check_request(request)
        member = request.member
        before = self.roster.find(member.common_name)
        if before is not None and before.is_revoked:
            raise AuthorityError(f"{member.common_name} is revoked; choose another name")
        if before is not None and before != member:
            raise AuthorityError(
                f"{member.common_name} is taken, by other robots or arenas; revoke it, or choose another name"
            )
        problem = conflicts(member, self.roster.members)
        if problem:
            raise AuthorityError(problem)
        lifetime = datetime.timedelta(hours=self.settings.lifetime_h)
        certificate = sign_request(
            request.signing_request.encode(),
            member.common_name,
            self.seed,
            self.certificate,
            lifetime,
            self.now(),
        )
        if before is None:
            self._replace_roster((*self.roster.members, member))
        action = "admit" if before is None else "renew"
        self.record(action, member=member.common_name, roster=self.roster.serial)
        record = MemberRecord(
            self.settings.colony, member.role, member.name, self.identity.public_key.hex()
        )
        return Grant(record, certificate.decode(), self.certificate.decode(), self.signed_roster)

    def revoke(self, common_name: str) -> Member:
        """Revoke a member for good and return it; raises AuthorityError if there is none of this name."""
        member = self.find(common_name)
        revoked = msgspec.structs.replace(member, is_revoked=True)
        if not member.is_revoked:
            self._replace(revoked)
            self.record("revoke", member=member.common_name, roster=self.roster.serial)
        return revoked

    def reinstate(self, common_name: str) -> Member:
        """Admit a revoked member again, with the robots it had; raises AuthorityError if there is none."""
        member = self.find(common_name)
        admitted = msgspec.structs.replace(member, is_revoked=False)
        if member.is_revoked:
            self._replace(admitted)
            self.record("reinstate", member=member.common_name, roster=self.roster.serial)
        return admitted

    def adopt(self, signed_roster: bytes) -> bool:
        """Go on from a roster of the colony if it is newer than the one here; return whether it is.

        So is it when the folder is an old copy: a roster with a smaller number would change nothing. Raises WireError.
        """
        roster = open_roster(signed_roster, self.identity.public_key)
        if roster.colony != self.roster.colony or roster.serial <= self.roster.serial:
            return False
        _write(self.folder / ROSTER_FILE, signed_roster)
        self.roster = roster
        self.record("adopt a roster of the colony", roster=roster.serial)
        return True

    def find(self, name: str) -> Member:
        """Return the member with a common name, or the only one with this name; raises AuthorityError."""
        found = [one for one in self.roster.members if name in (one.common_name, one.name)]
        if len(found) != 1:
            known = ", ".join(one.common_name for one in self.roster.members) or "nobody"
            raise AuthorityError(
                f"{name}: {'no such member' if not found else 'several'}; there is {known}"
            )
        return found[0]

    def record(self, action: str, **details: object) -> None:
        """Record what was done in the authority's audit log; raises AuditError."""
        record_action(AuditLog(self.folder / AUDIT_FILE, self.identity), action, **details)

    def _replace(self, member: Member) -> None:
        self._replace_roster(
            member if one.common_name == member.common_name else one for one in self.roster.members
        )

    def _replace_roster(self, members: Iterable[Member]) -> None:
        roster = Roster(self.roster.colony, self.roster.serial + 1, tuple(members))
        _write(self.folder / ROSTER_FILE, sign_roster(roster, self.identity))
        self.roster = roster


def _lock(folder: Path) -> int:
    """Return a descriptor that holds a lock until it is closed; waits for other processes. Raises AuthorityError."""
    try:
        lock = os.open(folder, os.O_RDONLY)
        fcntl.flock(lock, fcntl.LOCK_EX)
    except OSError as error:
        raise AuthorityError(f"{folder}: {error.strerror}") from None
    return lock


def _read_seed(folder: Path) -> bytes:
    return bytes.fromhex((folder / KEY_FILE).read_text("ascii"))


def _write(path: Path, data: bytes) -> None:
    replace_file(path, lambda file: file.write(data))
