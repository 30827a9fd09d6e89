"""The roster of a deployment: who belongs to it and who is revoked, signed by its authority (PROTOCOL.md, "Roster").

A robot of a deployment proves by a certificate who it is; the roster says what that entitles it to. Anybody may pass a
roster on: it is believed for its signature, and of two the one with the larger serial number counts.
"""

from collections.abc import Iterator
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from crcolony.protocol.codec import VERSION, Id, Name, StrictDecoder, WireError, encode
from crcolony.protocol.identity import Identity, RobotId, is_signed
from crcolony.protocol.signed_envelope import Signature

MAX_ROSTER_BYTES = 262_144
"""Some thousands of members."""
_MAX_ITEMS = 8192

Role = Literal["robot", "host", "arena", "bridge", "router", "observer", "operator"]
"""What a member does: a host runs an arena and robots in one process, an operator may stop bodies."""

MemberName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_-]{1,48}\Z")]
"""Shorter than other names: with its role it is the common name of a certificate, which has at most 64 letters."""

Serial = Annotated[int, Meta(ge=1, lt=2**53)]


class Member(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One process of a deployment with a certificate of its own."""

    role: Role
    name: MemberName
    robots: tuple[Id, ...] = ()
    """The robots for which it speaks: one for a robot, many for a host, none for others"""
    arenas: tuple[Name, ...] = ()
    """The arenas whose bodies it carries: of an arena, a bridge or a host"""
    is_revoked: bool = False

    @property
    def common_name(self) -> str:
        """The subject of its certificates."""
        return f"{self.role}.{self.name}"


class Roster(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """The members of a colony's deployment. `serial` grows by one with every change."""

    colony: Name
    serial: Serial
    members: tuple[Member, ...]

    @property
    def admitted(self) -> Iterator[Member]:
        """The members that are not revoked."""
        return (member for member in self.members if not member.is_revoked)

    @property
    def revoked_robots(self) -> frozenset[RobotId]:
        """The robots with which nobody mates any more."""
        return frozenset(
            robot for member in self.members if member.is_revoked for robot in member.robots
        )

    def find(self, common_name: str) -> Member | None:
        """Return the member with this common name, None if there is none."""
        return next((one for one in self.members if one.common_name == common_name), None)


class SignedRoster(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """An encoded roster with the signature of the authority."""

    content: Annotated[bytes, Meta(max_length=MAX_ROSTER_BYTES)]
    signature: Signature


def sign_roster(roster: Roster, authority: Identity) -> bytes:
    """Return the encoded roster, signed by the authority."""
    content = encode(roster)
    return encode(SignedRoster(content, authority.sign(_signed(content))))


def open_roster(data: bytes, authority_key: bytes) -> Roster:
    """Return a roster; raise WireError if it is malformed, or not signed by the owner of the authority's public key."""
    signed = decode_signed_roster(data)
    if not is_signed(_signed(signed.content), signed.signature, authority_key):
        raise WireError("not signed by the authority of this deployment")
    return _decode_roster(signed.content)


def _signed(content: bytes) -> bytes:
    return b"crcolony roster %d\n" % VERSION + content


decode_signed_roster = StrictDecoder[SignedRoster](SignedRoster, MAX_ROSTER_BYTES + 128).decode
_decode_roster = StrictDecoder[Roster](Roster, MAX_ROSTER_BYTES, _MAX_ITEMS).decode
