"""What any event does to one robot in any situation, worked out once by the real `MatingStateMachine` and remembered."""

from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from itertools import chain
from operator import methodcaller

from crcolony.protocol.encounters import Effect, EncounterRecord, Offer, OutcomeReport, Send, Write
from crcolony.protocol.envelope import sign_message
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    BY_INITIATOR,
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    MatingMessage,
    Propose,
    Refuse,
    receiver_of,
    sender_of,
)
from tests.support.explored_robot import (
    COLONY,
    KEYS,
    NAMES,
    NOW_S,
    PATIENCE_OVER_S,
    SCHEMA,
    Bounds,
    Caller,
    Decide,
    Disk,
    Kind,
    Node,
    Outcome,
    SentEnvelope,
    Violation,
    forge,
    is_founded,
    named,
    offers,
    snapshot,
    spell,
    spell_effect,
)


class Situations:
    """All situations that single robots were ever in, all letters that were ever said, and what comes of them."""

    def __init__(self, bounds: Bounds, caller: Caller, ignored: frozenset[Kind]) -> None:
        self._bounds, self._caller, self._ignored = bounds, caller, ignored
        self.nodes: list[Node] = []
        self.envelopes: list[SentEnvelope] = []
        self.to = [0] * bounds.robots
        """Of every robot, a bit for every letter to it"""
        self._node_of: dict[Hashable, int] = {}
        self._letter_of: dict[bytes, int] = {}
        self._said_of: dict[MatingMessage, int] = {}
        self._own_moves: dict[int, list[Outcome]] = {}
        self._heard: dict[tuple[int, int], list[Outcome]] = {}
        self._moves: dict[tuple[int, int], list[Outcome]] = {}

    def start(self) -> tuple[int, ...]:
        """Let every robot begin its first life with an empty disk; return their nodes."""
        nodes = []
        for robot in range(self._bounds.robots):
            disk, mating = self._caller.start(KEYS[robot].id, Disk())
            nodes.append(self._intern(Node(robot, mating, disk, ())))
        return tuple(nodes)

    def moves(self, node: int, envelopes: int) -> list[Outcome]:
        """Return all that can happen to a robot to which these letters were said at some time."""
        found = self._moves.get((node, envelopes))
        if found is None:
            sample = (self.on_event(node, k) for k in bits(envelopes))
            found = [*self.spontaneous(node), *chain.from_iterable(sample)]
            found = [o for o in found if o.node != node or o.said or o.violation]
            found = list({(o[:5], o.violation is None): o for o in found[::-1]}.values())
            self._moves[node, envelopes] = found
        return found

    def on_event(self, node: int, envelope: int) -> list[Outcome]:
        found = self._heard.get((node, envelope))
        if found is None:
            said = self.envelopes[envelope]
            forged = "" if said.has_valid_signature else "a forged "
            words = f"hears {forged}{spell(said.message)}"
            found = self._outcomes(node, words, lambda m: self._caller.on_event(m, said.data))
            if not said.has_valid_signature:
                found = [self._judge_forgery(node, outcome) for outcome in found]
            self._heard[node, envelope] = found
        return found

    def _judge_forgery(self, node: int, outcome: Outcome) -> Outcome:
        is_harmless = (outcome.node == node and not outcome.said) or "forged" in self._ignored
        violation = (
            None if is_harmless else Violation("forged", f"{outcome.words}, and believes it")
        )
        return outcome._replace(violation=outcome.violation or violation)

    def spontaneous(self, number: int) -> list[Outcome]:
        """Return all that can happen to a robot without a letter."""
        if number in self._own_moves:
            return self._own_moves[number]
        node = self.nodes[number]
        events: list[tuple[str, Callable[[MatingStateMachine], list[Effect]]]] = []
        for record in node.mating.open:
            e = record.encounter
            events.append((f"reminds of {named(e)}", methodcaller("retry", NOW_S, e)))
            events.append((f"gives {named(e)} up", methodcaller("give_up", NOW_S, e)))
        for peer in (key.id for key in KEYS[: self._bounds.robots]):
            who = NAMES[peer]
            if peer != node.mating.me:
                events.append(
                    (
                        f"is told that {who} is gone",
                        methodcaller("handle_peer_offline", NOW_S, peer),
                    )
                )
                events.append(
                    (f"is told that {who} is back", methodcaller("handle_peer_online", NOW_S, peer))
                )
        events.append(("loses patience", methodcaller("handle_timeouts", PATIENCE_OVER_S)))
        found = list(
            chain.from_iterable(self._outcomes(number, words, event) for words, event in events)
        )
        found += chain.from_iterable(self._meetings(number))
        found.append(self._crashed(node, node.disk, 0, "crashes and starts again"))
        self._own_moves[number] = found
        return found

    def _meetings(self, number: int) -> Iterable[list[Outcome]]:
        node = self.nodes[number]
        for nonce, pair in enumerate(self._bounds.contacts, 1):
            is_again = nonce in node.message
            if node.robot not in pair or (node.message and nonce < max(node.message)):
                continue
            peer = KEYS[sum(pair) - node.robot].id
            message = node._replace(message=(*node.message, nonce))
            own = offers(message, nonce)[-1]
            words = f"meets {NAMES[peer]} (nonce {nonce}{', again' if is_again else ''})"
            yield [
                outcome._replace(repeats=int(is_again))
                for outcome in self._outcomes(
                    number,
                    words,
                    methodcaller("handle_contact", NOW_S, peer, nonce, own, nonce),
                    message,
                )
            ]

    def _outcomes(
        self,
        number: int,
        words: str,
        event: Callable[[MatingStateMachine], list[Effect]],
        node: Node | None = None,
    ) -> list[Outcome]:
        """Return what an event does: as it should, with a crash between any two effects, with a write refused."""
        node = node or self.nodes[number]
        mating = node.mating.copy()
        try:
            effects = list(self._caller.in_order(event(mating)))
        except Exception as error:
            violation = Violation("error", f"{type(error).__name__}: {error}")
            return [Outcome(number, 0, 0, 0, 0, self._tell(node, words), violation)]
        plans: list[tuple[MatingStateMachine, list[Effect | Decide], int, str]] = [
            (mating, effects, 0, words)
        ]
        for k, effect in enumerate(effects):
            if isinstance(effect, Write) and self._bounds.refusals:
                undone = mating.copy()
                rest = self._caller.refused(undone, effect)
                plans.append((undone, [*effects[:k], *rest], 1, f"{words}; its disk is full"))
        found = []
        for after, todo, refusals, text in plans:
            found.append(self._carried_out(node._replace(mating=after), todo, refusals, text))
            for k in range(refusals == 0, len(todo)) if self._bounds.crashes else ():
                found.append(self._cut_short(node, todo, k, refusals, text))
        return found

    def _carried_out(
        self, node: Node, effects: list[Effect | Decide], refusals: int, words: str
    ) -> Outcome:
        words = self._tell(node, words)
        try:
            disk, said = self._carry_out(node, effects)
        except Violation as violation:
            return Outcome(self._intern(node), 0, 0, refusals, 0, words, violation)
        return Outcome(self._intern(node._replace(disk=disk)), said, 0, refusals, 0, words)

    def _cut_short(
        self, node: Node, effects: list[Effect | Decide], k: int, refusals: int, words: str
    ) -> Outcome:
        text = ", ".join(map(spell_effect, effects[:k])) or "nothing"
        words = f"{words}; {text}; then crashes and starts again"
        try:
            disk, said = self._carry_out(node, effects[:k])
        except Violation as violation:
            words = self._tell(node, words)
            return Outcome(self._intern(node), 0, 1, refusals, 0, words, violation)
        return self._crashed(node, disk, said, words)._replace(refusals=refusals)

    def _crashed(self, node: Node, disk: Disk, said: int, words: str) -> Outcome:
        violation = self._lost_decision(disk)
        disk, mating = self._caller.start(node.mating.me, disk)
        after = self._intern(node._replace(mating=mating, disk=disk))
        return Outcome(after, said, 1, 0, 0, self._tell(node, words), violation)

    def _tell(self, node: Node, words: str) -> str:
        return f"{NAMES[node.mating.me]} {words}"

    # What an effect does, and what it must not -------------------------------------------------------------------

    def _carry_out(self, node: Node, effects: Iterable[Effect | Decide]) -> tuple[Disk, int]:
        disk, said = node.disk, 0
        for effect in effects:
            match effect:
                case Write():
                    names = {record.encounter for record in effect.records}
                    kept = (r for r in disk.records if r.encounter not in names)
                    disk = replace(disk, records=frozenset((*kept, *effect.records)))
                    if effect.decided and not self._caller.decides_apart:
                        disk = self._decide(node, disk, effect.decided)
                case Decide():
                    disk = self._decide(node, disk, effect.record)
                case Send():
                    if not is_founded(disk, effect.message):
                        self._fail("said too early", f"{spell(effect.message)} is not on disk")
                    said |= self._print_line(node, effect)
                case OutcomeReport():
                    pass
        return disk, said

    def _decide(self, node: Node, disk: Disk, record: EncounterRecord) -> Disk:
        """Check promises 2 and 3 at the moment at which a robot decides about offspring."""
        label = named(record.encounter)
        nonces = [r.nonce for r in disk.records if r.encounter in disk.decisions]
        if record.encounter in disk.decisions:
            self._fail("decided twice", f"{NAMES[node.mating.me]} for {label}")
        if record.nonce in nonces and not self._bounds.repeats:
            self._fail("decided twice", f"{NAMES[node.mating.me]} for nonce {record.nonce}")
        number = self._letter_of.get(record.proof)
        proof = self.envelopes[number] if number is not None else None
        if proof is None or not proof.has_valid_signature:
            self._fail("forged", f"{label} has no proof")
        elif not isinstance(proof.message, Propose | Accept):
            self._fail("wrong genes", f"{label} is proved by {spell(proof.message)}")
        else:
            said = proof.message
            if (said.encounter, sender_of(said)) != (record.encounter, record.peer):
                self._fail("wrong genes", f"{label} is proved by a letter of {spell(said)}")
            if record.partner != Offer(said.agent, said.genes):
                self._fail(
                    "wrong genes", f"{label} with {record.partner}, but {said.agent} is signed"
                )
            if said.nonce not in node.message:
                self._fail("no contact", f"{label} has nonce {said.nonce}, which no body reported")
            if record.own not in offers(node, said.nonce):
                self._fail(
                    "wrong genes", f"{label} with {record.own}, not in control at that contact"
                )
        return replace(disk, decisions=disk.decisions | {record.encounter})

    def _lost_decision(self, disk: Disk) -> Violation | None:
        for record in disk.records:
            is_mating = record.state in ("decided", "mated")
            is_lost = is_mating and record.encounter not in disk.decisions
            if is_lost and "no decision" not in self._ignored:
                return Violation("no decision", f"{named(record.encounter)} is {record.state}")
        return None

    def _fail(self, kind: Kind, text: str) -> None:
        if kind not in self._ignored:
            raise Violation(kind, text)

    def _print_line(self, node: Node, send: Send) -> int:
        message = send.message
        if message not in self._said_of:
            if send.to != receiver_of(message) or node.mating.me == send.to:
                self._fail("error", f"{spell(message)} is sent to {NAMES.get(send.to)}")
            data = sign_message(message, COLONY, KEYS[node.robot])
            self._said_of[message] = 1 << self._post(message, data, has_valid_signature=True)
        return self._said_of[message]

    def _post(self, message: MatingMessage, data: bytes, has_valid_signature: bool) -> int:
        to = [key.id for key in KEYS].index(receiver_of(message))
        number = len(self.envelopes)
        self.envelopes.append(SentEnvelope(to, data, message, has_valid_signature))
        self._letter_of[data] = number
        self.to[to] |= 1 << number
        return number

    def forged(self) -> int:
        """Say whatever an outsider may try who knows all but a robot's secret key; and what is of another colony."""
        said, genes = 0, b"forged!!"
        for one, other in dict.fromkeys(self._bounds.contacts):
            for a, b in ((one, other), (other, one)):
                e = Encounter(KEYS[a].id, KEYS[b].id, 1, 1)
                propose = Propose(e, 1, SCHEMA, "forged", genes)
                accept = Accept(e, 1, SCHEMA, "forged", genes)
                for message in (propose, accept, Refuse(e, "busy"), Commit(e), Abort(e), Done(e)):
                    owner = KEYS[a if isinstance(message, BY_INITIATOR) else b]
                    said |= 1 << self._post(
                        message, forge(message, owner), has_valid_signature=False
                    )
                stolen = sign_message(propose, "another", KEYS[a])
                said |= 1 << self._post(propose, stolen, has_valid_signature=False)
        return said

    def _intern(self, node: Node) -> int:
        key = (node.robot, snapshot(node.mating), node.disk, node.message)
        number = self._node_of.setdefault(key, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
        return number


def bits(mask: int) -> Iterable[int]:
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest
