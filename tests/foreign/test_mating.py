"""Two foreign robots mate by their state machine, over a network that loses, repeats and mixes, and through crashes."""

import random
from pathlib import Path

import pytest
from nacl.signing import SigningKey

from tests.foreign.identity import id_of, open_envelope
from tests.foreign.mating import Contact, Mating
from tests.foreign.messages import ENVELOPE_BYTES, MATING, decode, packed
from tests.foreign.records import Record, Records

SCHEMA = b"s" * 16
KEYS = sorted(
    (SigningKey(bytes([number]) * 32) for number in range(2)),
    key=lambda key: id_of(bytes(key.verify_key)),
)


class Side:
    """One of the two robots, with its disk."""

    def __init__(self, number: int, folder: Path) -> None:
        self.number, self.name = number, f"agent {number}"
        self.genes = packed((float(number),))
        self.sent: list[bytes] = []
        self.conceived: list[Record] = []
        self._path = folder / f"{number}.sqlite"
        self.start(0.0)

    def start(self, now_s: float) -> None:
        self.records = Records(self._path)
        self.mating = Mating(
            KEYS[self.number],
            "colony",
            self.records.next_incarnation(),
            SCHEMA,
            self.records,
            self,
            lambda _to, envelope: self.sent.append(envelope),
            now_s,
        )

    def meet(self, other: "Side", nonce: int, now_s: float) -> None:
        self.mating.contact(other.mating.id, Contact(nonce, 1, self.name, self.genes), now_s)

    def are_genes(self, genes: bytes) -> bool:
        return len(genes) == 8

    def conceives(self, record: Record, records: Records) -> bool:
        self.conceived.append(record)
        return True

    def outcome(self, outcome: str, record: Record, reason: str = "") -> None:
        pass

    def exchanged(self, record: Record) -> None:
        pass


def deliver(sides: list[Side], now_s: float) -> None:
    """All that was sent arrives, and what that causes, until there is silence."""
    while any(side.sent for side in sides):
        for side, other in (sides, reversed(sides)):
            waiting, side.sent = side.sent, []
            for envelope in waiting:
                other.mating.receive(envelope, now_s)


def mated(side: Side) -> set[tuple[bytes, bytes, int, int]]:
    assert not side.records.open(), "an encounter is open"
    return {record.encounter for record in side.records.matings()}


@pytest.fixture
def sides(tmp_path: Path) -> list[Side]:
    return [Side(number, tmp_path) for number in range(2)]


def test_two_robots_that_meet_mate_once(sides: list[Side]) -> None:
    """Each has the genes that the other signed, and the smaller id has proposed."""
    for side, other in (sides, reversed(sides)):
        side.meet(other, 7, 0.0)
    deliver(sides, 0.0)
    (encounter,) = mated(sides[0])
    assert mated(sides[1]) == {encounter}
    assert encounter[0] == sides[0].mating.id
    for side, other in (sides, reversed(sides)):
        (record,) = side.records.matings()
        assert (record.partner_agent, record.partner_genes) == (other.name, other.genes)


def test_the_other_robot_proposes_after_half_a_second(sides: list[Side]) -> None:
    """It does not know why it has no proposal; if both propose, the one with the smaller id wins."""
    small, large = sides
    large.meet(small, 7, 0.0)
    large.mating.pass_time(0.4)
    assert not large.sent
    large.mating.pass_time(0.6)
    assert len(large.sent) == 1
    small.meet(large, 7, 0.6)
    deliver(sides, 0.6)
    (encounter,) = mated(large)
    assert encounter[0] == small.mating.id


@pytest.mark.parametrize("seed", range(60))
def test_both_mate_or_neither_does_whatever_happens_on_the_way(
    sides: list[Side], seed: int
) -> None:
    """Loss, repetition, mixing and crashes; once both are back and all arrives, nothing is open."""
    luck = random.Random(seed)
    now_s = 0.0
    old: list[list[bytes]] = [[], []]
    for step in range(120):
        now_s += 0.1 if luck.random() < 0.98 else 61.0
        if step % 15 == 0:
            for side, other in (sides, reversed(sides)):
                if luck.random() < 0.9:
                    side.meet(other, step, now_s)
        for place, side in enumerate(sides):
            old[place] += side.sent
            side.sent = []
            luck.shuffle(old[place])
            for envelope in old[place][: luck.randrange(3)]:
                sides[1 - place].mating.receive(envelope, now_s)
            side.mating.pass_time(now_s)
            if luck.random() < 0.02:
                side.records.close()
                side.start(now_s)
    for _ in range(200):
        now_s += 0.2
        for side in sides:
            side.mating.pass_time(now_s)
        deliver(sides, now_s)
    assert mated(sides[0]) == mated(sides[1])
    nonces = [{r.encounter: r.nonce for r in side.records.matings()} for side in sides]
    assert nonces[0] == nonces[1], "they have mated without a contact that both had"
    for side in sides:
        decided = [record.encounter for record in side.conceived]
        assert len(decided) == len(set(decided)), "it has decided twice about one encounter"
        assert len(mated(side)) <= 8, "one contact has led to two matings"


def test_an_old_proposal_is_stale_even_if_the_contact_is_reported_again(sides: list[Side]) -> None:
    """A body that repeats itself, and a network that does, make no second mating."""
    small, large = sides
    for side, other in (sides, reversed(sides)):
        side.meet(other, 7, 0.0)
    (proposal,) = small.sent
    deliver(sides, 0.0)
    large.meet(small, 7, 0.1)
    large.mating.receive(proposal, 0.1)
    (answer,) = large.sent
    assert decode(open_envelope(answer).content, ENVELOPE_BYTES, *MATING)[::2] == [
        "refuse",
        "stale",
    ]
    assert len(mated(large)) == 1


def test_what_is_forged_or_changed_is_refused(sides: list[Side]) -> None:
    """A bit of a proposal is another one, and no bit of it may be."""
    small, large = sides
    for side, other in (sides, reversed(sides)):
        side.meet(other, 7, 0.0)
    (proposal,) = small.sent
    luck = random.Random(1)
    for attempt in range(200):
        place = luck.randrange(len(proposal))
        changed = bytes([proposal[place] ^ (1 << luck.randrange(8))])
        large.mating.receive(
            proposal[:place] + changed + proposal[place + 1 :], 0.1 * attempt / 200
        )
    assert not large.records.open()
    assert not large.sent
    assert large.mating.refused > 0
