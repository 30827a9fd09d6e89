"""Mating state machines with one wrong transition or rule each: what checks the protocol must notice each."""

import msgspec

from crcolony.protocol.encounters import Effect, Offer, Send
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Abort,
    Accept,
    Commit,
    Encounter,
    MatingMessage,
    Propose,
    Refuse,
)
from crcolony.protocol.open_encounters import OpenEncounter


class IgnoresMarks(MatingStateMachine):
    """Accepts a Propose whatever marks its initiator has left."""

    def _on_propose(self, now_s: float, message: Propose, envelope: bytes) -> list[Effect]:
        self._marks.prepared.clear()
        return super()._on_propose(now_s, message, envelope)


class GuessesCommit(MatingStateMachine):
    """Mates when the initiator of what it is prepared for is silent."""

    def give_up(self, now_s: float, encounter: Encounter) -> list[Effect]:
        entry = self._open[encounter]
        if entry.record.state == "prepared":
            return self._on_commit(encounter, entry)
        return super().give_up(now_s, encounter)


class GuessesAbort(MatingStateMachine):
    """Aborts what it is prepared for when the initiator is silent."""

    def give_up(self, now_s: float, encounter: Encounter) -> list[Effect]:
        entry = self._open[encounter]
        if entry.record.state == "prepared":
            return self._close(entry, "aborted", "aborted")
        return super().give_up(now_s, encounter)


class GivesUpDecided(MatingStateMachine):
    """Aborts what it has decided when the responder is silent."""

    def give_up(self, now_s: float, encounter: Encounter) -> list[Effect]:
        entry = self._open[encounter]
        if entry.record.state == "decided":
            abort = Send(encounter.responder, Abort(encounter))
            return [*self._close(entry, "aborted", "aborted"), abort]
        return super().give_up(now_s, encounter)


class PresumesCommit(MatingStateMachine):
    """Answers the accept of an unknown encounter with a commit."""

    def _on_accept(
        self, now_s: float, message: Accept, envelope: bytes, entry: OpenEncounter | None
    ) -> list[Effect]:
        if entry is None:
            return [Send(message.encounter.responder, Commit(message.encounter))]
        return super()._on_accept(now_s, message, envelope, entry)


class PresumesNothing(MatingStateMachine):
    """Does not answer the accept of an unknown encounter."""

    def _on_accept(
        self, now_s: float, message: Accept, envelope: bytes, entry: OpenEncounter | None
    ) -> list[Effect]:
        if entry is None:
            return []
        return super()._on_accept(now_s, message, envelope, entry)


class IgnoresNonce(MatingStateMachine):
    """Accepts a genotype that quotes another contact's nonce."""

    def expects(self, message: MatingMessage) -> bool:
        if isinstance(message, Propose) and message.encounter.responder == self.me:
            return self._nonce_with(message.encounter.initiator) is not None
        return super().expects(message)

    def _on_accept(
        self, now_s: float, message: Accept, envelope: bytes, entry: OpenEncounter | None
    ) -> list[Effect]:
        nonce = entry.record.nonce if entry else message.nonce
        message = msgspec.structs.replace(message, nonce=nonce)
        return super()._on_accept(now_s, message, envelope, entry)


class ForgetsUnacknowledged(MatingStateMachine):
    """Proposes to a robot that has not acknowledged the last mating; that robot then aborts the older one."""

    def _may_propose(self, peer: RobotId) -> bool:
        return not self.is_engaged and self._open.record_of(peer, "proposed") is None


class AppliesLateRefusal(MatingStateMachine):
    """Aborts what it has decided when a refusal arrives late."""

    def handle_message(self, now_s: float, message: MatingMessage, envelope: bytes) -> list[Effect]:
        entry = self._open.get(message.encounter)
        if isinstance(message, Refuse) and entry and entry.record.state == "decided":
            return self._close(entry, "aborted", "aborted")
        return super().handle_message(now_s, message, envelope)


class IgnoresAbort(MatingStateMachine):
    """Stays prepared for what the initiator has aborted."""

    def expects(self, message: MatingMessage) -> bool:
        return not isinstance(message, Abort) and super().expects(message)


class OffersAgentOfOlderContact(MatingStateMachine):
    """Offers the agent of an older contact than the one whose nonce is quoted."""

    def handle_contact(
        self, now_s: float, peer: RobotId, nonce: int, own: Offer, tick: int
    ) -> list[Effect]:
        older = self._contacts.get(peer)
        return super().handle_contact(now_s, peer, nonce, older.own if older else own, tick)


class AcknowledgesSilently(MatingStateMachine):
    """Mates without sending Done."""

    def _on_commit(self, encounter: Encounter, entry: OpenEncounter | None) -> list[Effect]:
        return super()._on_commit(encounter, entry)[:-1]
