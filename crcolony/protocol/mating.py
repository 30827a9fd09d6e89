"""The mating of two robots, as a state machine: no I/O, no clock, no randomness (two-phase commit, presumed abort).

Both mate or neither does, once both are back, and each at most once for an encounter, through any loss, duplication,
reordering, crash and power cut. Messages and times come in, effects go out, to be carried out in their order:

    Write   put these records on disk, in one transaction; where a mating is decided, decide about offspring in it
    Send    say this to a robot
    Note    tell observers how an encounter goes

    role       state      on                        becomes    and does
    ---------  ---------  ------------------------  ---------  -----------------------------------------------
    initiator  (none)     contact                   PROPOSED   Send Propose
    initiator  PROPOSED   Accept                    DECIDED    Write, decide about offspring; Send Commit
    initiator  PROPOSED   Refuse                    (none)     Note
    initiator  PROPOSED   time is up                (none)     Send Abort; Note
    initiator  PROPOSED   Propose of a smaller id   (none)     yield: go on as responder
    initiator  DECIDED    Accept, or a reminder     DECIDED    Send Commit
    initiator  DECIDED    Done                      MATED      Write
    initiator  DECIDED    time is up                DECIDED    Write, now orphaned; keeps reminding, seldom
    initiator  (none)     Accept                    (none)     Send Abort (presumed abort)
    responder  (none)     Propose after a contact   PREPARED   Write; Send Accept
    responder  (none)     Propose while engaged     (none)     Send Refuse
    responder  PREPARED   Propose again             PREPARED   Send Accept
    responder  PREPARED   a newer Propose           ABORTED    Write both; Send Accept to the newer
    responder  PREPARED   Commit                    MATED      Write, decide about offspring; Send Done
    responder  PREPARED   Abort                     ABORTED    Write
    responder  PREPARED   a reminder                PREPARED   Send Accept: asks what was decided (it is in doubt)
    responder  PREPARED   time is up                PREPARED   Write, now orphaned; keeps asking, seldom
    responder  MATED      Commit                    MATED      Send Done

Whatever stands in no row is ignored. A message is believed only if its signature was verified by whoever calls this.
"""

import copy
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

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


@dataclass(frozen=True)
class _Contact:
    nonce: int
    own: Offer
    tick: int
    propose_at_s: float
    until_s: float


@dataclass(frozen=True)
class _Open:
    """An encounter that waits for its partner."""

    record: EncounterRecord
    remind_at_s: float
    give_up_at_s: float
    retry_s: float
    doubted: bool = False
    """The partner has been silent for so long that this robot is free for others"""

    @property
    def is_engaging(self) -> bool:
        return self.record.state in ("proposed", "prepared") and not self.doubted


@dataclass
class MatingStateMachine:
    """All matings of one robot. `life` is on disk before this exists; `records` and `marks` come from there."""

    me: RobotId
    incarnation: int
    schema: bytes
    limits: MatingLimits = field(default_factory=MatingLimits)
    _count: int = 0
    _contacts: dict[RobotId, _Contact] = field(default_factory=dict)
    _open: dict[Encounter, _Open] = field(default_factory=dict)
    _marks: dict[RobotId, tuple[int, int]] = field(default_factory=dict)
    """Of every initiator, the number of its last encounter this robot was prepared for"""
    _mated: dict[RobotId, tuple[int, int]] = field(default_factory=dict)
    """Of those, the last that became a mating"""

    def restore(
        self,
        now_s: float,
        records: Iterable[EncounterRecord],
        marks: Mapping[RobotId, tuple[tuple[int, int], bool]],
    ) -> None:
        """Take up what is on disk: encounters that wait, and every initiator's last number and whether it mated."""
        for record in records:
            self._open[record.encounter] = self._waiting(record, now_s, doubted=True)
        for peer, (number, has_mated) in marks.items():
            self._marks[peer] = number
            if has_mated:
                self._mated[peer] = number

    def copy(self) -> "MatingStateMachine":
        """Return a mating in the same state that goes its own way."""
        other = copy.copy(self)
        other._contacts, other._open = self._contacts.copy(), self._open.copy()
        other._marks, other._mated = self._marks.copy(), self._mated.copy()
        return other

    @property
    def is_engaged(self) -> bool:
        """Whether an encounter is under way, so that another robot is told to come back later."""
        return any(waiting.is_engaging for waiting in self._open.values())

    @property
    def is_awaited(self) -> bool:
        """Whether a mating may still come of what happened: a contact or an exchange is young enough."""
        return self.is_engaged or bool(self._contacts)

    @property
    def open(self) -> tuple[EncounterRecord, ...]:
        """The encounters that wait for their partner."""
        return tuple(waiting.record for waiting in self._open.values())

    @property
    def doubts(self) -> int:
        """How many encounters this robot is prepared for without knowing what became of them."""
        return sum(w.record.state == "prepared" and w.doubted for w in self._open.values())

    @property
    def next_s(self) -> float:
        """When `tick` has something to do."""
        times = [min(w.remind_at_s, w.give_up_at_s) for w in self._open.values()]
        for peer, contact in self._contacts.items():
            times.append(contact.until_s)
            if self._may_propose(peer):
                times.append(contact.propose_at_s)
        return min(times, default=float("inf"))

    def expects(self, message: MatingMessage) -> bool:
        """Tell whether a letter is worth verifying: it belongs to a contact or to an encounter of this robot."""
        encounter = message.encounter
        if receiver_of(message) != self.me or encounter.initiator == encounter.responder:
            return False
        if isinstance(message, Propose):
            peer = encounter.initiator
            waiting = self._open.get(encounter)
            nonce = waiting.record.nonce if waiting else self._nonce_with(peer)
            return nonce == message.nonce
        if isinstance(message, Accept):
            return encounter.number <= (self.incarnation, self._count)
        if isinstance(message, Commit):
            return (
                encounter in self._open or self._mated.get(encounter.initiator) == encounter.number
            )
        return encounter in self._open

    # What happens to a robot -----------------------------------------------------------------------------------

    def handle_contact(
        self, now_s: float, peer: RobotId, nonce: int, own: Offer, tick: int
    ) -> list[Effect]:
        """Note a contact that the own body reported, and propose, or wait for the other to propose."""
        patience_s = 0.0 if self.me < peer else self.limits.patience_s
        contact = _Contact(nonce, own, tick, now_s + patience_s, now_s + self.limits.contact_s)
        self._contacts[peer] = contact
        return self._remind_all(now_s, peer) + self._propose_due(now_s)

    def handle_message(self, now_s: float, message: MatingMessage, envelope: bytes) -> list[Effect]:
        """Take a message whose signature (of `letter`) is verified."""
        if not self.expects(message):
            return []
        encounter = message.encounter
        waiting = self._open.get(encounter)
        match message:
            case Propose():
                return self._on_propose(now_s, message, envelope)
            case Accept():
                return self._on_accept(now_s, message, envelope, waiting)
            case Refuse(reason=reason) if waiting and waiting.record.state == "proposed":
                del self._open[encounter]
                return [self._note("refused", waiting.record, reason), *self._propose_due(now_s)]
            case Commit():
                return self._on_commit(encounter, waiting)
            case Abort() if waiting and waiting.record.state == "prepared":
                return [*self._close(waiting, "aborted"), *self._propose_due(now_s)]
            case Done() if waiting and waiting.record.state == "decided":
                return self._close(waiting, "mated")
        return []

    def handle_timeouts(self, now_s: float) -> list[Effect]:
        """Let time pass: remind silent partners, give up on those too long away, forget old contacts."""
        effects: list[Effect] = []
        for peer, contact in list(self._contacts.items()):
            if contact.until_s <= now_s:
                del self._contacts[peer]
        for encounter, waiting in list(self._open.items()):
            if waiting.give_up_at_s <= now_s:
                effects += self.give_up(now_s, encounter)
            elif waiting.remind_at_s <= now_s:
                effects += self.remind(now_s, encounter)
        return effects + self._propose_due(now_s)

    def handle_peer_online(self, now_s: float, peer: RobotId) -> list[Effect]:
        """Resolve at once what waited for a robot that was away."""
        return self._remind_all(now_s, peer)

    def handle_peer_offline(self, now_s: float, peer: RobotId) -> list[Effect]:
        """Be free for others; what is prepared or decided stays, since a silent partner may have decided."""
        self._contacts.pop(peer, None)
        effects: list[Effect] = []
        for encounter, waiting in list(self._open.items()):
            if waiting.record.peer == peer and waiting.record.state == "proposed":
                effects += self.give_up(now_s, encounter)
            elif waiting.record.peer == peer and waiting.is_engaging:
                effects += self.remind(now_s, encounter)
        return effects + self._propose_due(now_s)

    def remind(self, now_s: float, encounter: Encounter) -> list[Effect]:
        """Say again what waits for an answer; a responder that must ask is in doubt, and no longer engaged."""
        waiting = self._open[encounter]
        effects: list[Effect] = []
        if waiting.record.state == "prepared" and not waiting.doubted:
            effects.append(self._note("doubt", waiting.record))
        retry_s = min(2.0 * waiting.retry_s, self.limits.max_retry_s)
        self._open[encounter] = replace(
            waiting,
            remind_at_s=now_s + retry_s,
            retry_s=retry_s,
            doubted=waiting.doubted or waiting.record.state == "prepared",
        )
        return [*effects, self._print_line(waiting.record)]

    def give_up(self, now_s: float, encounter: Encounter) -> list[Effect]:
        """Stop waiting: forget a proposal; keep what is decided or prepared as orphaned, if the partner returns."""
        waiting = self._open[encounter]
        record = waiting.record
        if record.state == "proposed":
            del self._open[encounter]
            return [Send(record.peer, Abort(encounter)), self._note("expired", record)]
        if record.orphaned:
            return []
        orphan = replace(record, orphaned=True)
        self._open[encounter] = self._waiting(orphan, now_s, doubted=True)
        return [Write((orphan,), (record,)), self._note("orphaned", orphan)]

    def rollback(self, now_s: float, write: Write) -> list[Effect]:
        """Go back to what was before a write that the disk did not take; nothing of it has been said."""
        effects: list[Effect] = []
        for record, before in zip(write.records, write.before, strict=True):
            self._open.pop(record.encounter, None)
            effects.append(self._note("storage", record))
            if before is None:
                effects.append(Send(record.peer, Refuse(record.encounter, "storage")))
            elif before.state == "proposed":
                effects.append(Send(record.peer, Abort(record.encounter)))
            else:
                self._open[record.encounter] = self._waiting(before, now_s, doubted=True)
        return effects

    # The rows of the table -------------------------------------------------------------------------------------

    def _propose_due(self, now_s: float) -> list[Effect]:
        """Propose to the robot met last, if nothing else is under way."""
        for peer, contact in reversed(list(self._contacts.items())):
            if contact.propose_at_s > now_s or contact.until_s <= now_s:
                continue
            if not self._may_propose(peer):
                continue
            del self._contacts[peer]
            self._count += 1
            encounter = Encounter(self.me, peer, self.incarnation, self._count)
            record = EncounterRecord(
                encounter, "initiator", "proposed", contact.nonce, contact.tick, contact.own
            )
            self._open[encounter] = self._waiting(record, now_s)
            return [self._print_line(record)]
        return []

    def _on_propose(self, now_s: float, message: Propose, envelope: bytes) -> list[Effect]:
        encounter, peer = message.encounter, message.encounter.initiator
        mark = self._marks.get(peer, (-1, -1))
        if encounter in self._open:
            return [self._print_line(self._open[encounter].record)]
        if encounter.number <= mark:
            return [Send(peer, Refuse(encounter, "stale"))]
        if message.schema != self.schema:
            return [
                self._note_peer("refused", peer, "schema"),
                Send(peer, Refuse(encounter, "schema")),
            ]
        crossed = self._proposal_to(peer)
        if crossed and self.me < peer:
            return []  # it yields as soon as it has heard of ours
        if crossed:
            del self._open[crossed.encounter]
        met = self._contacts.get(peer) or crossed  # in the order of `_nonce_with`
        assert met is not None, "expects() let it pass, so there was a contact"
        outdated = self._prepared_for(peer)
        if self._is_busy(peer, outdated):
            return [self._note_peer("busy", peer), Send(peer, Refuse(encounter, "busy"))]
        self._contacts.pop(peer, None)
        record = EncounterRecord(
            encounter, "responder", "prepared", met.nonce, met.tick, met.own,
            Offer(message.agent, message.genes), envelope,
        )  # fmt: skip
        self._marks[peer] = encounter.number
        self._open[encounter] = self._waiting(record, now_s)
        if outdated is None:
            return [Write((record,), (None,)), self._print_line(record)]
        del self._open[outdated.encounter]
        aborted = replace(outdated, state="aborted")
        return [
            Write((aborted, record), (outdated, None)),
            self._note("aborted", aborted),
            self._print_line(record),
        ]

    def _on_accept(
        self, now_s: float, message: Accept, envelope: bytes, waiting: _Open | None
    ) -> list[Effect]:
        encounter, peer = message.encounter, message.encounter.responder
        if waiting is None:  # never decided, or done long ago, and then the partner ignores this
            return [Send(peer, Abort(encounter))]
        record = waiting.record
        if record.state == "decided":
            return [self._print_line(record)]
        if message.nonce != record.nonce or message.schema != self.schema:
            return []
        decided = replace(
            record, state="decided", partner=Offer(message.agent, message.genes), proof=envelope
        )
        self._open[encounter] = self._waiting(decided, now_s)
        return [
            Write((decided,), (record,)),
            self._note("mated", decided),
            self._print_line(decided),
            *self._propose_due(now_s),
        ]

    def _on_commit(self, encounter: Encounter, waiting: _Open | None) -> list[Effect]:
        done = Send(encounter.initiator, Done(encounter))
        if waiting is None:
            return [done]
        self._mated[encounter.initiator] = encounter.number
        del self._open[encounter]
        mated = replace(waiting.record, state="mated")
        notes = [self._note("mated", mated)]
        if waiting.doubted:
            notes.append(self._note("resolved", mated))
        return [Write((mated,), (waiting.record,)), *notes, done]

    def _close(self, waiting: _Open, state: Literal["mated", "aborted"]) -> list[Effect]:
        record = replace(waiting.record, state=state)
        del self._open[record.encounter]
        notes = [self._note("aborted", record)] if state == "aborted" else []
        was_in_doubt = waiting.record.state == "prepared" and waiting.doubted
        if was_in_doubt or waiting.record.orphaned:
            notes.append(self._note("resolved", record))
        return [Write((record,), (waiting.record,)), *notes]

    # Small things ----------------------------------------------------------------------------------------------

    def _print_line(self, record: EncounterRecord) -> Send:
        """Return what a robot says in this state: once, and again at every reminder."""
        encounter, own = record.encounter, record.own
        match record.state:
            case "proposed":
                return Send(
                    record.peer, Propose(encounter, record.nonce, self.schema, own.agent, own.genes)
                )
            case "prepared":
                return Send(
                    record.peer, Accept(encounter, record.nonce, self.schema, own.agent, own.genes)
                )
            case "decided":
                return Send(record.peer, Commit(encounter))
            case _:
                raise AssertionError(f"a {record.state} encounter waits for nothing")

    def _waiting(self, record: EncounterRecord, now_s: float, doubted: bool = False) -> _Open:
        limits = self.limits
        first_s = limits.doubt_s if record.state == "prepared" else limits.retry_s
        give_up_s = limits.propose_s if record.state == "proposed" else limits.orphan_s
        if record.orphaned:
            first_s, give_up_s = limits.max_retry_s, float("inf")
        return _Open(record, now_s + first_s, now_s + give_up_s, first_s, doubted)

    def _is_busy(self, peer: RobotId, outdated: EncounterRecord | None) -> bool:
        """Whether a new encounter with this robot must wait: another is under way, or there are too many."""
        engaged = any(w.is_engaging and w.record is not outdated for w in self._open.values())
        is_unresolved = any(
            w.record.peer == peer and w.record is not outdated for w in self._open.values()
        )
        is_full = len(self._open) - (outdated is not None) >= self.limits.open
        is_stranger = peer not in self._marks and len(self._marks) >= self.limits.peers
        return engaged or is_unresolved or is_full or is_stranger

    def _nonce_with(self, peer: RobotId) -> int | None:
        contact = self._contacts.get(peer)
        if contact is not None:
            return contact.nonce
        proposal = self._proposal_to(peer)
        return proposal.nonce if proposal else None

    def _proposal_to(self, peer: RobotId) -> EncounterRecord | None:
        return self._find(peer, "proposed")

    def _prepared_for(self, peer: RobotId) -> EncounterRecord | None:
        return self._find(peer, "prepared")

    def _find(self, peer: RobotId, state: EncounterState) -> EncounterRecord | None:
        for waiting in self._open.values():
            if waiting.record.peer == peer and waiting.record.state == state:
                return waiting.record
        return None

    def _may_propose(self, peer: RobotId) -> bool:
        is_full = len(self._open) >= self.limits.open
        return not self.is_engaged and not is_full and not self._has_open(peer)

    def _has_open(self, peer: RobotId) -> bool:
        return any(waiting.record.peer == peer for waiting in self._open.values())

    def _remind_all(self, now_s: float, peer: RobotId) -> list[Effect]:
        effects: list[Effect] = []
        for encounter in [e for e, waiting in self._open.items() if waiting.record.peer == peer]:
            effects += self.remind(now_s, encounter)
        return effects

    def _note(self, outcome: Outcome, record: EncounterRecord, reason: str = "") -> OutcomeReport:
        return OutcomeReport(outcome, record.peer, record.encounter, reason)

    def _note_peer(self, outcome: Outcome, peer: RobotId, reason: str = "") -> OutcomeReport:
        return OutcomeReport(outcome, peer, None, reason)
