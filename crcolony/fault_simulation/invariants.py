"""Who watches a simulated colony and complains: invariants of the whole, checked apart from the code they are about.

The witness sees what no robot sees, as it happens: every letter, every COMMIT, every contact a robot was told of.
"""

import hashlib
from collections import Counter
from collections.abc import Sequence

import numpy as np

from crcolony.evolution.history import Born, Event, TurnedOver
from crcolony.evolution.lineage import AgentId
from crcolony.nodes.robot_node import RobotNode
from crcolony.protocol.body_messages import Contact
from crcolony.protocol.encounters import EncounterRecord, MatingLimits
from crcolony.protocol.envelope import open_envelope
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import (
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    Propose,
    Refuse,
    sender_of,
)
from crcolony.protocol.telemetry_messages import EncounterOutcome, decode_event, decode_state
from crcolony.storage.rows import Decision

_MAX_EARLY, _MAX_VIOLATIONS = 32, 20
_SAYABLE = {
    Accept: ("prepared",),
    Commit: ("decided",),
    Done: ("mated",),
    Abort: (None, "mated"),  # to a late letter of an encounter that is over, too
}
"""What must be on the disk of whoever says this; None: nothing about that encounter."""


class InvariantChecker:
    """Keeps the ledger of a colony while it lives; `violations` says where a promise was broken."""

    def __init__(self, robots: int, limits: MatingLimits) -> None:
        self.violations: list[str] = []
        self.counts: Counter[str] = Counter()
        """Outcomes of encounters, letters refused, crashes"""
        self.records: dict[RobotId, dict[Encounter, EncounterRecord]] = {}
        """What is on every robot's disk"""
        self.decisions: dict[RobotId, dict[Encounter, Decision]] = {}
        self.contacts: set[tuple[RobotId, RobotId, int]] = set()
        """Robot, peer and nonce of every contact that a robot was told of"""
        self._robots, self._limits = robots, limits
        self._log = hashlib.blake2b(digest_size=16)
        self._unsaved: dict[RobotId, list[Decision]] = {}
        """Decisions younger than the last snapshot"""
        self._born: dict[AgentId, bytes] = {}
        """Genes of all agents, as far as they are on a disk"""
        self._turned: Counter[RobotId] = Counter()
        """Offspring in the pools that were turned over, as far as that is on the disk"""

    @property
    def hash(self) -> str:
        """The hash of everything that was said."""
        return self._log.hexdigest()

    def complain(self, text: str) -> None:
        """Note a broken promise."""
        if len(self.violations) < _MAX_VIOLATIONS:
            self.violations.append(text)

    def demand(self, is_kept: bool, text: str) -> None:
        """Complain unless a promise is kept."""
        if not is_kept:
            self.complain(text)

    # While it lives --------------------------------------------------------------------------------------------

    def on_contact(self, robot: RobotId, contact: Contact) -> None:
        """A body told its robot of a contact."""
        self.contacts.add((robot, contact.robot, contact.nonce))

    def on_written(
        self,
        robot: RobotId,
        records: Sequence[EncounterRecord],
        decided: EncounterRecord | None,
        decision: Decision | None,
    ) -> None:
        """Records, and perhaps a decision, are on a robot's disk."""
        for record in records:
            is_own = self._born.get(record.own.agent) == record.own.genes
            name = in_words(robot, record.encounter)
            self.demand(is_own, f"{name}: gives genes of an agent that is not on its disk")
            self.records.setdefault(robot, {})[record.encounter] = record
        if decided is None or decision is None:
            return
        known = self.decisions.setdefault(robot, {})
        name = in_words(robot, decided.encounter)
        self.demand(decided.encounter not in known, f"{name}: decided twice")
        self.demand(0.0 <= decision.energy <= 1.0, f"{name}: energy {decision.energy}")
        known[decided.encounter] = decision
        self._unsaved.setdefault(robot, []).append(decision)

    def on_saved(self, robot: RobotId, events: Sequence[Event]) -> None:
        """A snapshot is on a robot's disk."""
        self._unsaved[robot] = []
        self._born |= {event.agent: event.genes for event in events if isinstance(event, Born)}
        self._turned[robot] += sum(e.offspring for e in events if isinstance(e, TurnedOver))

    def on_published(self, robot: RobotId, kind: str, data: bytes) -> None:
        """A robot says something; what it claims must be on its disk by then."""
        self._log.update(robot + data)
        if kind == "letter":
            self._overhear_letter(robot, data)
        elif kind == "event":
            event = decode_event(data).event
            if isinstance(event, EncounterOutcome):
                self.counts[event.outcome] += 1
        else:
            decode_state(data)  # an energy beyond 0 to 1 is no state

    def _overhear_letter(self, robot: RobotId, data: bytes) -> None:
        _, message = open_envelope(data)
        name = in_words(robot, message.encounter)
        self.demand(sender_of(message) == robot, f"{name}: speaks for another robot")
        if isinstance(message, Propose | Refuse):
            return
        record = self.records.get(robot, {}).get(message.encounter)
        state = record.state if record else None
        kind = type(message).__name__
        self.demand(
            state in _SAYABLE[type(message)], f"{name}: says {kind}, but on its disk is {state}"
        )

    def on_started(self, node: RobotNode) -> None:
        """A robot has come to life from its disk: every conception on it is in the pool, or was born."""
        pool = [offspring.genes.tobytes() for offspring in node.robot.subpopulation.pool]
        unsaved = self._unsaved.get(node.id, [])
        stream = node.robot.stream.astype("<u8").tobytes()
        is_own = not unsaved or stream == unsaved[-1].stream
        self.demand(is_own, f"{short(node.id)}: would draw the same numbers again")
        for decision in unsaved:
            is_there = not decision.conceived or decision.child in pool
            self.demand(is_there, f"{short(node.id)}: a conception is lost in a restart")
        self.inspect(node)

    def inspect(self, node: RobotNode) -> None:
        """Look into a robot between two things it does."""
        name, robot, mating_driver = short(node.id), node.robot, node._mating
        decisions = self.decisions.get(node.id, {}).values()
        conceptions = sum(decision.conceived for decision in decisions)
        self.demand(node.matings == len(decisions), f"{name}: counts {node.matings} matings")
        self.demand(node.conceptions == conceptions, f"{name}: counts {node.conceptions} offspring")
        people = robot.subpopulation
        turned = sum(e.offspring for e in node._unsaved if isinstance(e, TurnedOver))
        kept = self._turned[node.id] + turned + len(people.pool)
        self.demand(kept == conceptions, f"{name}: {conceptions} conceptions, {kept} offspring")
        self.demand(len(set(people.ids)) == len(people.ids), f"{name}: an agent lives twice")
        genes = np.concatenate([people.genotypes, *[o.genes[None] for o in people.pool]])
        is_sound = bool(
            np.isfinite(genes).all()
            and (genes >= people.schema.lows).all()
            and (genes <= people.schema.highs).all()
        )
        self.demand(is_sound, f"{name}: a genome is out of bounds")
        energies = node._batch.energies[robot.row]
        is_sound = bool((energies >= 0.0).all() and (energies <= 1.0).all())
        self.demand(is_sound, f"{name}: an energy is not within 0 to 1")
        is_bounded = (
            len(node.waiting) <= self._limits.open and len(mating_driver._early) <= _MAX_EARLY
        )
        self.demand(is_bounded, f"{name}: {len(node.waiting)} encounters wait")

    def on_stopped(self, node: RobotNode) -> None:
        """A life is over."""
        for why in ("malformed", "forged", "unfit", "unexpected", "too many", "not allowed"):
            self.counts[why] += node.counts[why]


def short(robot: RobotId) -> str:
    """Return a robot's name for people."""
    return robot.hex()[:8]


def in_words(robot: RobotId, encounter: Encounter) -> str:
    """Return a robot's side of an encounter for people."""
    initiator, responder = short(encounter.initiator), short(encounter.responder)
    return f"{short(robot)} in {initiator}>{responder} {encounter.incarnation}.{encounter.count}"
