"""A roster is believed for the signature of its authority alone, and says who belongs to a deployment."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import Identity
from crcolony.protocol.roster import Member, Roster, SignedRoster, open_roster, sign_roster

AUTHORITY = Identity(bytes(32))
OTHER = Identity(bytes([1]) * 32)
ROBOTS = [bytes([number]) * 16 for number in range(4)]
ROSTER = Roster(
    "lab",
    7,
    (
        Member("robot", "kitchen", (ROBOTS[0],)),
        Member("robot", "hall", (ROBOTS[1],), is_revoked=True),
        Member("host", "big", (ROBOTS[2], ROBOTS[3]), ("floor",)),
        Member("router", "north"),
    ),
)


def test_a_signed_roster_is_read_as_it_was_written() -> None:
    """With every member, and those that are revoked."""
    roster = open_roster(sign_roster(ROSTER, AUTHORITY), AUTHORITY.public_key)
    assert roster == ROSTER
    assert [member.common_name for member in roster.admitted] == [
        "robot.kitchen",
        "host.big",
        "router.north",
    ]
    assert roster.revoked_robots == {ROBOTS[1]}
    assert roster.find("host.big") == ROSTER.members[2]
    assert roster.find("robot.big") is None


def test_a_roster_of_another_authority_is_refused() -> None:
    """Also if it contains the signature of the right one for something else."""
    with pytest.raises(WireError, match="not signed by the authority"):
        open_roster(sign_roster(ROSTER, OTHER), AUTHORITY.public_key)
    content = encode(ROSTER)
    unbound = encode(SignedRoster(content, AUTHORITY.sign(content)))
    with pytest.raises(WireError, match="not signed by the authority"):
        open_roster(unbound, AUTHORITY.public_key)


@given(st.data())
def test_a_roster_that_was_changed_is_refused(data: st.DataObject) -> None:
    """Whatever bit of it."""
    signed = bytearray(sign_roster(ROSTER, AUTHORITY))
    bit = data.draw(st.integers(0, 8 * len(signed) - 1))
    signed[bit // 8] ^= 1 << bit % 8
    with pytest.raises(WireError):
        open_roster(bytes(signed), AUTHORITY.public_key)


@pytest.mark.parametrize(
    "roster",
    [
        Roster("lab", 0, ()),
        Roster("no name", 1, ()),
        Roster("lab", 1, (Member("robot", "a/b", (ROBOTS[0],)),)),
        Roster("lab", 1, (Member("robot", "x" * 49),)),
        Roster("lab", 1, (Member("robot", "short", (b"id",)),)),
        Roster("lab", 1, (Member("king", "x"),)),  # type: ignore[arg-type]
    ],
    ids=["serial", "colony", "slash", "long", "id", "role"],
)
def test_names_and_numbers_are_within_limits(roster: Roster) -> None:
    """A common name is a part of a configuration, and an id a part of a key expression."""
    with pytest.raises(WireError):
        open_roster(sign_roster(roster, AUTHORITY), AUTHORITY.public_key)
