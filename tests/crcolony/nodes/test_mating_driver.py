"""Hostile envelopes are cheap: unexpected ones are never verified, and the rate of verifications is limited."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from crcolony.evolution.genotype import Gene, Schema
from crcolony.nodes import mating_driver
from crcolony.nodes.mating_driver import MatingDriver
from crcolony.nodes.node_inputs import ColonyMember
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.encounters import EncounterRecord, MatingLimits, Offer, OutcomeReport
from crcolony.protocol.envelope import has_valid_signature, open_envelope, sign_message
from crcolony.protocol.identity import AllowList, seeded
from crcolony.protocol.mating_messages import (
    Abort,
    Commit,
    Encounter,
    MatingMessage,
    Propose,
    pack_genes,
)
from crcolony.protocol.signed_envelope import SignedEnvelope
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore

COLONY = "blue"
SCHEMA = Schema((Gene("rate", 0.0, 1.0), Gene("weight")))
DIGEST = bytes.fromhex(SCHEMA.digest)
GENES = pack_genes(np.array([0.5, -2.0]))
PEER, ME = sorted((seeded(COLONY, 1, k) for k in range(2)), key=lambda key: key.id)
OTHER = seeded(COLONY, 1, 2)


class RecordingCallbacks:
    """Callbacks that decide against an offspring, and record every call."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def decide(self, record: EncounterRecord) -> Decision:
        return Decision(0.5, False, False, b"", 1, bytes(16))

    def rollback_decision(self) -> None:
        self.calls.append("rollback")

    def on_mated(self, record: EncounterRecord, decision: Decision) -> None:
        self.calls.append("mated")

    def on_outcome(self, report: OutcomeReport) -> None:
        self.calls.append(report.outcome)


class Setup:
    """The mating driver of one robot, and the messages that it sent."""

    def __init__(self, folder: Path, allow: AllowList) -> None:
        self.store = RobotStore(folder / "robot.sqlite", ME.id, DIGEST, durable=False)
        self.sent: list[MatingMessage] = []
        self.callbacks = RecordingCallbacks()
        self.driver = MatingDriver(
            ColonyMember(ME, COLONY, 0, 5),
            SCHEMA,
            self.store,
            self._send,
            self.callbacks,
            allow,
            MatingLimits(),
        )
        self.counts = self.driver.counts

    def _send(self, to: bytes, envelope: bytes) -> None:
        assert to in (PEER.id, OTHER.id)
        self.sent.append(open_envelope(envelope)[1])

    def meet(self, nonce: int = 7) -> None:
        self.driver.handle_contact(1.0, Contact(PEER.id, nonce), Offer("me/1", GENES), 3)


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[Setup]:
    made = Setup(tmp_path, AllowList())
    yield made
    made.store.close()


@pytest.fixture
def verified(monkeypatch: pytest.MonkeyPatch) -> list[SignedEnvelope]:
    """Every envelope whose signature was verified."""
    envelopes: list[SignedEnvelope] = []

    def record(envelope: SignedEnvelope, colony: str) -> bool:
        envelopes.append(envelope)
        return has_valid_signature(envelope, colony)

    monkeypatch.setattr(mating_driver, "has_valid_signature", record)
    return envelopes


def proposal(nonce: int = 7, genes: bytes = GENES, count: int = 1) -> bytes:
    encounter = Encounter(PEER.id, ME.id, 1, count)
    return sign_message(Propose(encounter, nonce, DIGEST, "peer/1", genes), COLONY, PEER)


def test_a_proposal_after_the_contact_is_accepted(
    setup: Setup, verified: list[SignedEnvelope]
) -> None:
    """With one verification; the reply is sent after the record is on the disk."""
    setup.meet()
    setup.driver.handle_envelope(1.1, proposal())
    assert [type(message).__name__ for message in setup.sent] == ["Accept"]
    assert [record.state for record in setup.store.open_records()] == ["prepared"]
    assert len(verified) == 1


def test_nobody_mates_with_a_robot_that_is_revoked(
    setup: Setup, verified: list[SignedEnvelope]
) -> None:
    """Neither after a contact, nor for a proposal that came before it; of an open encounter nothing is accepted."""
    setup.driver.revoked = frozenset({PEER.id})
    setup.meet()
    setup.driver.handle_envelope(1.1, proposal())
    assert setup.sent == []
    assert setup.counts["not allowed"] == 2
    assert verified == []
    setup.driver.revoked = frozenset()
    setup.meet()
    setup.driver.handle_envelope(1.1, proposal())
    assert len(setup.sent) == 1


def test_unexpected_envelopes_are_not_verified(
    setup: Setup, verified: list[SignedEnvelope]
) -> None:
    """Thousands of them, with a wrong nonce, and about encounters that are not open."""
    setup.meet(nonce=7)
    for count in range(1, 2001):
        setup.driver.handle_envelope(1.1, proposal(nonce=8, count=count))
        encounter = Encounter(PEER.id, ME.id, 1, count)
        for message in (Commit(encounter), Abort(encounter)):
            setup.driver.handle_envelope(1.1, sign_message(message, COLONY, PEER))
    assert verified == []
    assert setup.sent == []
    assert setup.counts["unexpected"] == 6000


def test_a_proposal_before_the_own_contact_is_kept_for_it(setup: Setup) -> None:
    """Bodies may report one contact at different times."""
    setup.driver.handle_envelope(1.0, proposal())
    assert setup.sent == []
    setup.meet()
    assert [type(message).__name__ for message in setup.sent] == ["Accept"]


def test_the_number_of_early_proposals_is_bounded(setup: Setup) -> None:
    """However many robots propose, few of their envelopes are kept."""
    for number in range(200):
        proposer = seeded(COLONY, 9, number)
        encounter = Encounter(proposer.id, ME.id, 1, 1)
        envelope = sign_message(Propose(encounter, 7, DIGEST, "x/1", GENES), COLONY, proposer)
        setup.driver.handle_envelope(1.0, envelope)
    assert len(setup.driver._early) == 32


def test_forged_unfit_and_malformed_envelopes_are_counted_and_change_nothing(setup: Setup) -> None:
    """A signature for another colony; a gene out of range; genes of another length; bytes that are no envelope."""
    setup.meet()
    encounter = Encounter(PEER.id, ME.id, 1, 1)
    foreign = sign_message(Propose(encounter, 7, DIGEST, "p/1", GENES), "red", PEER)
    setup.driver.handle_envelope(1.1, foreign)
    setup.driver.handle_envelope(1.1, proposal(genes=bytes(8) + bytes(8) + bytes(8)))
    high = pack_genes(np.array([1.5, 0.0]))
    setup.driver.handle_envelope(1.1, proposal(genes=high))
    setup.driver.handle_envelope(1.1, b"\x93")
    assert setup.counts["forged"] == 1
    assert setup.counts["unfit"] == 2
    assert setup.counts["malformed"] == 1
    assert setup.sent == []
    assert setup.store.open_records() == []


def test_only_allowed_robots_are_mated_with(tmp_path: Path) -> None:
    """With an allow list, neither contacts nor envelopes of other robots have an effect."""
    setup = Setup(tmp_path, AllowList(frozenset({OTHER.id})))
    setup.meet()
    setup.driver.handle_envelope(1.1, proposal())
    assert setup.counts["not allowed"] == 2
    assert setup.sent == []
    setup.store.close()


def test_verifications_are_limited(setup: Setup, verified: list[SignedEnvelope]) -> None:
    """A replayed envelope of an open encounter costs at most 500 verifications a second."""
    setup.meet()
    for _ in range(1000):
        setup.driver.handle_envelope(1.1, proposal())
    assert len(verified) <= 500
    assert setup.counts["too many"] >= 500
