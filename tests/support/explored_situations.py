"""What every event does to one robot in every situation, computed once by the real state machine and cached."""

from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from itertools import chain
from operator import methodcaller

from crcolony.protocol.encounters import Effect, EncounterRecord, Offer, OutcomeReport, Send, Write
from crcolony.protocol.mating import MatingStateMachine
from crcolony.protocol.mating_messages import (
    Accept,
    Propose,
    receiver_of,
    sender_of,
)
from tests.support.explored_envelopes import ExploredEnvelopes, bits
from tests.support.explored_robot import (
    KEYS,
    NAMES,
    NOW_S,
    PATIENCE_OVER_S,
    Bounds,
    Caller,
    Decide,
    Disk,
    Kind,
    Node,
    Step,
    Violation,
    format_effect,
    format_encounter,
    format_message,
    may_send,
    offers,
    snapshot,
)


class Situations:
    """All situations of single robots, all envelopes that were ever sent, and the steps that follow from them."""

    def __init__(self, bounds: Bounds, caller: Caller, ignored: frozenset[Kind]) -> None:
        self._bounds, self._caller, self._ignored = bounds, caller, ignored
        self.nodes: list[Node] = []
        self.envelopes = ExploredEnvelopes()
        self._node_of: dict[Hashable, int] = {}
        self._own_moves: dict[int, list[Step]] = {}
        self._received: dict[tuple[int, int], list[Step]] = {}
        self._moves: dict[tuple[int, int], list[Step]] = {}

    def start(self) -> tuple[int, ...]:
        """Start every robot with an empty disk; return their nodes."""
        nodes = []
        for robot in range(self._bounds.robots):
            disk, mating = self._caller.start(KEYS[robot].id, Disk())
            nodes.append(self._intern(Node(robot, mating, disk, ())))
        return tuple(nodes)

    def moves(self, node: int, envelopes: int) -> list[Step]:
        """Return all steps of a robot to which these envelopes were sent at some time."""
        found = self._moves.get((node, envelopes))
        if found is None:
            received = (self.receive(node, k) for k in bits(envelopes))
            found = [*self.spontaneous(node), *chain.from_iterable(received)]
            found = [o for o in found if o.node != node or o.sent or o.violation]
            found = list({(o[:5], o.violation is None): o for o in found[::-1]}.values())
            self._moves[node, envelopes] = found
        return found

    def receive(self, node: int, envelope: int) -> list[Step]:
        """Return the steps in which a robot receives an envelope."""
        found = self._received.get((node, envelope))
        if found is None:
            sent = self.envelopes[envelope]
            forged = "" if sent.has_valid_signature else "a forged "
            text = f"receives {forged}{format_message(sent.message)}"
            found = self._steps(node, text, lambda m: self._caller.handle_envelope(m, sent.data))
            if not sent.has_valid_signature:
                found = [self._judge_forgery(node, step) for step in found]
            self._received[node, envelope] = found
        return found

    def _judge_forgery(self, node: int, step: Step) -> Step:
        is_harmless = (step.node == node and not step.sent) or "forged" in self._ignored
        violation = None if is_harmless else Violation("forged", f"{step.text}, and acts on it")
        return step._replace(violation=step.violation or violation)

    def spontaneous(self, number: int) -> list[Step]:
        """Return all steps of a robot without an envelope."""
        if number in self._own_moves:
            return self._own_moves[number]
        node = self.nodes[number]
        events: list[tuple[str, Callable[[MatingStateMachine], list[Effect]]]] = []
        for record in node.mating.open:
            e = record.encounter
            events.append((f"retries {format_encounter(e)}", methodcaller("retry", NOW_S, e)))
            events.append((f"gives up {format_encounter(e)}", methodcaller("give_up", NOW_S, e)))
        for peer in (key.id for key in KEYS[: self._bounds.robots]):
            if peer != node.mating.me:
                for state in ("offline", "online"):
                    event = methodcaller(f"handle_peer_{state}", NOW_S, peer)
                    events.append((f"sees {NAMES[peer]} {state}", event))
        events.append(("waits for patience_s", methodcaller("handle_timeouts", PATIENCE_OVER_S)))
        found = list(
            chain.from_iterable(self._steps(number, text, event) for text, event in events)
        )
        found += chain.from_iterable(self._contacts(number))
        found.append(self._crashed(node, node.disk, 0, "crashes and restarts"))
        if self._bounds.has_backups:
            found.append(self._backed_up(node))
        self._own_moves[number] = found
        return found

    def _contacts(self, number: int) -> Iterable[list[Step]]:
        node = self.nodes[number]
        for nonce, pair in enumerate(self._bounds.contacts, 1):
            is_again = nonce in node.contacts
            if node.robot not in pair or (node.contacts and nonce < max(node.contacts)):
                continue
            peer = KEYS[sum(pair) - node.robot].id
            after = node._replace(contacts=(*node.contacts, nonce))
            own = offers(after, nonce)[-1]
            text = f"meets {NAMES[peer]} (nonce {nonce}{', again' if is_again else ''})"
            yield [
                step._replace(repeats=int(is_again))
                for step in self._steps(
                    number,
                    text,
                    methodcaller("handle_contact", NOW_S, peer, nonce, own, nonce),
                    after,
                )
            ]

    def _steps(
        self,
        number: int,
        text: str,
        event: Callable[[MatingStateMachine], list[Effect]],
        node: Node | None = None,
    ) -> list[Step]:
        """Return the steps of an event: complete, with a crash between any two effects, and with a failed write."""
        node = node or self.nodes[number]
        mating = node.mating.copy()
        try:
            effects = list(self._caller.in_order(event(mating)))
        except Exception as error:
            violation = Violation("error", f"{type(error).__name__}: {error}")
            return [Step(number, 0, 0, 0, 0, self._format(node, text), violation)]
        plans: list[tuple[MatingStateMachine, list[Effect | Decide], int, str]] = [
            (mating, effects, 0, text)
        ]
        for k, effect in enumerate(effects):
            if isinstance(effect, Write) and self._bounds.failed_writes:
                undone = mating.copy()
                rest = self._caller.handle_failed_write(undone, effect)
                plans.append((undone, [*effects[:k], *rest], 1, f"{text}; its disk is full"))
        found = []
        for after, todo, failed_writes, text in plans:
            found.append(self._carried_out(node._replace(mating=after), todo, failed_writes, text))
            for k in range(failed_writes == 0, len(todo)) if self._bounds.crashes else ():
                found.append(self._cut_short(node, todo, k, failed_writes, text))
        return found

    def _carried_out(
        self, node: Node, effects: list[Effect | Decide], failed_writes: int, text: str
    ) -> Step:
        text = self._format(node, text)
        try:
            disk, sent = self._carry_out(node, effects)
        except Violation as violation:
            return Step(self._intern(node), 0, 0, failed_writes, 0, text, violation)
        return Step(self._intern(node._replace(disk=disk)), sent, 0, failed_writes, 0, text)

    def _cut_short(
        self, node: Node, effects: list[Effect | Decide], k: int, failed_writes: int, text: str
    ) -> Step:
        done = ", ".join(map(format_effect, effects[:k])) or "nothing"
        text = f"{text}; {done}; then crashes and restarts"
        try:
            disk, sent = self._carry_out(node, effects[:k])
        except Violation as violation:
            text = self._format(node, text)
            return Step(self._intern(node), 0, 1, failed_writes, 0, text, violation)
        return self._crashed(node, disk, sent, text)._replace(failed_writes=failed_writes)

    def _crashed(self, node: Node, disk: Disk, sent: int, text: str) -> Step:
        violation = self._lost_decision(disk)
        disk, mating = self._caller.start(node.mating.me, disk)
        after = self._intern(node._replace(mating=mating, disk=disk))
        return Step(after, sent, 1, 0, 0, self._format(node, text), violation)

    def _backed_up(self, node: Node) -> Step:
        """Return the step in which a robot's disk is copied, or in which it starts again from that copy."""
        me = node.mating.me
        if node.backup is None:
            after = self._intern(node._replace(backup=node.disk))
            return Step(after, 0, 0, 0, 0, self._format(node, "is backed up"))
        disk, mating = self._caller.start_from_backup(me, node.disk, node.backup)
        after = self._intern(node._replace(mating=mating, disk=disk))
        return Step(after, 0, 1, 0, 0, self._format(node, "is restored from its backup"))

    def _format(self, node: Node, text: str) -> str:
        return f"{NAMES[node.mating.me]} {text}"

    # Effects, and what they must not do ---------------------------------------------------------------------------

    def _carry_out(self, node: Node, effects: Iterable[Effect | Decide]) -> tuple[Disk, int]:
        disk, sent = node.disk, 0
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
                    if not may_send(disk, effect.message):
                        self._fail(
                            "sent too early", f"{format_message(effect.message)} is not on disk"
                        )
                    sent |= self._send(node, effect)
                case OutcomeReport():
                    pass
        return disk, sent

    def _decide(self, node: Node, disk: Disk, record: EncounterRecord) -> Disk:
        """Check what must hold when a robot decides about offspring."""
        label = format_encounter(record.encounter)
        nonces = [r.nonce for r in disk.records if r.encounter in disk.decisions]
        if record.encounter in disk.decisions | disk.lost:
            self._fail("decided twice", f"{NAMES[node.mating.me]} for {label}")
        if record.nonce in nonces and not self._bounds.repeats:
            self._fail("decided twice", f"{NAMES[node.mating.me]} for nonce {record.nonce}")
        proof = self.envelopes.with_data(record.proof)
        if proof is None or not proof.has_valid_signature:
            self._fail("forged", f"{label} has no proof")
        elif not isinstance(proof.message, Propose | Accept):
            self._fail("wrong genes", f"{label} is proved by {format_message(proof.message)}")
        else:
            sent = proof.message
            if (sent.encounter, sender_of(sent)) != (record.encounter, record.peer):
                self._fail(
                    "wrong genes", f"{label} is proved by an envelope with {format_message(sent)}"
                )
            if record.partner != Offer(sent.agent, sent.genes):
                self._fail(
                    "wrong genes", f"{label} with {record.partner}, but {sent.agent} is signed"
                )
            if sent.nonce not in node.contacts:
                self._fail(
                    "no contact", f"{label} has nonce {sent.nonce}, which no body has reported"
                )
            if record.own not in offers(node, sent.nonce):
                self._fail(
                    "wrong genes", f"{label} with {record.own}, not in control at that contact"
                )
        return replace(disk, decisions=disk.decisions | {record.encounter})

    def _lost_decision(self, disk: Disk) -> Violation | None:
        for record in disk.records:
            is_mating = record.state in ("decided", "mated")
            is_lost = is_mating and record.encounter not in disk.decisions
            if is_lost and "no decision" not in self._ignored:
                return Violation(
                    "no decision", f"{format_encounter(record.encounter)} is {record.state}"
                )
        return None

    def _fail(self, kind: Kind, text: str) -> None:
        if kind not in self._ignored:
            raise Violation(kind, text)

    def _send(self, node: Node, send: Send) -> int:
        message = send.message
        if send.to != receiver_of(message) or node.mating.me == send.to:
            self._fail("error", f"{format_message(message)} is sent to {NAMES.get(send.to)}")
        return self.envelopes.send(message, node.robot)

    def _intern(self, node: Node) -> int:
        key = (node.robot, snapshot(node.mating), node.disk, node.contacts, node.backup)
        number = self._node_of.setdefault(key, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
        return number
