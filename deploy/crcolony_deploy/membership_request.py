"""What a member asks of its authority, and what it gets: the two documents that enrollment exchanges, as JSON.

A request proves both of the member's keys: that of the certificate signs the signing request, and every robot for which
the member is to speak signs a hash of it. So nobody is enrolled as somebody else's robot.
"""

import hashlib
from collections.abc import Sequence
from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.errors import CrcolonyError
from crcolony.protocol.codec import Name
from crcolony.protocol.identity import (
    KEY_BYTES,
    SIGNATURE_BYTES,
    Identity,
    RobotId,
    is_signed,
    robot_id,
)
from crcolony.protocol.roster import Member, MemberName, Role
from crcolony.transport.credentials import MemberRecord

MAX_REQUEST_BYTES = 1_048_576
"""Room for a host with some thousands of robots."""

_CARRIES_BODIES = ("arena", "bridge", "host")


class RequestError(CrcolonyError):
    """A request cannot be granted; the message says why."""


class RobotProof(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """That the member has the secret key of a robot."""

    public_key: Annotated[bytes, Meta(min_length=KEY_BYTES, max_length=KEY_BYTES)]
    signature: Annotated[bytes, Meta(min_length=SIGNATURE_BYTES, max_length=SIGNATURE_BYTES)]


class MembershipRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A member asks to be admitted, or for its next certificate."""

    role: Role
    name: MemberName
    signing_request: Annotated[str, Meta(max_length=8192)]
    """PKCS #10, as PEM"""
    robots: tuple[RobotProof, ...] = ()
    arenas: tuple[Name, ...] = ()

    @property
    def member(self) -> Member:
        """The entry in the roster that is asked for."""
        robots = tuple(robot_id(proof.public_key) for proof in self.robots)
        return Member(self.role, self.name, robots, self.arenas)


class Grant(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What an authority gives to a member: all that its credentials consist of but the secret key."""

    record: MemberRecord
    certificate: str
    authority: str
    """The authority's certificate, as PEM"""
    roster: bytes


def proof_of(robot: Identity, signing_request: str) -> RobotProof:
    """Return a robot's proof for this request."""
    return RobotProof(robot.public_key, robot.sign(_proven(signing_request)))


def check_request(request: MembershipRequest) -> None:
    """Raise RequestError unless what is asked for fits the role, and every robot is proven."""
    count = len(request.robots)
    if request.role == "robot" and count != 1:
        raise RequestError(f"a robot has one key, not {count}")
    if request.role not in ("robot", "host") and count:
        raise RequestError(f"the role {request.role} speaks for no robot")
    if bool(request.arenas) != (request.role in _CARRIES_BODIES):
        raise RequestError(
            f"the role {request.role}: an arena is named by {_list(_CARRIES_BODIES)}"
        )
    if len(set(request.member.robots)) != count:
        raise RequestError("one robot stands twice in the request")
    for proof in request.robots:
        if not is_signed(_proven(request.signing_request), proof.signature, proof.public_key):
            robot = robot_id(proof.public_key).hex()
            raise RequestError(f"robot {robot}: the request is not signed by its key")


def conflicts(member: Member, others: Sequence[Member]) -> str:
    """Return why a member cannot be admitted beside others; empty if it can."""
    for other in others:
        if other.common_name == member.common_name:
            continue
        both: set[RobotId] = set(other.robots) & set(member.robots)
        if both:
            return f"robot {min(both).hex()} belongs to {other.common_name}"
    return ""


def decode_request(data: bytes) -> MembershipRequest:
    """Return a request; raises RequestError if it is malformed."""
    if len(data) > MAX_REQUEST_BYTES:
        raise RequestError(f"{len(data)} bytes, at most {MAX_REQUEST_BYTES} are allowed")
    try:
        return msgspec.json.decode(data, type=MembershipRequest)
    except msgspec.DecodeError as error:
        raise RequestError(f"not a request: {error}") from None


def decode_grant(data: bytes) -> Grant:
    """Return a grant; raises RequestError if it is malformed."""
    try:
        return msgspec.json.decode(data, type=Grant)
    except msgspec.DecodeError as error:
        raise RequestError(f"not a grant: {error}") from None


def _proven(signing_request: str) -> bytes:
    return b"crcolony membership\n" + hashlib.sha256(signing_request.encode()).digest()


def _list(words: Sequence[str]) -> str:
    return f"{', '.join(words[:-1])} and {words[-1]}"
