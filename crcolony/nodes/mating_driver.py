"""Carries the matings of one robot: letters in and out, and what is decided onto the disk, in the order of `mating.py`.

The order of the checks keeps hostile letters cheap. Decoding and asking whether anybody waits for this letter cost a
few microseconds; only a letter that belongs to a contact or to an open encounter is verified, and only so many a
second.
"""

from collections import Counter
from collections.abc import Callable
from typing import Protocol

from crcolony.evolution.genotype import Schema
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.codec import WireError
from crcolony.protocol.encounters import (
    Effect,
    EncounterRecord,
    MatingLimits,
    Offer,
    OutcomeReport,
    Send,
    Write,
)
from crcolony.protocol.envelope import has_valid_signature, open_envelope, sign_message
from crcolony.protocol.identity import AllowList, Identity, RobotId
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Accept,
    MatingMessage,
    Propose,
    receiver_of,
    sender_of,
    unpack_genes,
)
from crcolony.rate_limit import TokenBucket
from crcolony.storage.rows import Decision
from crcolony.storage.store import RobotStore, StorageFullError

_EARLY = 32
"""Proposals kept that came before the own body reported the contact."""
_VERIFIED_PER_S, _UNASKED_PER_S = 500.0, 20.0
"""A verification takes a tenth of a millisecond: a flood of letters that are waited for takes a twentieth of a core."""


class MatingCallbacks(Protocol):
    """Who decides what comes of a mating."""

    def decide(self, record: EncounterRecord) -> Decision:
        """Decide, by the own energy at this moment, whether there is an offspring, and keep it."""
        ...

    def rollback_decision(self) -> None:
        """Take the last decision back: it could not be written down."""
        ...

    def on_mated(self, record: EncounterRecord, decision: Decision) -> None:
        """Hear of a mating that is on the disk."""
        ...

    def on_outcome(self, note: OutcomeReport) -> None:
        """Hear how an encounter goes."""
        ...


class MatingDriver:
    """The matings of one robot between its network and its memory. Raises FatalStorageError as `RobotStore` does."""

    def __init__(
        self,
        identity: Identity,
        colony: str,
        schema: Schema,
        store: RobotStore,
        send: Callable[[RobotId, bytes], None],
        parent: MatingCallbacks,
        allow: AllowList,
        limits: MatingLimits,
        incarnation: int,
    ) -> None:
        self.counts: Counter[str] = Counter()
        """Outcomes of encounters, and letters refused or dropped"""
        self.mating = MatingStateMachine(
            identity.id, incarnation, bytes.fromhex(schema.digest), limits
        )
        self._identity, self._colony, self._schema = identity, colony, schema
        self._store, self._send, self._callbacks, self._allow = store, send, parent, allow
        self._early: dict[RobotId, bytes] = {}
        self._verified = TokenBucket(_VERIFIED_PER_S)
        self._unasked = TokenBucket(_UNASKED_PER_S)

    def resume(self, now_s: float) -> None:
        """Take up the encounters that wait on the disk."""
        self.mating.restore(now_s, self._store.open_records(), self._store.marks())

    def handle_contact(self, now_s: float, contact: Contact, own: Offer, tick: int) -> None:
        """Begin a mating with a robot that the own body has met, if it is one to mate with."""
        if contact.robot == self._identity.id or contact.robot not in self._allow:
            self.counts["not allowed"] += 1
            return
        effects = self.mating.handle_contact(now_s, contact.robot, contact.nonce, own, tick)
        self._carry_out(now_s, effects)
        early = self._early.pop(contact.robot, None)
        if early is not None:
            self.handle_envelope(now_s, early)

    def handle_envelope(self, now_s: float, data: bytes) -> None:
        """Take a letter from anybody."""
        try:
            envelope, message = open_envelope(data)
        except WireError:
            self.counts["malformed"] += 1
            return
        sender = sender_of(message)
        if sender not in self._allow:
            self.counts["not allowed"] += 1
        elif not self.mating.expects(message):
            self._put_aside(sender, message, data)
        elif not self._may_verify(now_s, message):
            self.counts["too many"] += 1
        elif not has_valid_signature(envelope, self._colony):
            self.counts["forged"] += 1
        elif not self._is_viable(message):
            self.counts["unfit"] += 1
        else:
            self._carry_out(now_s, self.mating.handle_message(now_s, message, data))

    def handle_timeouts(self, now_s: float) -> None:
        """Let time pass."""
        if self.mating.next_s <= now_s:
            self._carry_out(now_s, self.mating.handle_timeouts(now_s))

    def handle_peer_online(self, now_s: float, peer: RobotId) -> None:
        """Resolve what waits for a robot that has come onto the network."""
        self._carry_out(now_s, self.mating.handle_peer_online(now_s, peer))

    def handle_peer_offline(self, now_s: float, peer: RobotId) -> None:
        """Wait no longer for a robot that has left the network."""
        self._early.pop(peer, None)
        self._carry_out(now_s, self.mating.handle_peer_offline(now_s, peer))

    def _put_aside(self, sender: RobotId, message: MatingMessage, data: bytes) -> None:
        """Keep a proposal that may have come before the own contact; forget what nobody waits for."""
        self.counts["unexpected"] += 1
        if isinstance(message, Propose) and receiver_of(message) == self._identity.id:
            if len(self._early) >= _EARLY and sender not in self._early:
                self._early.pop(next(iter(self._early)))
            self._early[sender] = data

    def _may_verify(self, now_s: float, message: MatingMessage) -> bool:
        """Limit how much time verification takes: little for an encounter that is not open any more."""
        is_open = any(record.encounter == message.encounter for record in self.mating.open)
        bucket = self._verified if is_open or isinstance(message, Propose) else self._unasked
        return bucket.allow(now_s)

    def _is_viable(self, message: MatingMessage) -> bool:
        """Tell whether genes, if there are any, are finite, in range, and as many as the schema says."""
        if not isinstance(message, Propose | Accept) or message.schema != self.mating.schema:
            return True
        try:
            unpack_genes(message.genes, self._schema)
        except WireError:
            return False
        return True

    def _carry_out(self, now_s: float, effects: list[Effect]) -> None:
        """Carry out effects in their order; observers hear of them when the partner has heard."""
        exchanged: tuple[EncounterRecord, Decision] | None = None
        notes: list[OutcomeReport] = []
        for effect in effects:
            match effect:
                case Write():
                    try:
                        exchanged = self._write(effect)
                    except StorageFullError:
                        self._carry_out(now_s, self.mating.rollback(now_s, effect))
                        break
                case Send(to=to, message=message):
                    self._send(to, sign_message(message, self._colony, self._identity))
                case OutcomeReport():
                    notes.append(effect)
        if exchanged is not None:
            self._callbacks.on_mated(*exchanged)
        for note in notes:
            self.counts[note.outcome] += 1
            self._callbacks.on_outcome(note)

    def _write(self, write: Write) -> tuple[EncounterRecord, Decision] | None:
        """Put records, and the decision that goes with one, on the disk; return the two. Raises StorageFullError."""
        decided = write.decided
        if decided is None:
            self._store.write(write.records)
            return None
        decision = self._callbacks.decide(decided)
        try:
            self._store.write(write.records, decided, decision)
        except StorageFullError:
            self._callbacks.rollback_decision()
            raise
        return decided, decision
