"""Invitations to a deployment: a PIN admits one member, once, for some minutes, and after few wrong attempts no more.

Only a slow hash of a PIN is kept, so that it is shown once.
"""

import hashlib
import secrets
from pathlib import Path

import msgspec

from crcolony.durable_files import replace_file
from crcolony.errors import CrcolonyError
from crcolony.protocol.roster import MemberName, Role

INVITATIONS_FILE = "invitations.json"
MAX_ATTEMPTS = 5
"""Wrong PINs after which an invitation is void: of 10^8, each guesses one."""
PIN_DIGITS = 8
FINGERPRINT_DIGITS = 16
_MAX_INVITATIONS = 1000


class InvitationError(CrcolonyError):
    """There is no such invitation, or not any more."""


class Invitation(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """That a member may enroll until a time, with the PIN of this hash."""

    role: Role
    name: MemberName
    salt: str
    pin_hash: str
    expires_unix_s: float
    attempts_left: int = MAX_ATTEMPTS

    @property
    def common_name(self) -> str:
        """The member that is invited."""
        return f"{self.role}.{self.name}"


class InvitationBook:
    """The open invitations of an authority, in a file of its folder that only one process uses at a time."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / INVITATIONS_FILE

    def invite(self, role: Role, name: MemberName, now_unix_s: float, valid_s: float) -> str:
        """Return a new PIN for a member; an earlier invitation of the same is void. Raises InvitationError."""
        pin = f"{secrets.randbelow(10**PIN_DIGITS):0{PIN_DIGITS}d}"
        salt = secrets.token_hex(16)
        new = Invitation(role, name, salt, _hash(pin, salt), now_unix_s + valid_s)
        others = [one for one in self._open(now_unix_s) if one.common_name != new.common_name]
        if len(others) >= _MAX_INVITATIONS:
            raise InvitationError(f"{len(others)} invitations are open already")
        self._write([*others, new])
        return pin

    def use(self, role: str, name: str, pin: str, now_unix_s: float) -> None:
        """Use up the invitation of a member; raises InvitationError, and counts the attempt, if the PIN is wrong."""
        invitations = self._open(now_unix_s)
        found = [one for one in invitations if one.common_name == f"{role}.{name}"]
        if not found:
            raise InvitationError(f"{role}.{name}: no open invitation")
        (invitation,) = found
        others = [one for one in invitations if one is not invitation]
        if secrets.compare_digest(_hash(pin, invitation.salt), invitation.pin_hash):
            self._write(others)
            return
        left = invitation.attempts_left - 1
        rest = [msgspec.structs.replace(invitation, attempts_left=left)] if left else []
        self._write([*others, *rest])
        raise InvitationError(f"{role}.{name}: wrong PIN; {left} attempts are left")

    def _open(self, now_unix_s: float) -> list[Invitation]:
        try:
            stored = msgspec.json.decode(self._path.read_bytes(), type=list[Invitation])
        except FileNotFoundError:
            return []
        except (OSError, msgspec.DecodeError) as error:
            raise InvitationError(f"{self._path}: {error}") from None
        return [one for one in stored if one.expires_unix_s > now_unix_s]

    def _write(self, invitations: list[Invitation]) -> None:
        data = msgspec.json.format(msgspec.json.encode(invitations)) + b"\n"
        replace_file(self._path, lambda file: file.write(data))
        self._path.chmod(0o600)


def fingerprint_of(authority_key: bytes) -> str:
    """Return what identifies an authority in an invitation: 64 bits of a hash of its public key, as hex."""
    person = b"crcolony authori"
    digest = hashlib.blake2b(authority_key, digest_size=FINGERPRINT_DIGITS // 2, person=person)
    return digest.hexdigest()


def split_invitation(text: str) -> tuple[str, str]:
    """Return PIN and fingerprint of an invitation as it is typed; raises InvitationError."""
    pin, dash, fingerprint = text.strip().lower().partition("-")
    is_pin = len(pin) == PIN_DIGITS and pin.isascii() and pin.isdigit()
    is_fingerprint = len(fingerprint) == FINGERPRINT_DIGITS and not set(fingerprint) - set(
        "0123456789abcdef"
    )
    if not (dash and is_pin and is_fingerprint):
        raise InvitationError(
            f"an invitation is {PIN_DIGITS} digits, a dash, and {FINGERPRINT_DIGITS} hex digits"
        )
    return pin, fingerprint


def _hash(pin: str, salt: str) -> str:
    return hashlib.scrypt(pin.encode(), salt=bytes.fromhex(salt), n=2**14, r=8, p=1).hex()
