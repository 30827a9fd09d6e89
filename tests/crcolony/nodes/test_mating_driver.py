"""Hostile letters are cheap: what nobody waits for is never verified, and what is verified is limited."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from crcolony.evolution.genotype import Gene, Schema
from crcolony.nodes import mating_driver
from crcolony.nodes.mating_driver import MatingDriver
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.encounters import EncounterRecord, MatingLimits, Offer, OutcomeReport
from crcolony.protocol.envelope import (
    SignedEnvelope,
    has_valid_signature,
    open_envelope,
    sign_message,
)
from crcolony.protocol.identity import AllowList, seeded
from crcolony.protocol.mating_messages import (
    Abort,
    Commit,
    Encounter,
    MatingMessage,
    Propose,
    pack_genes,
)
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

COLONY = "blue"
SCHEMA = Schema((Gene("rate", 0.0, 1.0), Gene("weight")))
DIGEST = bytes.fromhex(SCHEMA.digest)
GENES = pack_genes(np.array([0.5, -2.0]))
PEER, ME = sorted((seeded(COLONY, 1, k) for k in range(2)), key=lambda key: key.id)
OTHER = seeded(COLONY, 1, 2)


class Childless:
    """A parent that wants no offspring, and hears everything."""

    def __init__(self) -> None:
        self.sample: list[str] = []

    def decide(self, record: EncounterRecord) -> Decision:
        return Decision(0.5, False, False, b"", 1, bytes(16))

    def rollback_decision(self) -> None:
        self.sample.append("undecide")

    def on_mated(self, record: EncounterRecord, decision: Decision) -> None:
        self.sample.append("exchanged")

    def on_outcome(self, note: OutcomeReport) -> None:
        self.sample.append(note.outcome)


class Desk:
    """The exchanges of one robot, whose letters are kept."""

    def __init__(self, folder: Path, allow: AllowList) -> None:
        self.store = RobotStore(folder / "robot.sqlite", ME.id, DIGEST, durable=False)
        self.sent: list[MatingMessage] = []
        self.parent = Childless()
        self.mating_driver = MatingDriver(
            ME, COLONY, SCHEMA, self.store, self._send, self.parent, allow, MatingLimits(), 5
        )
        self.counts = self.mating_driver.counts

    def _send(self, to: bytes, envelope: bytes) -> None:
        assert to in (PEER.id, OTHER.id)
        self.sent.append(open_envelope(envelope)[1])

    def meet(self, nonce: int = 7) -> None:
        self.mating_driver.handle_contact(1.0, Contact(PEER.id, nonce), Offer("me/1", GENES), 3)


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    made = Desk(tmp_path, AllowList())
    yield made
    made.store.close()


@pytest.fixture
def verified(monkeypatch: pytest.MonkeyPatch) -> list[SignedEnvelope]:
    """Every letter whose signature was looked at."""
    envelopes: list[SignedEnvelope] = []

    def note(envelope: SignedEnvelope, colony: str) -> bool:
        envelopes.append(envelope)
        return has_valid_signature(envelope, colony)

    monkeypatch.setattr(mating_driver, "has_valid_signature", note)
    return envelopes


def proposal(nonce: int = 7, genes: bytes = GENES, count: int = 1) -> bytes:
    encounter = Encounter(PEER.id, ME.id, 1, count)
    return sign_message(Propose(encounter, nonce, DIGEST, "peer/1", genes), COLONY, PEER)


def test_a_proposal_after_the_contact_is_accepted(
    desk: Desk, verified: list[SignedEnvelope]
) -> None:
    """One verification; the answer is sent after the record is on the disk."""
    desk.meet()
    desk.mating_driver.handle_envelope(1.1, proposal())
    assert [type(message).__name__ for message in desk.sent] == ["Accept"]
    assert [record.state for record in desk.store.open_records()] == ["prepared"]
    assert len(verified) == 1


def test_letters_that_nobody_waits_for_are_not_verified(
    desk: Desk, verified: list[SignedEnvelope]
) -> None:
    """Thousands of them, of a stranger without a contact, with a wrong nonce, about encounters long over."""
    desk.meet(nonce=7)
    for count in range(1, 2001):
        desk.mating_driver.handle_envelope(1.1, proposal(nonce=8, count=count))
        encounter = Encounter(PEER.id, ME.id, 1, count)
        for message in (Commit(encounter), Abort(encounter)):
            desk.mating_driver.handle_envelope(1.1, sign_message(message, COLONY, PEER))
    assert verified == []
    assert desk.sent == []
    assert desk.counts["unexpected"] == 6000


def test_a_proposal_before_the_own_contact_waits_for_it(desk: Desk) -> None:
    """Bodies may report one contact at different times."""
    desk.mating_driver.handle_envelope(1.0, proposal())
    assert desk.sent == []
    desk.meet()
    assert [type(message).__name__ for message in desk.sent] == ["Accept"]


def test_what_is_put_aside_is_bounded(desk: Desk) -> None:
    """However many strangers propose, few of their letters are kept."""
    for number in range(200):
        stranger = seeded(COLONY, 9, number)
        encounter = Encounter(stranger.id, ME.id, 1, 1)
        envelope = sign_message(Propose(encounter, 7, DIGEST, "x/1", GENES), COLONY, stranger)
        desk.mating_driver.handle_envelope(1.0, envelope)
    assert len(desk.mating_driver._early) == 32


def test_forged_unfit_and_malformed_letters_are_counted_and_change_nothing(desk: Desk) -> None:
    """A signature of another colony; a gene out of range; genes of another length; bytes that are no letter."""
    desk.meet()
    encounter = Encounter(PEER.id, ME.id, 1, 1)
    elsewhere = sign_message(Propose(encounter, 7, DIGEST, "p/1", GENES), "red", PEER)
    desk.mating_driver.handle_envelope(1.1, elsewhere)
    desk.mating_driver.handle_envelope(1.1, proposal(genes=bytes(8) + bytes(8) + bytes(8)))
    high = pack_genes(np.array([1.5, 0.0]))
    desk.mating_driver.handle_envelope(1.1, proposal(genes=high))
    desk.mating_driver.handle_envelope(1.1, b"\x93")
    assert desk.counts["forged"] == 1
    assert desk.counts["unfit"] == 2
    assert desk.counts["malformed"] == 1
    assert desk.sent == []
    assert desk.store.open_records() == []


def test_only_the_listed_are_mated_with(tmp_path: Path) -> None:
    """In the mode `enforce`: neither their contacts nor their letters lead to anything."""
    desk = Desk(tmp_path, AllowList(frozenset({OTHER.id})))
    desk.meet()
    desk.mating_driver.handle_envelope(1.1, proposal())
    assert desk.counts["not allowed"] == 2
    assert desk.sent == []
    desk.store.close()


def test_verifications_are_limited(desk: Desk, verified: list[SignedEnvelope]) -> None:
    """A replayed letter of an open encounter costs so many verifications a second, and no more."""
    desk.meet()
    for _ in range(1000):
        desk.mating_driver.handle_envelope(1.1, proposal())
    assert len(verified) <= 500
    assert desk.counts["too many"] >= 500
