"""One record of the audit log: who did what and when, signed, and chained to the record before it."""

import hashlib
from collections.abc import Mapping
from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.protocol.identity import Identity, is_signed, robot_id

MAX_CHARACTERS = 500
"""Of a text in a record; a longer one is cut."""
_PURPOSE = b"crcolony audit\n"
"""Before what is signed: the same key signs other things too."""


class AuditRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One line of the log."""

    seq: Annotated[int, Meta(ge=1)]
    """1, 2, 3, … without gaps, through all files of a log"""
    time: str
    """RFC 3339, UTC"""
    who: str
    """user@host, as the system has them"""
    action: str
    """Such as `stop`"""
    details: dict[str, str]
    previous: str
    """Digest of the line before, as hex; empty in the first record"""
    key: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    """The public key of who signed"""
    signature: Annotated[str, Meta(pattern="^([0-9a-f]{128})?$")] = ""

    @property
    def signer(self) -> str:
        """The id of the key, as `crcolony keygen` prints it."""
        return robot_id(bytes.fromhex(self.key)).hex()

    @property
    def is_signed(self) -> bool:
        """Whether the owner of the key has signed it."""
        signed, key = bytes.fromhex(self.signature), bytes.fromhex(self.key)
        return is_signed(_signed_content(self), signed, key)


def make_record(
    identity: Identity,
    seq: int,
    time: str,
    who: str,
    action: str,
    details: Mapping[str, str],
    previous: str,
) -> AuditRecord:
    """Return a signed record."""
    short = {name: text[:MAX_CHARACTERS] for name, text in details.items()}
    record = AuditRecord(seq, time, who, action, short, previous, identity.public_key.hex())
    signature = identity.sign(_signed_content(record)).hex()
    return msgspec.structs.replace(record, signature=signature)


def encode_record(record: AuditRecord) -> bytes:
    """Return the one form of a record as a line, without its end."""
    return msgspec.json.encode(record, order="deterministic")


def decode_record(line: bytes) -> AuditRecord | None:
    """Return the record that a line is, None if it is none, or not in its one form."""
    try:
        record = msgspec.json.decode(line, type=AuditRecord)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None
    return record if encode_record(record) == line else None


def digest_of_line(line: bytes) -> str:
    """Return the digest by which the next record refers to a line."""
    return hashlib.blake2b(line, digest_size=32).hexdigest()


def _signed_content(record: AuditRecord) -> bytes:
    return _PURPOSE + encode_record(msgspec.structs.replace(record, signature=""))
