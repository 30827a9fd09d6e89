"""What a robot keeps of an encounter, and what its mating asks of whoever carries it out: values, for `mating.py`."""

from dataclasses import dataclass
from typing import Literal

import msgspec

from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Encounter, MatingMessage

Role = Literal["initiator", "responder"]
EncounterState = Literal["proposed", "decided", "prepared", "mated", "aborted"]
Outcome = Literal[
    "mated", "aborted", "expired", "refused", "orphaned", "doubt", "resolved", "busy", "storage"
]


class MatingLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How long a robot waits for its partner, and how much it keeps of it."""

    contact_s: float = 2.0
    """How long after a contact a mating may begin"""
    patience_s: float = 0.5
    """After so long the robot with the larger id proposes, if the other has not"""
    propose_s: float = 2.0
    """An initiator without an answer gives up after this"""
    retry_s: float = 0.2
    """The first reminder; each later one waits twice as long"""
    doubt_s: float = 0.5
    """A responder that has not heard the decision asks after this, and is free for others"""
    max_retry_s: float = 5.0
    orphan_s: float = 60.0
    """A partner that has not come back by then is given up; if it comes back after all, the mating is still resolved"""
    open: int = 256
    """Encounters that wait for a partner, at most; beyond that there are no new ones"""
    peers: int = 100_000
    """Robots whose last encounter is remembered, at most"""


@dataclass(frozen=True)
class Offer:
    """One robot's side of an exchange: the agent in control at the contact, and its genes as they travel."""

    agent: str
    genes: bytes


@dataclass(frozen=True)
class EncounterRecord:
    """What a robot keeps of one encounter. `proof` is the partner's signed letter, byte for byte."""

    encounter: Encounter
    role: Role
    state: EncounterState
    nonce: int
    tick: int
    """Of the contact"""
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
    def waits(self) -> bool:
        """Whether it is on the disk, and not at its end: the partner has yet to answer."""
        return (self.role, self.state) in (("initiator", "decided"), ("responder", "prepared"))


@dataclass(frozen=True)
class Write:
    """Persist all of `records` or none. `before` holds what each of them replaces, or None."""

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
    """Say something to a robot; it may be lost."""

    to: RobotId
    message: MatingMessage


@dataclass(frozen=True)
class OutcomeReport:
    """How an encounter goes, for observers and counters."""

    outcome: Outcome
    peer: RobotId
    encounter: Encounter | None = None
    reason: str = ""


Effect = Write | Send | OutcomeReport
