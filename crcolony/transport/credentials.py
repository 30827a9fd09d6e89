"""The credentials of one member of a deployment: its certificate, its key, and the roster, in a folder of their own.

`crcolony authority` and `crcolony enroll` write the folder. Who may publish what is generated from the roster
(`access_control.py`), never written by hand.
"""

import contextlib
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from crcolony.durable_files import replace_file
from crcolony.protocol.codec import Name, WireError
from crcolony.protocol.identity import KEY_BYTES, keeps_modes
from crcolony.protocol.roster import MAX_ROSTER_BYTES, Member, MemberName, Role, Roster, open_roster
from crcolony.transport.access_control import access_control
from crcolony.transport.interface import NetworkError

IDENTITY_FILE = "identity.pem"
"""Secret key and certificate, in one file: a renewal replaces both at once. The key never leaves the host."""
AUTHORITY_FILE = "authority.pem"
"""Certificate of the authority, against which peers are verified."""
ROSTER_FILE = "roster"
MEMBER_FILE = "member.json"
_FILES = (IDENTITY_FILE, AUTHORITY_FILE, ROSTER_FILE, MEMBER_FILE)


class MemberRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Whose credentials they are, and which authority signs the rosters of the deployment."""

    colony: Name
    role: Role
    name: MemberName
    authority_key: str
    """Ed25519 public key, as hex"""

    @property
    def common_name(self) -> str:
        """The subject of the certificate."""
        return f"{self.role}.{self.name}"

    @property
    def key_bytes(self) -> bytes:
        """The authority's public key; raises ValueError if it is none."""
        key = bytes.fromhex(self.authority_key)
        if len(key) != KEY_BYTES:
            raise ValueError(f"a public key has {KEY_BYTES} bytes")
        return key


@dataclass(frozen=True)
class Credentials:
    """Credentials as they were read from their folder."""

    folder: Path
    record: MemberRecord
    roster: Roster
    signed_roster: bytes

    @property
    def member(self) -> Member | None:
        """The entry of this member in the roster; None if it has none."""
        return self.roster.find(self.record.common_name)

    def tls(self) -> dict[str, Any]:
        """Return the section `tls` of a link in Zenoh's configuration: both ends show a certificate.

        Names of hosts are not verified: what counts is the member's name in the certificate, to which access control
        gives its rights, so that a robot may change its address.
        """
        identity = str(self.folder / IDENTITY_FILE)
        return {
            "root_ca_certificate": str(self.folder / AUTHORITY_FILE),
            "listen_private_key": identity,
            "listen_certificate": identity,
            "connect_private_key": identity,
            "connect_certificate": identity,
            "enable_mtls": True,
            "verify_name_on_connect": False,
            "close_link_on_expiration": True,
        }

    def access_control(self, *, is_client: bool) -> dict[str, Any]:
        """Return the section `access_control` of Zenoh's configuration."""
        return access_control(self.roster, trusts_only_routers=is_client)


def load_credentials(folder: Path) -> Credentials:
    """Read a folder of credentials; raises NetworkError that names the file and what is wrong with it."""
    try:
        for name in _FILES:
            if not (folder / name).is_file():
                raise NetworkError(
                    f"{folder / name}: missing; crcolony enroll writes a member's credentials"
                )
        mode = (folder / IDENTITY_FILE).stat().st_mode
    except OSError as error:  # a folder of another user
        raise NetworkError(f"{folder}: {error.strerror}") from None
    if mode & (stat.S_IRWXG | stat.S_IRWXO) and keeps_modes(folder):
        raise NetworkError(f"{folder / IDENTITY_FILE}: others may read this key; chmod 600 it")
    try:
        record = msgspec.json.decode((folder / MEMBER_FILE).read_bytes(), type=MemberRecord)
        key = record.key_bytes
    except OSError as error:
        raise NetworkError(f"{folder / MEMBER_FILE}: {error.strerror}") from None
    except (msgspec.DecodeError, ValueError) as error:
        raise NetworkError(f"{folder / MEMBER_FILE}: {error}") from None
    signed, roster = read_roster(folder / ROSTER_FILE, key)
    if roster.colony != record.colony:
        raise NetworkError(
            f"{folder / ROSTER_FILE}: of colony {roster.colony}, not {record.colony}"
        )
    return Credentials(folder, record, roster, signed)


def read_roster(path: Path, authority_key: bytes) -> tuple[bytes, Roster]:
    """Return a roster as it is signed, and its content; raises NetworkError."""
    try:
        with path.open("rb") as file:
            signed = file.read(2 * MAX_ROSTER_BYTES)
        return signed, open_roster(signed, authority_key)
    except OSError as error:
        raise NetworkError(f"{path}: {error.strerror}") from None
    except WireError as error:
        raise NetworkError(f"{path}: {error}") from None


def store_roster(folder: Path, signed: bytes) -> None:
    """Replace the roster in a folder of credentials, as a whole; a folder that cannot be written keeps the old one.

    Then the newest is learnt again from the others after the next start.
    """
    with contextlib.suppress(OSError):
        replace_file(folder / ROSTER_FILE, lambda file: file.write(signed))
