"""Drives the real `Mating` of two or three robots through every order of events and looks for a broken promise.

One state of the exploration is: every robot (its `Mating`, its disk, what its body told it), every letter that was ever
said, and how many faults have happened. A step is one of

    a robot hears any letter that was ever said to it      so loss, delay, reordering, duplication and replay of genuine
                                                           letters have no bound: a lost letter is one never heard
    a robot hears a forged letter                          with its sender's key, but not its signature
    a body reports a contact                               to each side by itself, perhaps to one only
    a robot reminds, gives up, or loses patience           at any time, any number of times
    a robot is told that another is gone or back           at any time, rightly or not
    a robot crashes and starts again (a new life)          between any two effects, up to a bound
    a disk refuses a write                                 up to a bound
    a body reports a contact that it reported before       up to a bound

The search is breadth-first, so that a counterexample is a shortest one; it is told as steps in words. In every state,
both disks must agree, and with no more faults, reminding each other must leave nothing open (`_settle`).

What is abstracted. Times: every deadline is a step that may come at any moment, so an order of events that real
deadlines forbid is explored too; a contact that expires is one whose partner is gone. A robot is down for no time: what
is said to it meanwhile is heard later or never. A robot carries out the effects of one event without hearing another's
steps in between; that changes nothing, for the others see only what is sent, and a crash may fall between any two
effects. A write is all or nothing, as SQLite promises. Every decision to mate is counted, whether an offspring comes of
it is the robot's own affair. Robots lie about nothing they sign.
"""

import gc
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from operator import methodcaller
from typing import Literal, NamedTuple, get_args

from crcolony.colony import messages
from crcolony.colony.identity import Identity, RobotId, seeded
from crcolony.colony.mating import Effect, Limits, Mating, Note, Offer, Record, Send, Write
from crcolony.colony.messages import Abort, Accept, Commit, Done, Encounter, Propose, Refuse

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
LIMITS = Limits(
    contact_s=1e6, patience_s=1.0, propose_s=1e6, retry_s=1e6, doubt_s=1e6, longest_retry_s=1e6,
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

    life: int = 0
    records: frozenset[Record] = frozenset()
    decisions: frozenset[Encounter] = frozenset()

    def find(self, encounter: Encounter) -> Record | None:
        """Return the latest record of an encounter."""
        return next((r for r in self.records if r.encounter == encounter), None)

    def state_of(self, encounter: Encounter) -> str:
        """Return the state of an encounter, "" if nothing is known of it."""
        record = self.find(encounter)
        return record.state if record else ""


@dataclass(frozen=True)
class Decide:
    """An effect of sabotaged callers only: decide about offspring, outside the write's transaction."""

    record: Record


class Caller:
    """The part of a robot around its `Mating`, done right; sabotaged variants override it."""

    mating = Mating
    decides_apart = False

    def start(self, me: RobotId, disk: Disk) -> tuple[Disk, Mating]:
        """A process begins: a new life is on disk before anything is said, then what is open is taken up."""
        disk = replace(disk, life=disk.life + 1)
        return disk, self.restored(me, disk)

    def restored(self, me: RobotId, disk: Disk) -> Mating:
        """Return the mating that goes on from a disk."""
        mating = self.mating(me, disk.life, SCHEMA, LIMITS)
        open_records = (r for r in disk.records if self.is_open(r))
        mating.restore(NOW_S, sorted(open_records, key=lambda r: r.encounter.number), marks(disk))
        return mating

    def is_open(self, record: Record) -> bool:
        """Tell whether a record on disk still waits for the partner."""
        return (record.role, record.state) in (("initiator", "decided"), ("responder", "prepared"))

    def hear(self, mating: Mating, data: bytes) -> list[Effect]:
        """A letter comes in."""
        try:
            letter, message = messages.open_letter(data)
        except messages.WireError:
            return []
        if not mating.expects(message) or not self.is_genuine(letter):
            return []
        return mating.receive(NOW_S, message, data)

    def is_genuine(self, letter: messages.Letter) -> bool:
        """Tell whether its sender signed a letter."""
        return messages.is_genuine(letter, COLONY)

    def in_order(self, effects: Sequence[Effect]) -> Sequence[Effect | Decide]:
        """Return effects in the order in which they are carried out."""
        return effects

    def refused(self, mating: Mating, write: Write) -> list[Effect]:
        """The disk did not take a write."""
        return mating.undo(NOW_S, write)


def marks(disk: Disk) -> dict[RobotId, tuple[tuple[int, int], bool]]:
    """Return what a robot as a responder knows of every initiator: its last number, and whether that one mated."""
    last: dict[RobotId, Record] = {}
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
    mating: Mating
    disk: Disk
    told: tuple[int, ...]
    """The nonces of all contacts that its body reported"""


class Letter(NamedTuple):
    """Something that was said."""

    to: int
    data: bytes
    message: messages.Mating
    is_genuine: bool


State = tuple[int, ...]
"""The node of every robot, the letters ever said, then how many crashes, refusals and repeats there were."""


@dataclass(frozen=True)
class Report:
    """What an exploration found."""

    states: int
    situations: int
    """Of single robots, in which the real `Mating` was driven"""
    matings: int
    """States in which a mating is complete on both disks: proof that the exploration gets anywhere"""
    violation: Violation | None = None
    steps: tuple[str, ...] = ()

    def __str__(self) -> str:
        if self.violation is None:
            return f"{self.states} states, {self.situations} situations of a robot: no violation"
        lines = [f"{k}. {step}" for k, step in enumerate(self.steps, 1)]
        return "\n".join([f"after {len(lines)} steps, {self.violation}", *lines])


def explore(bounds: Bounds, caller: Caller | None = None, only: Kind | None = None) -> Report:
    """Visit every state within bounds, or stop at the first violation (of this kind, if one is named)."""
    ignored = frozenset(get_args(Kind)) - {only, "error"} if only else frozenset()
    return Explorer(bounds, caller or Caller(), ignored).run()


class Explorer:
    """One exploration. What an event does to one robot is worked out once, by the real `Mating`, and remembered."""

    def __init__(self, bounds: Bounds, caller: Caller, ignored: frozenset[Kind]) -> None:
        self._bounds, self._caller, self._ignored = bounds, caller, ignored
        self._nodes: list[Node] = []
        self._node_of: dict[Hashable, int] = {}
        self._letters: list[Letter] = []
        self._letter_of: dict[bytes, int] = {}
        self._said_of: dict[messages.Mating, int] = {}
        self._to = [0] * bounds.robots
        self._own_moves: dict[int, list[Outcome]] = {}
        self._heard: dict[tuple[int, int], list[Outcome]] = {}
        self._moves: dict[tuple[int, int], list[Outcome]] = {}
        self._agreed: set[tuple[int, int]] = set()
        self._settled: dict[State, Violation | None] = {}
        self._settling: list[str] = []

    def run(self) -> Report:
        """Search breadth-first."""
        gc.disable()  # it would visit every state again and again, and find no cycles
        try:
            return self._search()
        finally:
            gc.enable()

    def _search(self) -> Report:
        robots, mates = self._bounds.robots, 0
        first = (*self._start(), self._forged(), 0, 0, 0)
        came_from: dict[State, tuple[State, Outcome] | None] = {first: None}
        queue = deque([first])
        while queue:
            state = queue.popleft()
            violation = self._check(state[:robots])
            if violation is not None:
                return self._report(came_from, state, violation, mates, self._settling)
            mates += self._is_mated(state[:robots])
            for after, outcome in self._successors(state):
                if outcome.violation is not None:
                    return self._report(came_from, state, outcome.violation, mates, [outcome.words])
                if after not in came_from:
                    came_from[after] = (state, outcome)
                    queue.append(after)
        return Report(len(came_from), len(self._nodes), mates)

    def _start(self) -> State:
        nodes = []
        for robot in range(self._bounds.robots):
            disk, mating = self._caller.start(KEYS[robot].id, Disk())
            nodes.append(self._intern(Node(robot, mating, disk, ())))
        return tuple(nodes)

    def _successors(self, state: State) -> list[tuple[State, Outcome]]:
        robots, bounds = self._bounds.robots, self._bounds
        said, crashes, refusals, repeats = state[robots:]
        found = []
        for robot in range(robots):
            for outcome in self._all_moves(state[robot], said & self._to[robot]):
                used = (
                    crashes + outcome.crashes,
                    refusals + outcome.refusals,
                    repeats + outcome.repeats,
                )
                if (
                    used[0] > bounds.crashes
                    or used[1] > bounds.refusals
                    or used[2] > bounds.repeats
                ):
                    continue
                after = (
                    *state[:robot], outcome.node, *state[robot + 1 : robots],
                    said | outcome.said, *used,
                )  # fmt: skip
                found.append((after, outcome))
        return found

    def _report(
        self,
        came_from: dict[State, tuple[State, Outcome] | None],
        last: State,
        violation: Violation,
        matings: int,
        then: Sequence[str],
    ) -> Report:
        steps = list(reversed(then))
        step = came_from[last]
        while step is not None:
            state, outcome = step
            steps.append(outcome.words)
            step = came_from[state]
        return Report(len(came_from), len(self._nodes), matings, violation, tuple(reversed(steps)))

    # What an event does to one robot ---------------------------------------------------------------------------

    def _all_moves(self, node: int, letters: int) -> list[Outcome]:
        """Return all that can happen to a robot to which these letters were said at some time."""
        found = self._moves.get((node, letters))
        if found is None:
            heard = (self._hear(node, k) for k in _bits(letters))
            found = [*self._spontaneous(node), *chain.from_iterable(heard)]
            found = [o for o in found if o.node != node or o.said or o.violation]
            found = list({o[:5]: o for o in reversed(found)}.values())
            self._moves[node, letters] = found
        return found

    def _hear(self, node: int, letter: int) -> list[Outcome]:
        found = self._heard.get((node, letter))
        if found is None:
            said = self._letters[letter]
            forged = "" if said.is_genuine else "a forged "
            words = f"hears {forged}{_words(said.message)}"
            found = self._outcomes(node, words, lambda m: self._caller.hear(m, said.data))
            if not said.is_genuine:
                found = [self._judge_forgery(node, outcome) for outcome in found]
            self._heard[node, letter] = found
        return found

    def _judge_forgery(self, node: int, outcome: Outcome) -> Outcome:
        is_harmless = (outcome.node == node and not outcome.said) or "forged" in self._ignored
        violation = (
            None if is_harmless else Violation("forged", f"{outcome.words}, and believes it")
        )
        return outcome._replace(violation=outcome.violation or violation)

    def _spontaneous(self, number: int) -> list[Outcome]:
        """Return all that can happen to a robot without a letter."""
        if number in self._own_moves:
            return self._own_moves[number]
        node = self._nodes[number]
        events: list[tuple[str, Callable[[Mating], list[Effect]]]] = []
        for record in node.mating.open:
            e = record.encounter
            events.append((f"reminds of {_label(e)}", methodcaller("remind", NOW_S, e)))
            events.append((f"gives {_label(e)} up", methodcaller("give_up", NOW_S, e)))
        for peer in (key.id for key in KEYS[: self._bounds.robots]):
            who = NAMES[peer]
            if peer != node.mating.me:
                events.append(
                    (f"is told that {who} is gone", methodcaller("partner_is_gone", NOW_S, peer))
                )
                events.append(
                    (f"is told that {who} is back", methodcaller("partner_is_back", NOW_S, peer))
                )
        events.append(("loses patience", methodcaller("tick", PATIENCE_OVER_S)))
        found = list(
            chain.from_iterable(self._outcomes(number, words, event) for words, event in events)
        )
        found += chain.from_iterable(self._meetings(number))
        found.append(self._crashed(node, node.disk, 0, "crashes and starts again"))
        self._own_moves[number] = found
        return found

    def _meetings(self, number: int) -> Iterable[list[Outcome]]:
        node = self._nodes[number]
        for nonce, pair in enumerate(self._bounds.contacts, 1):
            is_again = nonce in node.told
            if node.robot not in pair or (node.told and nonce < max(node.told)):
                continue
            peer = KEYS[sum(pair) - node.robot].id
            told = node._replace(told=(*node.told, nonce))
            own = _offers(told, nonce)[-1]
            words = f"meets {NAMES[peer]} (nonce {nonce}{', again' if is_again else ''})"
            yield [
                outcome._replace(repeats=int(is_again))
                for outcome in self._outcomes(
                    number,
                    words,
                    methodcaller("meet", NOW_S, peer, nonce, own, nonce),
                    told,
                )
            ]

    def _outcomes(
        self,
        number: int,
        words: str,
        event: Callable[[Mating], list[Effect]],
        node: Node | None = None,
    ) -> list[Outcome]:
        """Return what an event does: as it should, with a crash between any two effects, with a write refused."""
        node = node or self._nodes[number]
        mating = node.mating.copy()
        try:
            effects = list(self._caller.in_order(event(mating)))
        except Exception as error:
            violation = Violation("error", f"{type(error).__name__}: {error}")
            return [Outcome(number, 0, 0, 0, 0, self._tell(node, words), violation)]
        plans: list[tuple[Mating, list[Effect | Decide], int, str]] = [(mating, effects, 0, words)]
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
        text = ", ".join(map(_effect_words, effects[:k])) or "nothing"
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
                    if not _is_founded(disk, effect.message):
                        self._fail("said too early", f"{_words(effect.message)} is not on disk")
                    said |= self._say(node, effect)
                case Note():
                    pass
        return disk, said

    def _decide(self, node: Node, disk: Disk, record: Record) -> Disk:
        """Check promises 2 and 3 at the moment at which a robot decides about offspring."""
        label = _label(record.encounter)
        nonces = [r.nonce for r in disk.records if r.encounter in disk.decisions]
        if record.encounter in disk.decisions:
            self._fail("decided twice", f"{NAMES[node.mating.me]} for {label}")
        if record.nonce in nonces and not self._bounds.repeats:
            self._fail("decided twice", f"{NAMES[node.mating.me]} for nonce {record.nonce}")
        number = self._letter_of.get(record.proof)
        proof = self._letters[number] if number is not None else None
        if proof is None or not proof.is_genuine:
            self._fail("forged", f"{label} has no proof")
        elif not isinstance(proof.message, Propose | Accept):
            self._fail("wrong genes", f"{label} is proved by {_words(proof.message)}")
        else:
            said = proof.message
            if (said.encounter, messages.sender_of(said)) != (record.encounter, record.peer):
                self._fail("wrong genes", f"{label} is proved by a letter of {_words(said)}")
            if record.partner != Offer(said.agent, said.genes):
                self._fail(
                    "wrong genes", f"{label} with {record.partner}, but {said.agent} is signed"
                )
            if said.nonce not in node.told:
                self._fail("no contact", f"{label} has nonce {said.nonce}, which no body reported")
            if record.own not in _offers(node, said.nonce):
                self._fail(
                    "wrong genes", f"{label} with {record.own}, not in control at that contact"
                )
        return replace(disk, decisions=disk.decisions | {record.encounter})

    def _lost_decision(self, disk: Disk) -> Violation | None:
        for record in disk.records:
            is_mating = record.state in ("decided", "mated")
            is_lost = is_mating and record.encounter not in disk.decisions
            if is_lost and "no decision" not in self._ignored:
                return Violation("no decision", f"{_label(record.encounter)} is {record.state}")
        return None

    def _fail(self, kind: Kind, text: str) -> None:
        if kind not in self._ignored:
            raise Violation(kind, text)

    def _say(self, node: Node, send: Send) -> int:
        message = send.message
        if message not in self._said_of:
            if send.to != messages.receiver_of(message) or node.mating.me == send.to:
                self._fail("error", f"{_words(message)} is sent to {NAMES.get(send.to)}")
            data = messages.seal(message, COLONY, KEYS[node.robot])
            self._said_of[message] = 1 << self._post(message, data, is_genuine=True)
        return self._said_of[message]

    def _post(self, message: messages.Mating, data: bytes, is_genuine: bool) -> int:
        to = [key.id for key in KEYS].index(messages.receiver_of(message))
        number = len(self._letters)
        self._letters.append(Letter(to, data, message, is_genuine))
        self._letter_of[data] = number
        self._to[to] |= 1 << number
        return number

    def _forged(self) -> int:
        """Say whatever an outsider may try who knows all but a robot's secret key; and what is of another colony."""
        said, genes = 0, b"forged!!"
        for one, other in dict.fromkeys(self._bounds.contacts):
            for a, b in ((one, other), (other, one)):
                e = Encounter(KEYS[a].id, KEYS[b].id, 1, 1)
                propose = Propose(e, 1, SCHEMA, "forged", genes)
                accept = Accept(e, 1, SCHEMA, "forged", genes)
                for message in (propose, accept, Refuse(e, "busy"), Commit(e), Abort(e), Done(e)):
                    owner = KEYS[a if isinstance(message, messages.BY_INITIATOR) else b]
                    said |= 1 << self._post(message, _forge(message, owner), is_genuine=False)
                stolen = messages.seal(propose, "another", KEYS[a])
                said |= 1 << self._post(propose, stolen, is_genuine=False)
        return said

    def _intern(self, node: Node) -> int:
        key = (node.robot, _snapshot(node.mating), node.disk, node.told)
        number = self._node_of.setdefault(key, len(self._nodes))
        if number == len(self._nodes):
            self._nodes.append(node)
        return number

    # What must hold between robots -------------------------------------------------------------------------------

    def _check(self, nodes: State) -> Violation | None:
        """Check that all disks agree, and that they will once faults end."""
        if nodes not in self._settled:
            self._settling = []
            self._settled[nodes] = self._disagreement(nodes) or self._settle(nodes)
        return self._settled[nodes]

    def _disagreement(self, nodes: State) -> Violation | None:
        for one in nodes:
            for other in nodes:
                if one == other or (one, other) in self._agreed:
                    continue
                violation = _disagreement(self._nodes[one], self._nodes[other])
                if violation and violation.kind not in self._ignored:
                    return violation
                self._agreed.add((one, other))
        return None

    def _settle(self, nodes: State) -> Violation | None:
        """No more faults: robots remind each other and hear each other, in turn, until nothing is open."""
        now = list(nodes)
        for patience in range(6):
            for robot in range(len(now)):
                for record in self._nodes[now[robot]].mating.open:
                    violation = self._exchange(now, robot, record, patience > 2)
                    if violation:
                        return violation
            if not any(self._nodes[n].mating.open for n in now):
                return self._one_sided(now)
        left = next(r for n in now for r in self._nodes[n].mating.open)
        text = f"{_label(left.encounter)} stays {left.state} at its {left.role} without any fault"
        return None if "left open" in self._ignored else Violation("left open", text)

    def _exchange(
        self, now: list[int], robot: int, record: Record, is_time_up: bool
    ) -> Violation | None:
        """One robot reminds of an encounter (or gives a proposal up), and all that is then said is heard."""
        mating = self._nodes[now[robot]].mating
        if record.encounter not in (r.encounter for r in mating.open):
            return None
        gives_up = is_time_up and record.state == "proposed"
        verb, label = ("gives", " up") if gives_up else ("reminds of", "")
        words = f"{NAMES[mating.me]} {verb} {_label(record.encounter)}{label}"
        outcome = next(o for o in self._spontaneous(now[robot]) if o.words == words)
        to_hear: deque[int] = deque()
        while True:
            self._settling.append(f"without more faults, {outcome.words}")
            if outcome.violation:
                return outcome.violation
            now[robot] = outcome.node
            to_hear.extend(_bits(outcome.said))
            if not to_hear:
                return None
            letter = to_hear.popleft()
            robot = self._letters[letter].to
            outcome = self._hear(now[robot], letter)[0]

    def _one_sided(self, now: list[int]) -> Violation | None:
        for number in now:
            node = self._nodes[number]
            for record in node.disk.records:
                peer = next(
                    p for p in map(self._nodes.__getitem__, now) if p.mating.me == record.peer
                )
                states = {record.state, peer.disk.state_of(record.encounter)}
                if "mated" in states and len(states) > 1 and "one-sided" not in self._ignored:
                    return Violation("one-sided", f"{_label(record.encounter)} ends as {states}")
        return None

    def _is_mated(self, nodes: State) -> bool:
        return all(
            any(record.state == "mated" for record in self._nodes[n].disk.records) for n in nodes
        )


def _disagreement(initiator: Node, responder: Node) -> Violation | None:
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
            text = f"{_label(encounter)} is '{states[0]}' at its initiator, '{states[1]}' at its responder"
            return Violation("one-sided", text)
        if one and other and (one.own != other.partner or one.partner != other.own):
            return Violation("wrong genes", f"{_label(encounter)}: the disks differ")
    return None


def _is_founded(disk: Disk, message: messages.Mating) -> bool:
    """Tell whether a robot with this disk may say this: a crash could not make it untrue."""
    record = disk.find(message.encounter)
    state = record.state if record else ""
    match message:
        case Propose():
            return message.encounter.life == disk.life
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


def _offers(node: Node, nonce: int) -> list[Offer]:
    """Return what a robot offered at each report of a contact: never the same agent twice."""
    places = [k for k, told in enumerate(node.told, 1) if told == nonce]
    return [Offer(f"{NAMES[node.mating.me]}{k}", bytes([node.robot, k]) * 4) for k in places]


def _forge(message: messages.Mating, owner: Identity) -> bytes:
    content = messages.encode(message)
    signature = FORGER.sign(content)
    return messages.encode(messages.Letter(content, owner.public_key, signature))


def _snapshot(mating: Mating) -> Hashable:
    """Return all of a mating that is not a time."""
    return (
        mating.life,
        mating._count,
        tuple((peer, c.nonce, c.own, c.tick) for peer, c in mating._contacts.items()),
        tuple((waiting.record, waiting.doubted) for waiting in mating._open.values()),
        tuple(sorted(mating._marks.items())),
        tuple(sorted(mating._mated.items())),
    )


def _bits(mask: int) -> Iterable[int]:
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


def _label(encounter: Encounter) -> str:
    names = NAMES[encounter.initiator], NAMES[encounter.responder]
    return f"{names[0]}{names[1]}{encounter.life}.{encounter.count}"


def _words(message: messages.Mating) -> str:
    name = f"{type(message).__name__} {_label(message.encounter)}"
    if isinstance(message, Propose | Accept):
        return f"{name} ({message.agent}, nonce {message.nonce})"
    return name


def _effect_words(effect: Effect | Decide) -> str:
    match effect:
        case Write():
            return "writes " + " and ".join(
                f"{_label(r.encounter)} {r.state}" for r in effect.records
            )
        case Send():
            return f"says {_words(effect.message)}"
        case Note():
            return f"notes {effect.outcome}"
        case Decide():
            return f"decides {_label(effect.record.encounter)}"
