"""Members pass on the newest roster: whoever was cut off has it soon after, and nobody believes another one."""

import random

import pytest

from crcolony.protocol.codec import encode
from crcolony.protocol.identity import Identity
from crcolony.protocol.roster import Roster, sign_roster
from crcolony.protocol.roster_gossip import Announce, Publish, Request, RosterGossip, RosterSerial

NOW_S = 1000.0
AUTHORITY, OTHER = Identity(bytes(32)), Identity(bytes([1]) * 32)


def signed(serial: int, colony: str = "lab", by: Identity = AUTHORITY) -> bytes:
    return sign_roster(Roster(colony, serial, ()), by)


def member(serial: int, seed: int = 0) -> RosterGossip:
    chance = random.Random(seed).random
    roster = Roster("lab", serial, ())
    return RosterGossip(sign_roster(roster, AUTHORITY), roster, AUTHORITY.public_key, chance)


class Network:
    """Members that are connected to each other; every message arrives at once."""

    def __init__(self, *serials: int) -> None:
        self.members = [member(serial, seed) for seed, serial in enumerate(serials)]
        self.now_s = NOW_S
        self.published = 0

    def connect(self) -> None:
        for one in self.members:
            one.handle_link(self.now_s)

    def run(self, seconds: float) -> None:
        end_s = self.now_s + seconds
        while self.now_s < end_s:
            self.now_s += 0.01
            for sender in self.members:
                for action in sender.due_actions(self.now_s):
                    self._carry_out(sender, action)

    def _carry_out(self, sender: RosterGossip, action: Announce | Publish | Request) -> None:
        self.published += isinstance(action, Publish)
        for other in self.members:
            if other is sender:
                continue
            match action:
                case Announce(message):
                    other.handle_announcement(self.now_s, message)
                case Publish(roster):
                    other.handle_roster(self.now_s, roster)
                case Request(message):
                    reply = other.answer(message)
                    if reply is not None:
                        sender.handle_roster(self.now_s, reply)

    @property
    def serials(self) -> list[int]:
        return [one.roster.serial for one in self.members]


@pytest.mark.parametrize(
    "serials", [(1, 2), (2, 1), (1, 1, 1, 5), (5, 1, 1, 1), (3, 1, 2), (4, *[1] * 30)]
)
def test_all_have_the_newest_roster_within_half_a_second_of_a_connection(
    serials: tuple[int, ...],
) -> None:
    """Whoever has it, and without everybody publishing it."""
    network = Network(*serials)
    network.connect()
    network.run(0.5)
    assert set(network.serials) == {max(serials)}
    assert network.published <= 3


def test_a_member_that_all_agree_with_costs_one_announcement() -> None:
    """Nothing is published, and links that come together are one event."""
    network = Network(7, 7, 7)
    for _ in range(20):
        network.connect()
    network.run(3.0)
    assert network.published == 0
    assert all(one.is_agreed for one in network.members)


@pytest.mark.parametrize(
    "roster",
    [signed(9, by=OTHER), signed(9, colony="other"), signed(3), signed(2), b"", b"noise"],
    ids=["forged", "of another colony", "the same", "older", "empty", "noise"],
)
def test_only_a_newer_roster_of_the_own_authority_is_adopted(roster: bytes) -> None:
    """The rest is ignored."""
    one = member(3)
    assert not one.handle_roster(NOW_S, roster)
    assert one.roster.serial == 3
    assert one.handle_roster(NOW_S, signed(4))
    assert one.roster.serial == 4


def test_a_flood_of_rosters_costs_few_signatures() -> None:
    """Two hundred are verified in a second; a genuine one that comes later is adopted."""
    one = member(1)
    flood = [signed(100 + number, by=OTHER) for number in range(400)]
    assert not any(one.handle_roster(NOW_S, roster) for roster in flood)
    assert not one.handle_roster(NOW_S, signed(2))
    assert one.handle_roster(NOW_S + 1.0, signed(2))


def test_an_announcement_that_is_none_is_ignored() -> None:
    """And so is a request."""
    one = member(3)
    for noise in (b"", b"noise", encode(RosterSerial(3)) + b"x"):
        one.handle_announcement(NOW_S, noise)
        assert one.answer(noise) is None
    assert one.due_actions(NOW_S + 10.0) == []
    assert one.answer(encode(RosterSerial(2))) == one.signed
    assert one.answer(encode(RosterSerial(3))) is None
