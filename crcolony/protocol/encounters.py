"""The values of a mating: what a robot keeps of an encounter, and the effects that `mating.py` returns."""

from dataclasses import dataclass
from typing import Literal

import msgspec

from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import (
    Accept,
    Commit,
    Encounter,
    MatingMessage,
    Propose,
)

Role = Literal["initiator", "responder"]
EncounterState = Literal["proposed", "decided", "prepared", "mated", "aborted"]
Outcome = Literal[
    "mated", "aborted", "expired", "refused", "orphaned", "doubt", "resolved", "busy", "storage"
]


class MatingLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How long a robot waits for its partner, and how many encounters it keeps."""

    contact_s: float = 2.0
    """Time after a contact in which a mating may begin"""
    patience_s: float = 0.5
    """Time after which the robot with the larger id proposes if the other has not"""
    propose_s: float = 2.0
    """Time after which an initiator without an answer gives up"""
    retry_s: float = 0.2
    """Time to the first retry of a propose or commit; it doubles with every retry"""
    doubt_s: float = 0.5
    """Time after which a responder without the decision asks for it, and is free for other robots"""
    max_retry_s: float = 5.0
    """Longest time between two retries"""
    orphan_s: float = 60.0
    """Time after which an encounter whose partner is silent is orphaned; it is still resolved if the partner returns"""
    open: int = 256
    """Encounters that may be open at the same time"""
    peers: int = 100_000
    """Initiators whose last number is remembered; proposals of others are then refused as busy"""


@dataclass(frozen=True)
class Offer:
    """One robot's side of a mating: the agent in control at the contact, and its packed genes."""

    agent: str
    genes: bytes


@dataclass(frozen=True)
class EncounterRecord:
    """What a robot keeps of one encounter. `proof` is the partner's signed envelope, byte for byte."""

    encounter: Encounter
    role: Role
    state: EncounterState
    nonce: int
    tick: int
    """Tick of the contact"""
    own: Offer
    partner: Offer | None = None
    proof: bytes = b""
    orphaned: bool = False

    @property
    def peer(self) -> RobotId:
        """The other robot."""
        is_mine = self.role == "initiator"
        return self.encounter.responder if is_mine else self.encounter.initiator

    @property
    def is_unresolved(self) -> bool:
        """Whether the record is on disk and waits for the partner's answer."""
        return (self.role, self.state) in (("initiator", "decided"), ("responder", "prepared"))


@dataclass(frozen=True)
class Write:
    """Persist all of `records` or none. `before` holds the record that each of them replaces, or None."""

    records: tuple[EncounterRecord, ...]
    before: tuple[EncounterRecord | None, ...]

    @property
    def decided(self) -> EncounterRecord | None:
        """The record with which a mating takes place for this robot: the moment to decide about offspring."""
        for record, before in zip(self.records, self.before, strict=True):
            is_new = before is None or before.state in ("proposed", "prepared")
            if is_new and record.state in ("decided", "mated"):
                return record
        return None


@dataclass(frozen=True)
class Send:
    """Send a message to a robot; it may be lost."""

    to: RobotId
    message: MatingMessage


@dataclass(frozen=True)
class OutcomeReport:
    """Report to observers and counters what became of an encounter."""

    outcome: Outcome
    peer: RobotId
    encounter: Encounter | None = None
    reason: str = ""


Effect = Write | Send | OutcomeReport


def send_for(record: EncounterRecord, schema: bytes) -> Send:
    """Return the message that a robot sends when an encounter enters this state, and again at every retry."""
    encounter, own = record.encounter, record.own
    offer = (encounter, record.nonce, schema, own.agent, own.genes)
    match record.state:
        case "proposed":
            return Send(record.peer, Propose(*offer))
        case "prepared":
            return Send(record.peer, Accept(*offer))
        case "decided":
            return Send(record.peer, Commit(encounter))
    raise AssertionError(f"an encounter that is {record.state} has no message")


def report(outcome: Outcome, record: EncounterRecord, reason: str = "") -> OutcomeReport:
    """Return the report of an encounter's outcome."""
    return OutcomeReport(outcome, record.peer, record.encounter, reason)
