"""A request proves the keys of everybody for whom the member is to speak, and fits its role."""

import msgspec
import pytest
from crcolony_deploy.certificates import new_key, request_certificate
from crcolony_deploy.membership_request import (
    MembershipRequest,
    RequestError,
    check_request,
    conflicts,
    decode_grant,
    decode_request,
    proof_of,
)

from crcolony.protocol.identity import Identity
from crcolony.protocol.roster import Member, Role

ROBOTS = [Identity(bytes([number]) * 32) for number in range(3)]


def request(
    role: Role, name: str, *robots: Identity, arenas: tuple[str, ...] = ()
) -> MembershipRequest:
    signing_request = request_certificate(new_key(), f"{role}.{name}").decode()
    proofs = tuple(proof_of(robot, signing_request) for robot in robots)
    return MembershipRequest(role, name, signing_request, proofs, arenas)


@pytest.mark.parametrize(
    "asked",
    [
        request("robot", "kitchen", ROBOTS[0]),
        request("host", "big", *ROBOTS, arenas=("floor",)),
        request("arena", "main", arenas=("arena", "other")),
        request("bridge", "desk", arenas=("desk",)),
        request("router", "north"),
        request("observer", "wall"),
        request("operator", "me"),
    ],
    ids=lambda asked: asked.role,
)
def test_a_request_that_fits_its_role_becomes_an_entry_of_the_roster(
    asked: MembershipRequest,
) -> None:
    """Also after it has travelled."""
    check_request(asked)
    again = decode_request(msgspec.json.encode(asked))
    assert again == asked
    assert again.member == Member(
        asked.role, asked.name, tuple(one.id for one in ROBOTS[: len(asked.robots)]), asked.arenas
    )


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        (request("robot", "kitchen"), "a robot has one key, not 0"),
        (request("robot", "kitchen", *ROBOTS), "a robot has one key, not 3"),
        (request("router", "north", ROBOTS[0]), "speaks for no robot"),
        (request("host", "big", ROBOTS[0], ROBOTS[0], arenas=("a",)), "stands twice"),
        (request("host", "big", ROBOTS[0]), "an arena is named by"),
        (request("observer", "wall", arenas=("a",)), "an arena is named by"),
    ],
    ids=["no key", "many keys", "a router's robot", "twice", "no arena", "an observer's arena"],
)
def test_a_request_that_does_not_fit_its_role_is_refused(
    asked: MembershipRequest, reason: str
) -> None:
    """With what is wrong."""
    with pytest.raises(RequestError, match=reason):
        check_request(asked)


def test_nobody_is_enrolled_as_the_robot_of_somebody_else() -> None:
    """A proof is for one request: it cannot be taken from another one."""
    genuine = request("robot", "kitchen", ROBOTS[0])
    stolen = msgspec.structs.replace(request("robot", "thief", ROBOTS[1]), robots=genuine.robots)
    with pytest.raises(
        RequestError, match=f"robot {ROBOTS[0].id.hex()}: the request is not signed"
    ):
        check_request(stolen)


def test_a_robot_belongs_to_one_member() -> None:
    """Another one that speaks for it is named; itself it does not disturb."""
    kitchen = Member("robot", "kitchen", (ROBOTS[0].id,))
    thief = Member("robot", "thief", (ROBOTS[0].id,))
    assert conflicts(kitchen, [kitchen]) == ""
    assert conflicts(thief, [kitchen]).endswith("belongs to robot.kitchen")


@pytest.mark.parametrize("noise", [b"", b"{}", b"[1]", b"\xff", b"x" * 2_000_000])
def test_noise_is_no_request_and_no_grant(noise: bytes) -> None:
    """One line says so."""
    with pytest.raises(RequestError):
        decode_request(noise)
    with pytest.raises(RequestError):
        decode_grant(noise)
