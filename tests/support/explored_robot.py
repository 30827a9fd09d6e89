"""One robot as `explorer.py` knows it: its disk, the caller of its `MatingStateMachine`, and what it must not say or decide."""

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
from crcolony.protocol.envelope import SignedEnvelope, has_valid_signature, open_envelope
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

Kind = Literal[
    "decided twice",
    "forged",
    "wrong genes",
    "no contact",
    "said too early",
    "one-sided",
    "no decision",
    "left open",
    "error",
]
"""How a promise can be broken."""

COLONY = "explored"
SCHEMA = bytes(16)
LIMITS = MatingLimits(
    contact_s=1e6, patience_s=1.0, propose_s=1e6, retry_s=1e6, doubt_s=1e6, max_retry_s=1e6,
    orphan_s=1e6,
)  # fmt: skip
NOW_S, PATIENCE_OVER_S = 0.0, 2.0
"""The two times at which anything ever happens: nothing but patience ends between them."""

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
    """What a crash leaves of a robot: its life, its latest record of every encounter, and its decisions to mate."""

    incarnation: int = 0
    records: frozenset[EncounterRecord] = frozenset()
    decisions: frozenset[Encounter] = frozenset()

    def find(self, encounter: Encounter) -> EncounterRecord | None:
        """Return the latest record of an encounter."""
        return next((r for r in self.records if r.encounter == encounter), None)

    def state_of(self, encounter: Encounter) -> str:
        """Return the state of an encounter, "" if nothing is known of it."""
        record = self.find(encounter)
        return record.state if record else ""


@dataclass(frozen=True)
class Decide:
    """An effect of sabotaged callers only: decide about offspring, outside the write's transaction."""

    record: EncounterRecord


class Caller:
    """The part of a robot around its `MatingStateMachine`, done right; sabotaged variants override it."""

    mating = MatingStateMachine
    decides_apart = False

    def start(self, me: RobotId, disk: Disk) -> tuple[Disk, MatingStateMachine]:
        """A process begins: a new life is on disk before anything is said, then what is open is taken up."""
        disk = replace(disk, incarnation=disk.incarnation + 1)
        return disk, self.restored(me, disk)

    def restored(self, me: RobotId, disk: Disk) -> MatingStateMachine:
        """Return the mating that goes on from a disk."""
        mating = self.mating(me, disk.incarnation, SCHEMA, LIMITS)
        # In an order that does not depend on the hashes of bytes, so that every run visits the same states.
        open_records = sorted(filter(self.is_open, disk.records), key=_place)
        mating.restore(NOW_S, open_records, marks(disk))
        return mating

    def is_open(self, record: EncounterRecord) -> bool:
        """Tell whether a record on disk still waits for the partner."""
        return record.is_unresolved

    def on_event(self, mating: MatingStateMachine, data: bytes) -> list[Effect]:
        """A letter comes in."""
        try:
            envelope, message = open_envelope(data)
        except WireError:
            return []
        if not mating.expects(message) or not self.has_valid_signature(envelope):
            return []
        return mating.handle_message(NOW_S, message, data)

    def has_valid_signature(self, envelope: SignedEnvelope) -> bool:
        """Tell whether its sender signed a letter."""
        return has_valid_signature(envelope, COLONY)

    def in_order(self, effects: Sequence[Effect]) -> Sequence[Effect | Decide]:
        """Return effects in the order in which they are carried out."""
        return effects

    def refused(self, mating: MatingStateMachine, write: Write) -> list[Effect]:
        """The disk did not take a write."""
        return mating.rollback(NOW_S, write)


def _place(record: EncounterRecord) -> tuple[tuple[int, int], RobotId, RobotId]:
    encounter = record.encounter
    return encounter.number, encounter.initiator, encounter.responder


def marks(disk: Disk) -> dict[RobotId, tuple[tuple[int, int], bool]]:
    """Return what a robot as a responder knows of every initiator: its last number, and whether that one mated."""
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
    """What may happen. A contact is a pair of robots, the smaller number first; its nonce is its place in the list."""

    contacts: tuple[tuple[int, int], ...]
    robots: int = 2
    crashes: int = 0
    refusals: int = 0
    repeats: int = 0


class Outcome(NamedTuple):
    """What one event does to one robot."""

    node: int
    said: int
    """A bit for every letter"""
    crashes: int
    refusals: int
    repeats: int
    words: str
    violation: Violation | None = None


class Node(NamedTuple):
    """One robot in one situation."""

    robot: int
    mating: MatingStateMachine
    disk: Disk
    message: tuple[int, ...]
    """The nonces of all contacts that its body reported"""


class SentEnvelope(NamedTuple):
    """Something that was said."""

    to: int
    data: bytes
    message: MatingMessage
    has_valid_signature: bool


def is_founded(disk: Disk, message: MatingMessage) -> bool:
    """Tell whether a robot with this disk may say this: a crash could not make it untrue."""
    record = disk.find(message.encounter)
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
        case Abort():  # of a mating that is complete on both sides, the answer to a late question
            return state != "decided"
        case Done():
            return state == "mated"


def offers(node: Node, nonce: int) -> list[Offer]:
    """Return what a robot offered at each report of a contact: never the same agent twice."""
    places = [k for k, message in enumerate(node.message, 1) if message == nonce]
    return [Offer(f"{NAMES[node.mating.me]}{k}", bytes([node.robot, k]) * 4) for k in places]


def forge(message: MatingMessage, owner: Identity) -> bytes:
    content = encode(message)
    signature = FORGER.sign(content)
    return encode(SignedEnvelope(content, owner.public_key, signature))


def snapshot(mating: MatingStateMachine) -> Hashable:
    """Return all of a mating that is not a time."""
    return (
        mating.incarnation,
        mating._proposals,
        tuple((c.peer, c.nonce, c.own, c.tick) for c in mating._contacts),
        tuple((entry.record, entry.in_doubt) for entry in mating._open),
        tuple(sorted(mating._marks.prepared.items())),
        tuple(sorted(mating._marks.mated.items())),
    )


def disagreement(initiator: Node, responder: Node) -> Violation | None:
    """Check two disks: whatever one has decided, the other has decided too or is prepared for."""
    me, peer = initiator.mating.me, responder.mating.me
    both = (*initiator.disk.records, *responder.disk.records)
    for encounter in {r.encounter for r in both}:
        if (encounter.initiator, encounter.responder) != (me, peer):
            continue
        one, other = initiator.disk.find(encounter), responder.disk.find(encounter)
        states = (one.state if one else "", other.state if other else "")
        if (states[1] == "mated" or states[0] in ("decided", "mated")) and states not in (
            ("decided", "prepared"),
            ("decided", "mated"),
            ("mated", "mated"),
        ):
            text = f"{named(encounter)} is '{states[0]}' at its initiator, '{states[1]}' at its responder"
            return Violation("one-sided", text)
        if one and other and (one.own != other.partner or one.partner != other.own):
            return Violation("wrong genes", f"{named(encounter)}: the disks differ")
    return None


def named(encounter: Encounter) -> str:
    names = NAMES[encounter.initiator], NAMES[encounter.responder]
    return f"{names[0]}{names[1]}{encounter.incarnation}.{encounter.count}"


def spell(message: MatingMessage) -> str:
    name = f"{type(message).__name__} {named(message.encounter)}"
    if isinstance(message, Propose | Accept):
        return f"{name} ({message.agent}, nonce {message.nonce})"
    return name


def spell_effect(effect: Effect | Decide) -> str:
    match effect:
        case Write():
            return "writes " + " and ".join(
                f"{named(r.encounter)} {r.state}" for r in effect.records
            )
        case Send():
            return f"says {spell(effect.message)}"
        case OutcomeReport():
            return f"notes {effect.outcome}"
        case Decide():
            return f"decides {named(effect.record.encounter)}"
