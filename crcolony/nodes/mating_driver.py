"""Drives the mating state machine of one robot: verifies envelopes, writes decisions to the disk, and sends replies.

The order of the checks keeps hostile envelopes cheap. To decode one and to check whether it is expected takes a few
microseconds; a signature is verified only for a contact or an open encounter, and only so many times a second.
"""

from collections import Counter
from collections.abc import Callable
from typing import Protocol

from crcolony.evolution.genotype import Schema
from crcolony.nodes.node_inputs import ColonyMember
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
from crcolony.protocol.identity import AllowList, RobotId
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

_MAX_EARLY = 32
"""Proposals kept that arrived before the own body reported the contact."""
_MAX_VERIFIED_PER_S = 500.0
"""A verification takes 0.1 ms, so that a flood of envelopes for open encounters takes a twentieth of a core."""
_MAX_LATE_VERIFIED_PER_S = 20.0
"""Verifications of envelopes for encounters that are not open any more."""
_REFUSED = ("malformed", "forged", "unfit", "not allowed")
"""Counters that are reported to observers as refused envelopes."""


class MatingCallbacks(Protocol):
    """What a mating calls back: the robot that decides, and its observers."""

    def decide(self, record: EncounterRecord) -> Decision:
        """Decide by the present energy whether there is an offspring, and keep it in the pool."""
        ...

    def rollback_decision(self) -> None:
        """Restore the state before the last decision, which could not be written to the disk."""
        ...

    def on_mated(self, record: EncounterRecord, decision: Decision) -> None:
        """Handle a mating that is on the disk."""
        ...

    def on_outcome(self, report: OutcomeReport) -> None:
        """Handle the outcome of an encounter."""
        ...


class MatingDriver:
    """The matings of one robot, between its network and its storage. Raises FatalStorageError as `RobotStore` does."""

    def __init__(
        self,
        member: ColonyMember,
        schema: Schema,
        store: RobotStore,
        send: Callable[[RobotId, bytes], None],
        callbacks: MatingCallbacks,
        allow: AllowList,
        limits: MatingLimits,
    ) -> None:
        self.counts: Counter[str] = Counter()
        """Outcomes of encounters, and envelopes refused or dropped"""
        self.mating = MatingStateMachine(
            member.identity.id, member.incarnation, bytes.fromhex(schema.digest), limits
        )
        self._identity, self._colony, self._schema = member.identity, member.colony, schema
        self.revoked: frozenset[RobotId] = frozenset()
        """Robots that nobody mates with any more"""
        self._store, self._send, self._callbacks, self._allow = store, send, callbacks, allow
        self._early: dict[RobotId, bytes] = {}
        """Proposals by sender that wait for the own contact"""
        self._verify_limit = TokenBucket(_MAX_VERIFIED_PER_S)
        self._late_verify_limit = TokenBucket(_MAX_LATE_VERIFIED_PER_S)

    @property
    def refused(self) -> int:
        """How many envelopes were refused, for whatever reason."""
        return sum(self.counts[reason] for reason in _REFUSED)

    def resume(self, now_s: float) -> None:
        """Restore the encounters that are open on the disk."""
        self.mating.restore(now_s, self._store.open_records(), self._store.marks())

    def handle_contact(self, now_s: float, contact: Contact, own: Offer, tick: int) -> None:
        """Start a mating with a robot that the own body has met, unless it is not allowed."""
        if contact.robot == self._identity.id or not self._is_allowed(contact.robot):
            self.counts["not allowed"] += 1
            return
        effects = self.mating.handle_contact(now_s, contact.robot, contact.nonce, own, tick)
        self._carry_out(now_s, effects)
        early = self._early.pop(contact.robot, None)
        if early is not None:
            self.handle_envelope(now_s, early)

    def handle_envelope(self, now_s: float, data: bytes) -> None:
        """Check an envelope from any peer, and handle its message if it is expected, genuine and fit."""
        try:
            envelope, message = open_envelope(data)
        except WireError:
            self.counts["malformed"] += 1
            return
        sender = sender_of(message)
        if not self._is_allowed(sender):
            self.counts["not allowed"] += 1
        elif not self.mating.expects(message):
            self._keep_early(sender, message, data)
        elif not self._may_verify(now_s, message):
            self.counts["too many"] += 1
        elif not has_valid_signature(envelope, self._colony):
            self.counts["forged"] += 1
        elif not self._is_viable(message):
            self.counts["unfit"] += 1
        else:
            self._carry_out(now_s, self.mating.handle_message(now_s, message, data))

    def handle_timeouts(self, now_s: float) -> None:
        """Handle the timeouts that are due."""
        if self.mating.next_s <= now_s:
            self._carry_out(now_s, self.mating.handle_timeouts(now_s))

    def handle_peer_online(self, now_s: float, peer: RobotId) -> None:
        """Resolve the encounters that wait for a robot that is online again."""
        self._carry_out(now_s, self.mating.handle_peer_online(now_s, peer))

    def handle_peer_offline(self, now_s: float, peer: RobotId) -> None:
        """Stop waiting for a robot that is offline."""
        self._early.pop(peer, None)
        self._carry_out(now_s, self.mating.handle_peer_offline(now_s, peer))

    def _is_allowed(self, robot: RobotId) -> bool:
        return robot in self._allow and robot not in self.revoked

    def _keep_early(self, sender: RobotId, message: MatingMessage, data: bytes) -> None:
        """Keep a proposal that may have arrived before the own contact; drop everything else."""
        self.counts["unexpected"] += 1
        if isinstance(message, Propose) and receiver_of(message) == self._identity.id:
            if len(self._early) >= _MAX_EARLY and sender not in self._early:
                self._early.pop(next(iter(self._early)))
            self._early[sender] = data

    def _may_verify(self, now_s: float, message: MatingMessage) -> bool:
        """Return whether the rate limit allows a verification; it is lower for an encounter that is not open."""
        is_open = any(record.encounter == message.encounter for record in self.mating.open)
        is_current = is_open or isinstance(message, Propose)
        limit = self._verify_limit if is_current else self._late_verify_limit
        return limit.allow(now_s)

    def _is_viable(self, message: MatingMessage) -> bool:
        """Return whether the genes in a message, if any, are finite, in range, and as many as the schema has."""
        if not isinstance(message, Propose | Accept) or message.schema != self.mating.schema:
            return True
        try:
            unpack_genes(message.genes, self._schema)
        except WireError:
            return False
        return True

    def _carry_out(self, now_s: float, effects: list[Effect]) -> None:
        """Carry out effects in their order; outcomes are reported after the messages to the partner are sent."""
        mated: tuple[EncounterRecord, Decision] | None = None
        reports: list[OutcomeReport] = []
        for effect in effects:
            match effect:
                case Write():
                    try:
                        mated = self._write(effect)
                    except StorageFullError:
                        self._carry_out(now_s, self.mating.rollback(now_s, effect))
                        break
                case Send(to=to, message=message):
                    self._send(to, sign_message(message, self._colony, self._identity))
                case OutcomeReport():
                    reports.append(effect)
        if mated is not None:
            self._callbacks.on_mated(*mated)
        for report in reports:
            self.counts[report.outcome] += 1
            self._callbacks.on_outcome(report)

    def _write(self, write: Write) -> tuple[EncounterRecord, Decision] | None:
        """Write records and the decision about one of them; return the latter two. Raises StorageFullError."""
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
