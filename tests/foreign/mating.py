"""The state machine of a mating (PROTOCOL.md, "Mating"), without input and output: what it says is handed to `send`.

A proposal lives in memory only; DECIDED, PREPARED, MATED and ABORTED are on disk before anything is said of them.
"""

import sqlite3
from collections.abc import Callable
from dataclasses import replace
from typing import Final, NamedTuple, Protocol

from nacl.signing import SigningKey

from tests.foreign.identity import id_of, open_envelope, seal
from tests.foreign.messages import ENVELOPE_BYTES, MATING, Message, RefusedError, decode, encode
from tests.foreign.open_encounters import Open, OpenEncounters
from tests.foreign.records import Encounter, Record, Records

CONTACT_S: Final = 2.0
PATIENCE_S: Final = 0.5
SIGNATURES_PER_S: Final = 100.0
"""How many signatures it verifies at most: forged ones cost no more time than that."""

OF_INITIATOR: Final = ("propose", "commit", "abort")


class Life(Protocol):
    """What the machine asks of the robot, and tells it."""

    def are_genes(self, genes: bytes) -> bool: ...
    def conceives(self, record: Record, records: Records) -> bool: ...
    def outcome(self, outcome: str, record: Record, reason: str = "") -> None: ...
    def exchanged(self, record: Record) -> None: ...


class Contact(NamedTuple):
    """What the body has reported, and who was in control then."""

    nonce: int
    tick: int
    agent: str
    genes: bytes


class Mating:
    """All matings of one robot."""

    def __init__(
        self,
        key: SigningKey,
        colony: str,
        incarnation: int,
        schema: bytes,
        records: Records,
        life: Life,
        send: Callable[[bytes, bytes], None],
        now_s: float,
    ) -> None:
        self.id = id_of(bytes(key.verify_key))
        self.text = f"crcolony mating 1 {colony}"
        self.refused = 0
        self.open = OpenEncounters()
        self._key, self._incarnation, self._schema = key, incarnation, schema
        self._records, self._life, self._put = records, life, send
        self._count = 0
        self._contacts: dict[bytes, tuple[Contact, float]] = {}
        """By partner, and when; one of which an encounter has come is not here any more"""
        self._verified_s = now_s
        for (
            record
        ) in records.open():  # rule 7: it commits what it decided, and asks what it does not know
            opened = self.open.begin(record, now_s)
            opened.retry_s, opened.is_in_doubt = now_s, record.state == "PREPARED"

    @property
    def is_idle(self) -> bool:
        """Whether nothing is open, and nothing can come of a contact any more."""
        return not self._contacts and not list(self.open)

    # What the robot tells the machine.

    def contact(self, partner: bytes, contact: Contact, now_s: float) -> None:
        if partner != self.id:
            self._contacts[partner] = contact, now_s
            self.online(partner, now_s)

    def online(self, partner: bytes, now_s: float) -> None:
        """Rule 10: a partner that is back gets a retry at once."""
        for opened in self.open.with_(partner):
            opened.retry_s = now_s
        self.pass_time(now_s)

    def offline(self, partner: bytes, now_s: float) -> None:
        self._contacts.pop(partner, None)
        for opened in self.open.with_(partner):
            if opened.record.state == "PROPOSED":
                self._give_up(opened)
            elif opened.is_engaging:
                self._retry(opened, now_s)

    def pass_time(self, now_s: float) -> None:
        """Timers ring, contacts end, proposals begin."""
        for opened in self.open:
            if opened.is_hopeless(now_s):
                self._give_up(opened)
            elif now_s >= opened.retry_s:
                self._retry(opened, now_s)
        for partner, (contact, at_s) in list(self._contacts.items()):
            if now_s > at_s + CONTACT_S:
                del self._contacts[partner]
            elif self.id < partner or now_s >= at_s + PATIENCE_S:
                self._propose(partner, contact, now_s)

    def receive(self, payload: bytes, now_s: float) -> None:
        """An envelope from the inbox; one that is not valid is dropped without an answer, and counted."""
        try:
            envelope = open_envelope(payload)
            message = decode(envelope.content, ENVELOPE_BYTES, *MATING)
            initiator, responder, incarnation, count = message[1]
            encounter = initiator, responder, incarnation, count
            sender, receiver = (
                encounter[:2] if message[0] in OF_INITIATOR else (responder, initiator)
            )
            if id_of(envelope.key) != sender:
                raise RefusedError("not of the robot that says this")
            if (
                receiver != self.id
                or not self._expects(message, encounter)
                or now_s < self._verified_s - 1.0
            ):
                return
            self._verified_s = max(self._verified_s, now_s) + 1.0 / SIGNATURES_PER_S
            envelope.verify(self.text)
            has_genes = message[0] in ("propose", "accept") and message[3] == self._schema
            if has_genes and not self._life.are_genes(message[5]):
                raise RefusedError("genes out of their range")
        except RefusedError:
            self.refused += 1
            return
        if message[0] == "propose":
            self._receive_propose(message, encounter, payload, now_s)
        else:
            self._receive_answer(message, encounter, payload, now_s)

    def _expects(self, message: Message, encounter: Encounter) -> bool:
        """Whether it belongs to a contact or an encounter of this robot."""
        opened = self.open.get(encounter)
        match message[0]:
            case "propose":
                met = opened.record if opened else self._met(encounter[0])
                return met is not None and bool(met.nonce == message[2])
            case "accept":  # a number that it may have used
                return encounter[2:] <= (self._incarnation, self._count)
            case "commit":
                return opened is not None or self._is_last_mating(encounter)
        return opened is not None

    # The transitions.

    def _propose(self, partner: bytes, contact: Contact, now_s: float) -> None:
        if not self.open.have_room_for(partner):
            return
        del self._contacts[partner]
        self._count += 1
        encounter = self.id, partner, self._incarnation, self._count
        record = Record(encounter, "initiator", "PROPOSED", *contact)
        self._send(self.open.begin(record, now_s), "propose")

    def _receive_propose(
        self, message: Message, encounter: Encounter, payload: bytes, now_s: float
    ) -> None:
        _, _, _, schema, agent, genes = message
        initiator = encounter[0]
        opened = self.open.get(encounter)
        if opened is not None:
            self._send(opened, "accept")
            return
        mark = self._records.last_prepared(initiator)
        if mark is not None and encounter[2:] <= mark.number:
            self._refuse(encounter, "stale")
            return
        if schema != self._schema:
            self._refuse(encounter, "schema")
            return
        met = self._met(initiator)
        crossed = self.open.of(initiator, "PROPOSED")
        if crossed is not None:
            if self.id < initiator:
                return  # the other one yields
            self.open.end(crossed)
        older = self.open.of(
            initiator, "PREPARED"
        )  # its initiator has given it up, or it would begin no other
        if met is None or not self.open.have_room_for(initiator, instead_of=older):
            self._refuse(encounter, "busy")
            return
        record = Record(
            encounter, "responder", "PREPARED", met.nonce, met.tick, met.agent, met.genes
        )
        record.partner_agent, record.partner_genes, record.proof = agent, genes, payload
        try:
            with self._records.write():
                if older is not None:
                    self._records.put(replace(older.record, state="ABORTED"))
                self._records.put(record)
        except sqlite3.Error:
            self._refuse(encounter, "storage")
            return
        self._contacts.pop(initiator, None)
        if older is not None:
            self.open.end(older)
            self._life.outcome("aborted", older.record)
        self._send(self.open.begin(record, now_s), "accept")

    def _receive_answer(
        self, message: Message, encounter: Encounter, payload: bytes, now_s: float
    ) -> None:
        opened = self.open.get(encounter)
        match message[0], opened.record.state if opened else None:
            case "accept", "PROPOSED" if opened:
                if message[2:4] == [opened.record.nonce, self._schema]:
                    self._decide(opened, message, payload, now_s)
            case "accept", "DECIDED" if opened:
                self._send(opened, "commit")
            case "accept", None:
                self._say(encounter[1], ["abort", list(encounter)])  # presumed abort
            case "refuse", "PROPOSED" if opened:
                self.open.end(opened)
                self._life.outcome("refused", opened.record, message[2])
            case "done", "DECIDED" if opened:
                self._end(opened, "MATED")
            case "commit", "PREPARED" if opened:
                if self._end(opened, "MATED"):
                    self._say(encounter[0], ["done", list(encounter)])
            case "commit", None:  # the last mating with this initiator
                self._say(encounter[0], ["done", list(encounter)])
            case "abort", "PREPARED" if opened:
                self._end(opened, "ABORTED")

    def _decide(self, opened: Open, accept: Message, payload: bytes, now_s: float) -> None:
        agent, genes = accept[4:6]
        decided = replace(
            opened.record, state="DECIDED", partner_agent=agent, partner_genes=genes, proof=payload
        )
        self.open.end(opened)
        if not self._mate(decided):
            self._say(decided.partner, ["abort", list(decided.encounter)])
            return
        self._send(self.open.begin(decided, now_s), "commit")
        self._life.exchanged(decided)

    def _end(self, opened: Open, state: str) -> bool:
        """The encounter is over, on disk; a failed write leaves it open, and it is retried."""
        ended = replace(opened.record, state=state)
        mates = ended.role == "responder" and state == "MATED"
        if not (self._mate(ended) if mates else self._write(ended)):
            return False
        self.open.end(opened)
        if mates:
            self._life.exchanged(ended)
        if state == "ABORTED":
            self._life.outcome("aborted", ended)
        if opened.is_in_doubt or ended.is_orphaned:
            self._life.outcome("resolved", ended)
        return True

    def _mate(self, record: Record) -> bool:
        """Rule 11: in the transaction of the mating this robot decides by itself whether it gets an offspring."""
        try:
            with self._records.write():
                record.conceived = self._life.conceives(record, self._records)
                self._records.put(record)
        except sqlite3.Error:
            return False
        self._life.outcome("mated", record)
        return True

    def _write(self, record: Record) -> bool:
        try:
            with self._records.write():
                self._records.put(record)
        except sqlite3.Error:
            return False
        return True

    def _retry(self, opened: Open, now_s: float) -> None:
        opened.wait_longer(now_s)
        match opened.record.state:
            case "PROPOSED":
                self._send(opened, "propose")
            case "DECIDED":
                self._send(opened, "commit")
            case _:  # it asks for the decision
                if not opened.is_in_doubt:
                    opened.is_in_doubt = True
                    self._life.outcome("doubt", opened.record)
                self._send(opened, "accept")

    def _give_up(self, opened: Open) -> None:
        """A proposal ends; what is on disk is orphaned, and waits for the partner's return."""
        if opened.record.state == "PROPOSED":
            self.open.end(opened)
            self._say(opened.record.partner, ["abort", list(opened.record.encounter)])
            self._life.outcome("expired", opened.record)
            return
        orphan = replace(opened.record, is_orphaned=True)
        if self._write(orphan):
            opened.record = orphan
            self._life.outcome("orphaned", orphan)

    # What it knows.

    def _met(self, partner: bytes) -> Contact | Record | None:
        """The contact whose nonce a proposal of this robot must quote."""
        if partner in self._contacts:
            return self._contacts[partner][0]
        proposal = self.open.of(partner, "PROPOSED")
        return proposal.record if proposal else None

    def _is_last_mating(self, encounter: Encounter) -> bool:
        mark = self._records.last_prepared(encounter[0])
        return mark is not None and mark.encounter == encounter and mark.state == "MATED"

    # What it says.

    def _send(self, opened: Open, name: str) -> None:
        record = opened.record
        message: Message = [name, list(record.encounter)]
        if name in ("propose", "accept"):
            message += [record.nonce, self._schema, record.agent, record.genes]
        self._say(record.partner, message)

    def _refuse(self, encounter: Encounter, reason: str) -> None:
        self._say(encounter[0], ["refuse", list(encounter), reason])

    def _say(self, partner: bytes, message: Message) -> None:
        self._put(partner, seal(self._key, self.text, encode(message)))
