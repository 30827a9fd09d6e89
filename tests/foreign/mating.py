"""The state machine of a mating (PROTOCOL.md, "Mating"), without input and output: what it says is handed to `send`.

A proposal lives in memory only; DECIDED, PREPARED, MATED and ABORTED are on disk before anything is said of them."""

import sqlite3
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from typing import Final, Protocol

from nacl.signing import SigningKey

from tests.foreign.identity import Envelope, id_of, open_envelope, seal
from tests.foreign.messages import ENVELOPE_BYTES, MATING, Message, RefusedError, decode, encode
from tests.foreign.records import Encounter, Record, Records

CONTACT_S: Final = 2.0
PATIENCE_S: Final = 0.5
PROPOSE_S: Final = 2.0
RETRY_S: Final = 0.2
DOUBT_S: Final = 0.5
MAX_RETRY_S: Final = 5.0
ORPHAN_S: Final = 60.0
MOST_OPEN: Final = 256
SIGNATURES_PER_S: Final = 100.0
"""How many signatures it verifies at most: forged ones cost no more time than that."""

OF_INITIATOR: Final = ("propose", "commit", "abort")


class Life(Protocol):
    """What the machine asks of the robot."""

    def are_genes(self, genes: bytes) -> bool: ...
    def conceives(self, record: Record, records: Records) -> bool: ...
    def outcome(self, outcome: str, record: Record, reason: str = "") -> None: ...
    def exchanged(self, record: Record) -> None: ...


@dataclass
class Contact:
    """Both bodies have reported it, with the same nonce."""

    nonce: int
    tick: int
    agent: str
    genes: bytes
    at_s: float
    has_proposed: bool = False


@dataclass
class Open:
    """An encounter that has not ended, and its timers."""

    record: Record
    began_s: float
    retry_s: float
    interval_s: float
    is_in_doubt: bool = False


class Mating:
    """All encounters of one robot."""

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
        self.count = 0
        self.refused = 0
        self._key, self._incarnation, self._schema = key, incarnation, schema
        self._records, self._life, self._send_bytes = records, life, send
        self._contacts: dict[bytes, Contact] = {}
        self._last_nonces: dict[bytes, int] = {}
        self._verify_at_s = now_s
        self.open: dict[Encounter, Open] = {}
        for record in (
            records.open()
        ):  # rule 7: it commits what it has decided, and asks what it does not know
            in_doubt = record.state == "PREPARED"
            self.open[record.encounter] = Open(record, now_s, now_s, RETRY_S, in_doubt)

    # What the robot tells the machine.

    def contact(
        self, partner: bytes, nonce: int, tick: int, agent: str, genes: bytes, now_s: float
    ) -> bool:
        """The body reports a contact; whether it is a new one."""
        if partner == self.id or self._last_nonces.get(partner) == nonce:
            return False
        self._last_nonces[partner] = nonce
        self._contacts[partner] = Contact(nonce, tick, agent, genes, now_s)
        self.pass_time(now_s)
        return True

    def online(self, partner: bytes, now_s: float) -> None:
        """Rule 10: a partner that is back gets a retry at once."""
        for open_ in self._with(partner):
            open_.retry_s = now_s
        self.pass_time(now_s)

    def offline(self, partner: bytes) -> None:
        self._contacts.pop(partner, None)
        for open_ in self._with(partner):
            if open_.record.state == "PROPOSED":
                self._give_up(open_)

    def pass_time(self, now_s: float) -> None:
        """Contacts end, proposals begin, timers ring."""
        for partner, contact in list(self._contacts.items()):
            age_s = now_s - contact.at_s
            if age_s > CONTACT_S:
                del self._contacts[partner]
            elif not contact.has_proposed and (self.id < partner or age_s >= PATIENCE_S):
                self._propose(partner, contact, now_s)
        for open_ in list(self.open.values()):
            if open_.record.state == "PROPOSED" and now_s >= open_.began_s + PROPOSE_S:
                self._give_up(open_)
                continue
            if not open_.record.is_orphaned and now_s >= open_.began_s + ORPHAN_S:
                self._change(open_, outcome="orphaned", is_orphaned=True)
            if now_s >= open_.retry_s:
                self._retry(open_, now_s)

    def receive(self, payload: bytes, now_s: float) -> None:
        """An envelope from the inbox; one that fails is dropped without an answer, and counted."""
        try:
            envelope = open_envelope(payload)
            message = decode(envelope.content, ENVELOPE_BYTES, *MATING)
            initiator, responder, *number = message[1]
            encounter: Encounter = (initiator, responder, number[0], number[1])
            sender = initiator if message[0] in OF_INITIATOR else responder
            if id_of(envelope.key) != sender or self.id not in encounter[:2] or sender == self.id:
                raise RefusedError("not of the robot that says this")
            if not self._is_expected(message, encounter):
                return
            if now_s < self._verify_at_s - 1.0:  # a second's signatures are waiting
                return
            self._verify_at_s = max(self._verify_at_s, now_s) + 1.0 / SIGNATURES_PER_S
            envelope.verify(self.text)
            is_of_species = message[0] in ("propose", "accept") and message[3] == self._schema
            if is_of_species and not self._life.are_genes(message[5]):
                raise RefusedError("genes out of their range")
            self._handle(message, encounter, envelope, payload, now_s)
        except RefusedError:
            self.refused += 1

    # The transitions.

    def _is_expected(self, message: Message, encounter: Encounter) -> bool:
        """Whether it belongs to a contact or an encounter of this robot."""
        open_ = self.open.get(encounter)
        match message[0]:
            case "propose":
                contact = self._contacts.get(encounter[0])
                is_met = contact is not None and contact.nonce == message[2]
                return open_ is not None or is_met or self._is_last_mating(encounter)
            case "accept":
                return open_ is not None or self._is_used(encounter)
            case "commit":
                return open_ is not None or self._is_last_mating(encounter)
            case _:
                return open_ is not None

    def _handle(
        self,
        message: Message,
        encounter: Encounter,
        envelope: Envelope,
        payload: bytes,
        now_s: float,
    ) -> None:
        open_ = self.open.get(encounter)
        match message[0], open_.record.state if open_ else None:
            case "propose", _:
                self._proposed_to(message, encounter, open_, payload, now_s)
            case "accept", "PROPOSED" if open_ and message[2:4] == [
                open_.record.nonce,
                self._schema,
            ]:
                agent, genes = message[4:6]
                self._change(
                    open_, state="DECIDED", partner_agent=agent, partner_genes=genes, proof=payload
                )
                if open_.record.state == "DECIDED":
                    open_.interval_s, open_.retry_s, open_.began_s = RETRY_S, now_s + RETRY_S, now_s
                    self._contacts.pop(open_.record.partner, None)
                    self._send(open_, "commit")
            case "accept", "DECIDED" if open_:
                self._send(open_, "commit")
            case "accept", None:
                self._say(encounter[1], ["abort", list(encounter)])  # presumed abort
            case "refuse", "PROPOSED" if open_:
                del self.open[encounter]
                self._life.outcome("refused", open_.record, message[2])
            case "done", "DECIDED" if open_:
                self._change(open_, outcome="resolved", state="MATED")
            case "commit", "PREPARED" if open_:
                self._change(open_, state="MATED")
                if open_.record.state == "MATED":
                    self._send(open_, "done")
            case "commit", None:
                self._say(encounter[0], ["done", list(encounter)])
            case "abort", "PREPARED" if open_:
                self._change(open_, outcome="aborted", state="ABORTED")

    def _proposed_to(
        self,
        message: Message,
        encounter: Encounter,
        open_: Open | None,
        payload: bytes,
        now_s: float,
    ) -> None:
        _, _, nonce, schema, agent, genes = message
        initiator = encounter[0]
        if open_ is not None:  # it is prepared for this one
            self._send(open_, "accept")
            return
        mark = self._records.last_prepared(initiator)
        contact = self._contacts.get(initiator)
        if mark is not None and encounter[2:] <= mark.number:
            self._refuse(encounter, "stale")
            return
        if contact is None or contact.nonce != nonce:
            return
        if schema != self._schema:
            self._refuse(encounter, "schema")
            return
        older = None
        for other in list(self.open.values()):
            if other.record.partner == initiator and other.record.role == "initiator":
                if other.record.state == "PROPOSED" and initiator < self.id:
                    del self.open[
                        other.record.encounter
                    ]  # crossing proposals: it yields to the smaller id
                elif other.record.state == "PROPOSED":
                    return  # the other one yields
                else:
                    self._refuse(encounter, "busy")
                    return
            elif other.record.partner == initiator:
                older = other  # the initiator has given it up, or it would not begin another
        if self._is_engaged(beside=initiator) or len(self.open) >= MOST_OPEN:
            self._refuse(encounter, "busy")
            return
        record = Record(
            encounter, "responder", "PREPARED", nonce, contact.tick, contact.agent, contact.genes
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
        if older is not None:
            del self.open[older.record.encounter]
            self._life.outcome("aborted", replace(older.record, state="ABORTED"))
        del self._contacts[initiator]
        self.open[encounter] = Open(record, now_s, now_s + DOUBT_S, DOUBT_S)
        self._send(self.open[encounter], "accept")

    def _propose(self, partner: bytes, contact: Contact, now_s: float) -> None:
        if self._is_engaged() or self._with(partner) or len(self.open) >= MOST_OPEN:
            return
        contact.has_proposed = True
        self.count += 1
        encounter = (self.id, partner, self._incarnation, self.count)
        record = Record(
            encounter,
            "initiator",
            "PROPOSED",
            contact.nonce,
            contact.tick,
            contact.agent,
            contact.genes,
        )
        self.open[encounter] = Open(record, now_s, now_s + RETRY_S, RETRY_S)
        self._send(self.open[encounter], "propose")

    def _retry(self, open_: Open, now_s: float) -> None:
        open_.retry_s = now_s + open_.interval_s
        open_.interval_s = min(MAX_RETRY_S, 2.0 * open_.interval_s)
        match open_.record.state:
            case "PROPOSED":
                self._send(open_, "propose")
            case "DECIDED":
                self._send(open_, "commit")
            case _:
                if not open_.is_in_doubt:
                    open_.is_in_doubt = True
                    self._life.outcome("doubt", open_.record)
                self._send(open_, "accept")

    def _give_up(self, open_: Open) -> None:
        del self.open[open_.record.encounter]
        self._send(open_, "abort")
        self._life.outcome("expired", open_.record)

    def _change(self, open_: Open, outcome: str = "mated", **fields: object) -> None:
        """The record with these fields, on disk; a failed write leaves the old one.

        With the mating, in the same transaction, this robot decides by itself whether it gets an offspring."""
        old, new = open_.record, replace(open_.record, **fields)  # type: ignore[arg-type]
        mates = (old.state, new.state) in (("PROPOSED", "DECIDED"), ("PREPARED", "MATED"))
        try:
            with self._records.write():
                new.conceived = self._life.conceives(new, self._records) if mates else old.conceived
                self._records.put(new)
        except sqlite3.Error:
            if old.state == "PROPOSED":
                del self.open[old.encounter]
                self._send(open_, "abort")
            return
        open_.record = new
        if new.state in ("MATED", "ABORTED"):
            del self.open[new.encounter]
        self._life.outcome(outcome, copy(new))
        if mates:
            self._life.exchanged(copy(new))

    # What it knows.

    def _with(self, partner: bytes) -> list[Open]:
        return [open_ for open_ in self.open.values() if open_.record.partner == partner]

    def _is_engaged(self, beside: bytes | None = None) -> bool:
        """Rule 2; an encounter with `beside` does not count."""
        return any(
            open_.record.state == "PROPOSED"
            or (open_.record.state == "PREPARED" and not open_.is_in_doubt)
            for open_ in self.open.values()
            if open_.record.partner != beside
        )

    def _is_used(self, encounter: Encounter) -> bool:
        """Whether this robot may have proposed with this number."""
        return encounter[0] == self.id and encounter[2:] <= (self._incarnation, self.count)

    def _is_last_mating(self, encounter: Encounter) -> bool:
        mark = self._records.last_prepared(encounter[0])
        return mark is not None and mark.encounter == encounter and mark.state == "MATED"

    # What it says.

    def _send(self, open_: Open, name: str) -> None:
        record = open_.record
        message: Message = [name, list(record.encounter)]
        if name in ("propose", "accept"):
            message += [record.nonce, self._schema, record.agent, record.genes]
        self._say(record.partner, message)

    def _refuse(self, encounter: Encounter, reason: str) -> None:
        self._say(encounter[0], ["refuse", list(encounter), reason])

    def _say(self, partner: bytes, message: Message) -> None:
        self._send_bytes(partner, seal(self._key, self.text, encode(message)))
