"""One robot of `mating_explorer.py`: its disk, its state machine and the caller, and what it may send and decide."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.encounters import (
    Effect,
    EncounterRecord,
    MatingLimits,
    Offer,
    OutcomeReport,
    Send,
    Write,
)
from crcolony.protocol.envelope import has_valid_signature, open_envelope
from crcolony.protocol.identity import Identity, RobotId, seeded
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    MatingMessage,
    Propose,
    Refuse,
)
from crcolony.protocol.signed_envelope import SignedEnvelope

Kind = Literal[
    "decided twice",
    "forged",
    "wrong genes",
    "no contact",
    "sent too early",
    "one-sided",
    "no decision",
    "left open",
    "error",
]
"""The ways in which a promise can be broken."""

COLONY = "explored"
SCHEMA = bytes(16)
LIMITS = MatingLimits(
    contact_s=1e6, patience_s=1.0, propose_s=1e6, retry_s=1e6, doubt_s=1e6, max_retry_s=1e6,
    orphan_s=1e6,
)  # fmt: skip
NOW_S, PATIENCE_OVER_S = 0.0, 2.0
"""The only two times of an exploration: between them only patience_s ends."""

KEYS = sorted((seeded(COLONY, 0, k) for k in range(3)), key=lambda key: key.id)
FORGER = seeded(COLONY, 1, 0)
NAMES = {key.id: name for key, name in zip(KEYS, "ABC", strict=True)}


class Violation(Exception):  # noqa: N818
    """A promise is broken."""

    def __init__(self, kind: Kind, text: str) -> None:
        super().__init__(f"{kind}: {text}")
        self.kind: Kind = kind


@dataclass(frozen=True)
class Disk:
    """What a crash leaves: the incarnation, the latest record of every encounter, and the decisions to mate."""

    incarnation: int = 0
    records: frozenset[EncounterRecord] = frozenset()
    decisions: frozenset[Encounter] = frozenset()
    lost: frozenset[Encounter] = frozenset()
    """Decisions about encounters that a restored backup does not know"""

    def record_of(self, encounter: Encounter) -> EncounterRecord | None:
        """Return the latest record of an encounter, None if there is none."""
        return next((r for r in self.records if r.encounter == encounter), None)

    def state_of(self, encounter: Encounter) -> str:
        """Return the state of an encounter, "" if it has no record."""
        record = self.record_of(encounter)
        return record.state if record else ""


@dataclass(frozen=True)
class Decide:
    """Decide about offspring outside the write's transaction: an effect of sabotaged callers only."""

    record: EncounterRecord


class Caller:
    """A correct caller of the state machine; sabotaged variants override its methods."""

    mating = MatingStateMachine
    decides_apart = False

    def start(self, me: RobotId, disk: Disk) -> tuple[Disk, MatingStateMachine]:
        """Start a process: the new incarnation is on disk before anything is sent, then the state is restored."""
        disk = replace(disk, incarnation=disk.incarnation + 1)
        return disk, self.restore(me, disk)

    def start_from_backup(
        self, me: RobotId, disk: Disk, backup: Disk
    ) -> tuple[Disk, MatingStateMachine]:
        """Start a process with an old copy of its disk; its incarnation, from the clock, is above all that were lost.

        What the copy knows to be open may be decided again, in place of the decision that is lost.
        """
        known = {record.encounter for record in backup.records}
        lost = disk.lost | disk.decisions - known
        return self.start(me, replace(backup, incarnation=disk.incarnation, lost=lost))

    def restore(self, me: RobotId, disk: Disk) -> MatingStateMachine:
        """Return the state machine that is restored from a disk."""
        mating = self.mating(me, disk.incarnation, SCHEMA, LIMITS)
        # In an order that does not depend on the hashes of bytes, so that every run visits the same states.
        open_records = sorted(filter(self.is_open, disk.records), key=_place)
        mating.restore(NOW_S, open_records, marks(disk))
        return mating

    def is_open(self, record: EncounterRecord) -> bool:
        """Return whether a record on disk is to be restored."""
        return record.is_unresolved

    def handle_envelope(self, mating: MatingStateMachine, data: bytes) -> list[Effect]:
        """Handle a received envelope."""
        try:
            envelope, message = open_envelope(data)
        except WireError:
            return []
        if not mating.expects(message) or not self.has_valid_signature(envelope):
            return []
        return mating.handle_message(NOW_S, message, data)

    def has_valid_signature(self, envelope: SignedEnvelope) -> bool:
        """Return whether its sender signed an envelope."""
        return has_valid_signature(envelope, COLONY)

    def in_order(self, effects: Sequence[Effect]) -> Sequence[Effect | Decide]:
        """Return effects in the order in which they are carried out."""
        return effects

    def handle_failed_write(self, mating: MatingStateMachine, write: Write) -> list[Effect]:
        """Handle a write that failed."""
        return mating.rollback(NOW_S, write)


def _place(record: EncounterRecord) -> tuple[tuple[int, int], RobotId, RobotId]:
    encounter = record.encounter
    return encounter.number, encounter.initiator, encounter.responder


def marks(disk: Disk) -> dict[RobotId, tuple[tuple[int, int], bool]]:
    """Return a responder's marks: of every initiator the last number, and whether that encounter mated."""
    last: dict[RobotId, EncounterRecord] = {}
    for record in disk.records:
        peer, number = record.encounter.initiator, record.encounter.number
        if record.role == "responder" and (
            peer not in last or last[peer].encounter.number < number
        ):
            last[peer] = record
    return {peer: (r.encounter.number, r.state == "mated") for peer, r in last.items()}


@dataclass(frozen=True)
class Bounds:
    """What may happen. A contact is a pair of robots, the smaller number first; its nonce is its ordinal, from 1."""

    contacts: tuple[tuple[int, int], ...]
    robots: int = 2
    crashes: int = 0
    failed_writes: int = 0
    repeats: int = 0
    has_backups: bool = False
    """Whether a robot may be copied once, at any time, and restored from that copy; each restore counts as a crash"""


class Step(NamedTuple):
    """What one event does to one robot."""

    node: int
    sent: int
    """A bit for every envelope"""
    crashes: int
    failed_writes: int
    repeats: int
    text: str
    violation: Violation | None = None


class Node(NamedTuple):
    """One robot in one situation."""

    robot: int
    mating: MatingStateMachine
    disk: Disk
    contacts: tuple[int, ...]
    """The nonces of all contacts that its body has reported"""
    backup: Disk | None = None
    """A copy of its disk, of an earlier time"""


class SentEnvelope(NamedTuple):
    """An envelope that was sent."""

    to: int
    data: bytes
    message: MatingMessage
    has_valid_signature: bool


def may_send(disk: Disk, message: MatingMessage) -> bool:
    """Return whether a robot with this disk may send this: no crash can make it untrue."""
    record = disk.record_of(message.encounter)
    state = record.state if record else ""
    match message:
        case Propose():
            return message.encounter.incarnation == disk.incarnation
        case Accept(agent=agent, genes=genes):
            return state == "prepared" and record is not None and record.own == Offer(agent, genes)
        case Refuse():
            return state != "prepared"
        case Commit():
            return state == "decided"
        case Abort():  # also of a mating that is complete on both sides, as the answer to a late accept
            return state != "decided"
        case Done():
            return state == "mated"


def offers(node: Node, nonce: int) -> list[Offer]:
    """Return the offers at each report of a contact; no two reports have the same agent."""
    places = [k for k, contact in enumerate(node.contacts, 1) if contact == nonce]
    return [Offer(f"{NAMES[node.mating.me]}{k}", bytes([node.robot, k]) * 4) for k in places]


def forge(message: MatingMessage, owner: Identity) -> bytes:
    """Return an envelope with the owner's key and another robot's signature."""
    content = encode(message)
    signature = FORGER.sign(content)
    return encode(SignedEnvelope(content, owner.public_key, signature))


def snapshot(mating: MatingStateMachine) -> Hashable:
    """Return the state of a state machine without its times."""
    return (
        mating.incarnation,
        mating._proposals,
        tuple((c.peer, c.nonce, c.own, c.tick) for c in mating._contacts),
        tuple((entry.record, entry.in_doubt) for entry in mating._open),
        tuple(sorted(mating._marks.prepared.items())),
        tuple(sorted(mating._marks.mated.items())),
    )


def disagreement(initiator: Node, responder: Node) -> Violation | None:
    """Check two disks: what one has decided, the other has decided too or is prepared for."""
    me, peer = initiator.mating.me, responder.mating.me
    both = (*initiator.disk.records, *responder.disk.records)
    for encounter in {r.encounter for r in both}:
        if (encounter.initiator, encounter.responder) != (me, peer):
            continue
        one, other = initiator.disk.record_of(encounter), responder.disk.record_of(encounter)
        states = (one.state if one else "", other.state if other else "")
        if (states[1] == "mated" or states[0] in ("decided", "mated")) and states not in (
            ("decided", "prepared"),
            ("decided", "mated"),
            ("mated", "mated"),
        ):
            text = f"{format_encounter(encounter)} is '{states[0]}' at its initiator, '{states[1]}' at its responder"
            return Violation("one-sided", text)
        if one and other and (one.own != other.partner or one.partner != other.own):
            return Violation("wrong genes", f"{format_encounter(encounter)}: the disks differ")
    return None


def format_encounter(encounter: Encounter) -> str:
    """Return an encounter as text, AB1.2 for the second proposal of A's first incarnation to B."""
    names = NAMES[encounter.initiator], NAMES[encounter.responder]
    return f"{names[0]}{names[1]}{encounter.incarnation}.{encounter.count}"


def format_message(message: MatingMessage) -> str:
    """Return a message as text."""
    name = f"{type(message).__name__} {format_encounter(message.encounter)}"
    if isinstance(message, Propose | Accept):
        return f"{name} ({message.agent}, nonce {message.nonce})"
    return name


def format_effect(effect: Effect | Decide) -> str:
    """Return what an effect does as text."""
    match effect:
        case Write():
            return "writes " + " and ".join(
                f"{format_encounter(r.encounter)} {r.state}" for r in effect.records
            )
        case Send():
            return f"sends {format_message(effect.message)}"
        case OutcomeReport():
            return f"reports {effect.outcome}"
        case Decide():
            return f"decides {format_encounter(effect.record.encounter)}"
