"""Invariants of a whole simulated colony, checked while it runs and independently of the code that is tested.

The checker receives what no single robot does: every envelope, every write to a disk, and every contact.
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
from crcolony.protocol.signed_telemetry import open_telemetry
from crcolony.protocol.telemetry_messages import (
    EncounterOutcome,
    decode_activity,
    decode_event,
    decode_state,
)
from crcolony.storage.rows import Decision

_MAX_EARLY = 32
"""Proposals that a robot may keep before its own contact."""
_MAX_VIOLATIONS = 20
"""Violations that are kept; more would only repeat them."""
_STATES_TO_SEND = {
    Accept: ("prepared",),
    Commit: ("decided",),
    Done: ("mated",),
    Abort: (None, "mated"),  # "mated": the reply to a late message of an encounter that is over
}
"""The state of the encounter on the disk when a robot sends this message; None: no record of it."""


class InvariantChecker:
    """Keeps the ledger of a running colony; `violations` lists the invariants that did not hold."""

    def __init__(self, robots: int, limits: MatingLimits) -> None:
        self.violations: list[str] = []
        self.counts: Counter[str] = Counter()
        """Outcomes of encounters, refused envelopes, and crashes, by name"""
        self.records: dict[RobotId, dict[Encounter, EncounterRecord]] = {}
        """The records on every robot's disk"""
        self.decisions: dict[RobotId, dict[Encounter, Decision]] = {}
        self.contacts: set[tuple[RobotId, RobotId, int]] = set()
        """Robot, peer and nonce of every contact in an observation"""
        self._robots, self._limits = robots, limits
        self._log = hashlib.blake2b(digest_size=16)
        self._unsaved: dict[RobotId, list[Decision]] = {}
        """Decisions newer than the last snapshot"""
        self._born: dict[AgentId, bytes] = {}
        """Genes of all agents whose birth is on a disk"""
        self._turned: Counter[RobotId] = Counter()
        """Offspring in the pools that were turned over, as far as the turnover is on a disk"""

    @property
    def hash(self) -> str:
        """The hash of everything that was published or sent."""
        return self._log.hexdigest()

    def report(self, text: str) -> None:
        """Add a violation."""
        if len(self.violations) < _MAX_VIOLATIONS:
            self.violations.append(text)

    def require(self, holds: bool, text: str) -> None:
        """Add a violation unless an invariant holds."""
        if not holds:
            self.report(text)

    # While it runs --------------------------------------------------------------------------------------------

    def on_contact(self, robot: RobotId, contact: Contact) -> None:
        """Note a contact in a robot's observation."""
        self.contacts.add((robot, contact.robot, contact.nonce))

    def on_written(
        self,
        robot: RobotId,
        records: Sequence[EncounterRecord],
        decided: EncounterRecord | None,
        decision: Decision | None,
    ) -> None:
        """Check records, and a decision if there is one, that are on a robot's disk."""
        for record in records:
            is_own = self._born.get(record.own.agent) == record.own.genes
            name = format_encounter(robot, record.encounter)
            self.require(is_own, f"{name}: sends genes of an agent that is not on its disk")
            self.records.setdefault(robot, {})[record.encounter] = record
        if decided is None or decision is None:
            return
        known = self.decisions.setdefault(robot, {})
        name = format_encounter(robot, decided.encounter)
        self.require(decided.encounter not in known, f"{name}: decided twice")
        self.require(0.0 <= decision.energy <= 1.0, f"{name}: energy {decision.energy}")
        known[decided.encounter] = decision
        self._unsaved.setdefault(robot, []).append(decision)

    def on_saved(self, robot: RobotId, events: Sequence[Event]) -> None:
        """Note a snapshot that is on a robot's disk."""
        self._unsaved[robot] = []
        self._born |= {event.agent: event.genes for event in events if isinstance(event, Born)}
        self._turned[robot] += sum(e.offspring for e in events if isinstance(e, TurnedOver))

    def on_published(self, robot: RobotId, kind: str, data: bytes) -> None:
        """Check an envelope, an event or a state that a robot sends: what it claims must be on its disk."""
        self._log.update(robot + data)
        if kind == "envelope":
            self._check_envelope(robot, data)
        elif kind == "event":
            event = decode_event(open_telemetry(data).content).event
            if isinstance(event, EncounterOutcome):
                self.counts[event.outcome] += 1
        elif kind == "state":
            decode_state(open_telemetry(data).content)  # raises for an energy outside 0 to 1
        else:
            decode_activity(open_telemetry(data).content)

    def _check_envelope(self, robot: RobotId, data: bytes) -> None:
        _, message = open_envelope(data)
        name = format_encounter(robot, message.encounter)
        self.require(sender_of(message) == robot, f"{name}: sends in the name of another robot")
        if isinstance(message, Propose | Refuse):
            return
        record = self.records.get(robot, {}).get(message.encounter)
        state = record.state if record else None
        kind = type(message).__name__
        self.require(
            state in _STATES_TO_SEND[type(message)],
            f"{name}: sends {kind}, but on its disk is {state}",
        )

    def on_started(self, node: RobotNode) -> None:
        """Check a robot that has started from its disk: every conception on it is in the pool, or was born."""
        pool = [offspring.genes.tobytes() for offspring in node.robot.subpopulation.pool]
        unsaved = self._unsaved.get(node.id, [])
        stream = node.robot.stream.astype("<u8").tobytes()
        is_own = not unsaved or stream == unsaved[-1].stream
        self.require(is_own, f"{format_robot(node.id)}: would draw the same numbers again")
        for decision in unsaved:
            is_there = not decision.conceived or decision.child in pool
            self.require(is_there, f"{format_robot(node.id)}: a conception is lost in a restart")
        self.inspect(node)

    def inspect(self, node: RobotNode) -> None:
        """Check the state of a robot between two operations."""
        name, robot, subpopulation = format_robot(node.id), node.robot, node.robot.subpopulation
        decisions = self.decisions.get(node.id, {}).values()
        conceptions = sum(decision.conceived for decision in decisions)
        self.require(node.matings == len(decisions), f"{name}: counts {node.matings} matings")
        self.require(
            node.conceptions == conceptions, f"{name}: counts {node.conceptions} offspring"
        )
        turned = sum(e.offspring for e in node._unsaved if isinstance(e, TurnedOver))
        kept = self._turned[node.id] + turned + len(subpopulation.pool)
        self.require(kept == conceptions, f"{name}: {conceptions} conceptions, {kept} offspring")
        self.require(
            len(set(subpopulation.ids)) == len(subpopulation.ids),
            f"{name}: two agents have the same name",
        )
        genes = np.concatenate(
            [subpopulation.genotypes, *[o.genes[None] for o in subpopulation.pool]]
        )
        is_sound = bool(
            np.isfinite(genes).all()
            and (genes >= subpopulation.schema.lows).all()
            and (genes <= subpopulation.schema.highs).all()
        )
        self.require(is_sound, f"{name}: a genotype is out of bounds")
        energies = node._batch.energies[robot.row]
        is_sound = bool((energies >= 0.0).all() and (energies <= 1.0).all())
        self.require(is_sound, f"{name}: an energy is not within 0 to 1")
        early = len(node._mating._early)
        is_bounded = len(node.waiting) <= self._limits.open and early <= _MAX_EARLY
        self.require(is_bounded, f"{name}: {len(node.waiting)} encounters are open")

    def on_stopped(self, node: RobotNode) -> None:
        """Add the counters of an incarnation that has ended."""
        for reason in ("malformed", "forged", "unfit", "unexpected", "too many", "not allowed"):
            self.counts[reason] += node.counts[reason]


def format_robot(robot: RobotId) -> str:
    """Return a robot's short name."""
    return robot.hex()[:8]


def format_encounter(robot: RobotId, encounter: Encounter) -> str:
    """Return a robot's side of an encounter as text."""
    initiator, responder = format_robot(encounter.initiator), format_robot(encounter.responder)
    return f"{format_robot(robot)} in {initiator}>{responder} {encounter.incarnation}.{encounter.count}"
