"""The mating of two robots as a state machine without I/O, clock and randomness (PROTOCOL.md, "Mating").

It is two-phase commit with presumed abort. `mating_transitions.py` lists its transitions; a test holds that the machine
takes exactly these. Messages and times are arguments; the caller carries out the returned effects in their order. The
caller also verifies signatures: a message given to this machine is authentic.
"""

import copy
from collections.abc import Iterable
from dataclasses import replace

from crcolony.protocol.encounters import (
    Effect,
    EncounterRecord,
    EncounterState,
    MatingLimits,
    Offer,
    Outcome,
    OutcomeReport,
    Send,
    Write,
    report,
    send_for,
)
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import (
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    MatingMessage,
    Propose,
    Refuse,
    receiver_of,
)
from crcolony.protocol.open_encounters import OpenEncounter, OpenEncounters
from crcolony.protocol.recent_contacts import RecentContact, RecentContacts
from crcolony.protocol.responder_marks import Marks, ResponderMarks


class MatingStateMachine:
    """All matings of one robot. `incarnation` is on disk before this object exists; `schema` is the genes' digest."""

    def __init__(self, me: RobotId, incarnation: int, schema: bytes, limits: MatingLimits) -> None:
        self.me, self.incarnation, self.schema, self.limits = me, incarnation, schema, limits
        self._proposals = 0
        """Number of proposals in this incarnation"""
        self._contacts = RecentContacts()
        self._open = OpenEncounters(limits)
        self._marks = ResponderMarks(limits.peers)

    def restore(self, now_s: float, records: Iterable[EncounterRecord], marks: Marks) -> None:
        """Restore from disk the unresolved encounters, and every initiator's last number and whether it mated."""
        for record in records:
            self._open.add(record, now_s, in_doubt=True)
        self._marks.restore(marks)

    def copy(self) -> "MatingStateMachine":
        """Return an independent copy."""
        other = copy.copy(self)
        other._contacts, other._open = self._contacts.copy(), self._open.copy()
        other._marks = self._marks.copy()
        return other

    @property
    def is_engaged(self) -> bool:
        """Whether an encounter is in progress, so that proposals of other robots are refused as busy."""
        return self._open.is_engaged

    @property
    def is_pending(self) -> bool:
        """Whether a mating may still come of a recent contact or an encounter in progress."""
        return self.is_engaged or len(self._contacts) > 0

    @property
    def open(self) -> tuple[EncounterRecord, ...]:
        """The encounters that wait for their partner."""
        return tuple(entry.record for entry in self._open)

    @property
    def doubts(self) -> int:
        """Number of encounters for which this robot is prepared and waits too long for the decision."""
        return self._open.doubts

    @property
    def next_s(self) -> float:
        """Time at which `handle_timeouts` has something to do, infinity if it never has."""
        times = [self._open.next_s]
        for contact in self._contacts:
            times.append(contact.expires_at_s)
            if self._may_propose(contact.peer):
                times.append(contact.propose_at_s)
        return min(times)

    def expects(self, message: MatingMessage) -> bool:
        """Return whether a message belongs to a contact or an encounter of this robot, and is worth verifying."""
        encounter = message.encounter
        if receiver_of(message) != self.me or encounter.initiator == encounter.responder:
            return False
        match message:
            case Propose():
                entry = self._open.get(encounter)
                nonce = entry.record.nonce if entry else self._nonce_with(encounter.initiator)
                return nonce == message.nonce
            case Accept():
                return encounter.number <= (self.incarnation, self._proposals)
            case Commit():
                return encounter in self._open or self._marks.is_mated(encounter)
        return encounter in self._open

    def handle_contact(
        self, now_s: float, peer: RobotId, nonce: int, own: Offer, tick: int
    ) -> list[Effect]:
        """Handle a contact that the robot's own body reports: propose, or wait for the other robot to propose."""
        propose_at_s = now_s if self.me < peer else now_s + self.limits.patience_s
        expires_at_s = now_s + self.limits.contact_s
        self._contacts.add(RecentContact(peer, nonce, own, tick, propose_at_s, expires_at_s))
        return self.handle_peer_online(now_s, peer) + self._propose_due(now_s)

    def handle_message(self, now_s: float, message: MatingMessage, envelope: bytes) -> list[Effect]:
        """Handle a message whose signature in `envelope` is verified."""
        if not self.expects(message):
            return []
        encounter = message.encounter
        entry = self._open.get(encounter)
        match message:
            case Propose():
                return self._on_propose(now_s, message, envelope)
            case Accept():
                return self._on_accept(now_s, message, envelope, entry)
            case Refuse(reason=reason) if entry and entry.record.state == "proposed":
                self._open.discard(encounter)
                return [report("refused", entry.record, reason), *self._propose_due(now_s)]
            case Commit():
                return self._on_commit(encounter, entry)
            case Abort() if entry and entry.record.state == "prepared":
                return [*self._close(entry, "aborted", "aborted"), *self._propose_due(now_s)]
            case Done() if entry and entry.record.state == "decided":
                return self._close(entry, "mated")
        return []

    def handle_timeouts(self, now_s: float) -> list[Effect]:
        """Discard old contacts, give up encounters, retry and propose, each as far as it is due."""
        effects: list[Effect] = []
        self._contacts.discard_expired(now_s)
        for entry in self._open:
            if entry.give_up_at_s <= now_s:
                effects += self.give_up(now_s, entry.record.encounter)
            elif entry.retry_at_s <= now_s:
                effects += self.retry(now_s, entry.record.encounter)
        return effects + self._propose_due(now_s)

    def handle_peer_online(self, now_s: float, peer: RobotId) -> list[Effect]:
        """Retry at once all open encounters with a peer that has come onto the network."""
        effects: list[Effect] = []
        for entry in self._open.with_peer(peer):
            effects += self.retry(now_s, entry.record.encounter)
        return effects

    def handle_peer_offline(self, now_s: float, peer: RobotId) -> list[Effect]:
        """Give up a proposal to a peer that has left the network. Everything else stays: the peer may have decided."""
        self._contacts.discard(peer)
        effects: list[Effect] = []
        for entry in self._open.with_peer(peer):
            if entry.record.state == "proposed":
                effects += self.give_up(now_s, entry.record.encounter)
            elif entry.is_engaging:
                effects += self.retry(now_s, entry.record.encounter)
        return effects + self._propose_due(now_s)

    def retry(self, now_s: float, encounter: Encounter) -> list[Effect]:
        """Send an open encounter's last message again; a responder asks for the decision by it, and is in doubt."""
        entry = self._open[encounter]
        self._open.schedule_retry(encounter, now_s)
        effects: list[Effect] = []
        if entry.record.state == "prepared" and not entry.in_doubt:
            effects.append(report("doubt", entry.record))
        return [*effects, send_for(entry.record, self.schema)]

    def give_up(self, now_s: float, encounter: Encounter) -> list[Effect]:
        """Drop a proposal; mark what is decided or prepared as orphaned, and keep it for the partner's return."""
        entry = self._open[encounter]
        record = entry.record
        if record.state == "proposed":
            self._open.discard(encounter)
            return [Send(record.peer, Abort(encounter)), report("expired", record)]
        if record.orphaned:
            return []
        orphan = replace(record, orphaned=True)
        self._open.add(orphan, now_s, in_doubt=True)
        return [Write((orphan,), (record,)), report("orphaned", orphan)]

    def rollback(self, now_s: float, write: Write) -> list[Effect]:
        """Return to the state before a write that failed; no message that depends on it has been sent."""
        effects: list[Effect] = []
        for record, before in zip(write.records, write.before, strict=True):
            self._open.discard(record.encounter)
            effects.append(report("storage", record))
            if before is None:
                effects.append(Send(record.peer, Refuse(record.encounter, "storage")))
            elif before.state == "proposed":
                effects.append(Send(record.peer, Abort(record.encounter)))
            else:
                self._open.add(before, now_s, in_doubt=True)
        return effects

    def _propose_due(self, now_s: float) -> list[Effect]:
        """Propose to the robot of the last contact that is due, unless the robot is engaged."""
        contact = next((c for c in self._contacts.due(now_s) if self._may_propose(c.peer)), None)
        if contact is None:
            return []
        self._contacts.discard(contact.peer)
        self._proposals += 1
        encounter = Encounter(self.me, contact.peer, self.incarnation, self._proposals)
        record = EncounterRecord(
            encounter, "initiator", "proposed", contact.nonce, contact.tick, contact.own
        )
        self._open.add(record, now_s)
        return [send_for(record, self.schema)]

    def _on_propose(self, now_s: float, message: Propose, envelope: bytes) -> list[Effect]:
        encounter, peer = message.encounter, message.encounter.initiator
        entry = self._open.get(encounter)
        if entry is not None:
            return [send_for(entry.record, self.schema)]
        if self._marks.is_stale(encounter):
            return [Send(peer, Refuse(encounter, "stale"))]
        if message.schema != self.schema:
            refused = OutcomeReport("refused", peer, reason="schema")
            return [refused, Send(peer, Refuse(encounter, "schema"))]
        crossed = self._open.record_of(peer, "proposed")
        if crossed and self.me < peer:
            return []  # the peer yields when it receives this robot's proposal
        if crossed:
            self._open.discard(crossed.encounter)
        met = self._contacts.get(peer) or crossed  # in the order of `_nonce_with`
        assert met is not None, "expects() let it pass, so there was a contact"
        outdated = self._open.record_of(peer, "prepared")
        if not (self._open.may_add(peer, outdated) and self._marks.has_room_for(peer)):
            return [OutcomeReport("busy", peer), Send(peer, Refuse(encounter, "busy"))]
        self._contacts.discard(peer)
        partner = Offer(message.agent, message.genes)
        record = EncounterRecord(
            encounter, "responder", "prepared", met.nonce, met.tick, met.own, partner, envelope
        )
        self._marks.add_prepared(encounter)
        self._open.add(record, now_s)
        send = send_for(record, self.schema)
        if outdated is None:
            return [Write((record,), (None,)), send]
        self._open.discard(outdated.encounter)
        aborted = replace(outdated, state="aborted")
        return [Write((aborted, record), (outdated, None)), report("aborted", aborted), send]

    def _on_accept(
        self, now_s: float, message: Accept, envelope: bytes, entry: OpenEncounter | None
    ) -> list[Effect]:
        encounter, peer = message.encounter, message.encounter.responder
        if entry is None:  # never decided, or done long ago, and then the partner ignores this
            return [Send(peer, Abort(encounter))]
        record = entry.record
        if record.state == "decided":
            return [send_for(record, self.schema)]
        if message.nonce != record.nonce or message.schema != self.schema:
            return []
        partner = Offer(message.agent, message.genes)
        decided = replace(record, state="decided", partner=partner, proof=envelope)
        self._open.add(decided, now_s)
        return [
            Write((decided,), (record,)),
            report("mated", decided),
            send_for(decided, self.schema),
            *self._propose_due(now_s),
        ]

    def _on_commit(self, encounter: Encounter, entry: OpenEncounter | None) -> list[Effect]:
        done = Send(encounter.initiator, Done(encounter))
        if entry is None:  # the commit is a repetition
            return [done]
        self._marks.add_mated(encounter)
        return [*self._close(entry, "mated", "mated"), done]

    def _close(
        self, entry: OpenEncounter, state: EncounterState, outcome: Outcome | None = None
    ) -> list[Effect]:
        record = replace(entry.record, state=state)
        self._open.discard(record.encounter)
        reports = [report(outcome, record)] if outcome else []
        if entry.in_doubt or record.orphaned:
            reports.append(report("resolved", record))
        return [Write((record,), (entry.record,)), *reports]

    def _may_propose(self, peer: RobotId) -> bool:
        return self._open.may_add(peer)

    def _nonce_with(self, peer: RobotId) -> int | None:
        """Return the nonce that a proposal of this peer must quote, None if none is acceptable."""
        met = self._contacts.get(peer) or self._open.record_of(peer, "proposed")
        return met.nonce if met else None
