"""The last look at a simulated colony: what its memories say together, and whether robots come back from them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.evolution.history import Born, Mated
from crcolony.fault_simulation.invariants import InvariantChecker, in_words, short
from crcolony.fault_simulation.simulated_robot import COLONY, SimulatedRobot
from crcolony.protocol.codec import WireError
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.envelope import has_valid_signature, open_envelope
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import Accept, Propose
from crcolony.results.merged_history import MergedHistory, merge_robots
from crcolony.storage.reading import StoredRobot, read_stored_robot
from crcolony.storage.rows import Decision

_STEPS = 10


def audit_colony(
    robots: Sequence[SimulatedRobot], witness: InvariantChecker, mutates: bool
) -> MergedHistory:
    """Save and end all robots, check their memories against each other and the witness, and put them together."""
    for robot in robots:
        _end(robot, witness)
    memories = [read_stored_robot(robot.context.folder / str(robot.number)) for robot in robots]
    _check_matings(memories, witness, mutates)
    chronicle = merge_robots(memories)
    _check_sums(chronicle, memories, witness)
    return chronicle


def _end(robot: SimulatedRobot, witness: InvariantChecker) -> None:
    """Nothing may be open; and who comes back from the disk is who was saved, and goes on like it."""
    if robot.robot is None:
        witness.complain(f"{short(robot.id)}: is not alive")
        return
    node = robot.robot.node
    for record in node.waiting:
        witness.complain(f"{in_words(node.id, record.encounter)}: still {record.state} at the end")
    witness.demand(node.next_s == math.inf, f"{short(node.id)}: still waits for something")
    witness.inspect(node)
    witness.demand(node.save(), f"{short(node.id)}: not saved")
    robot.crash()
    again = robot.new_node(_Silence())
    again.start(robot.context.schedule.now_s)
    name = short(node.id)
    witness.demand(_equal(node.robot.save(), again.robot.save()), f"{name}: another after restart")
    numbers = np.random.default_rng(node.number).random((_STEPS, OBSERVATION_WIDTH))
    lives = [[other.robot.step(row).copy() for row in numbers] for other in (node, again)]
    witness.demand(_equal(*lives), f"{name}: goes on differently after a restart")
    witness.demand(again.incarnation > node.incarnation, f"{name}: lives {node.incarnation} twice")
    robot.crash()


class _Silence:
    """A network that nobody is on."""

    def send_envelope(self, *_: Any) -> None: ...
    def request_body(self, *_: Any) -> None: ...
    def publish_action(self, *_: Any) -> None: ...
    def publish_telemetry(self, *_: Any) -> None: ...
    def subscribe_scene(self, *_: Any) -> None: ...


def _equal(one: Any, other: Any) -> bool:
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(_equal(one[key], other[key]) for key in one)
    if isinstance(one, np.ndarray):
        return one.tobytes() == np.asarray(other).tobytes()
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(_equal, one, other))
    return bool(one == other)


def _check_matings(
    memories: Sequence[StoredRobot], witness: InvariantChecker, mutates: bool
) -> None:
    """Every mating has two sides, and each has of the other what that one gave, signed."""
    sides = {
        m.robot: {record.encounter: (record, made) for record, made in m.matings} for m in memories
    }
    genes_of = {
        event.agent: event.genes for m in memories for event in m.events if isinstance(event, Born)
    }
    for memory in memories:
        known = witness.records.get(memory.robot, {})
        made = {record.encounter: made for record, made in memory.matings if made is not None}
        name = short(memory.robot)
        witness.demand(
            known == {record.encounter: record for record, _ in memory.matings}
            and made == witness.decisions.get(memory.robot, {}),
            f"{name}: its memory is not what was written into it",
        )
        for record, decision in memory.matings:
            if decision is None:
                is_over = record.state == "aborted"
                text = f"{in_words(memory.robot, record.encounter)}: ends {record.state}"
                witness.demand(is_over, text)
                continue
            theirs, their_decision = sides.get(record.peer, {}).get(record.encounter, (None, None))
            name = in_words(memory.robot, record.encounter)
            if theirs is None or their_decision is None:
                witness.complain(f"{name}: only one of the two mated")
                continue
            _check_side(name, memory.robot, record, theirs, witness)
            own_genes = genes_of.get(record.own.agent, record.own.genes)
            witness.demand(own_genes == record.own.genes, f"{name}: gave genes of another agent")
            if decision.conceived and not mutates:
                _check_child(name, record, decision, witness)


def _check_side(
    name: str,
    robot: RobotId,
    mine: EncounterRecord,
    theirs: EncounterRecord,
    witness: InvariantChecker,
) -> None:
    witness.demand(mine.partner == theirs.own, f"{name}: has genes its partner did not give")
    witness.demand(mine.nonce == theirs.nonce, f"{name}: the two met at different contacts")
    witness.demand(
        (robot, mine.peer, mine.nonce) in witness.contacts, f"{name}: there was no such contact"
    )
    try:
        letter, message = open_envelope(mine.proof)
    except WireError as error:
        witness.complain(f"{name}: the proof is no letter: {error}")
        return
    assert mine.partner is not None
    is_proof = (
        has_valid_signature(letter, COLONY)
        and isinstance(message, Propose | Accept)
        and message.encounter == mine.encounter
        and message.nonce == mine.nonce
        and (message.agent, message.genes) == (mine.partner.agent, mine.partner.genes)
    )
    witness.demand(is_proof, f"{name}: the proof proves nothing")


def _check_child(
    name: str, record: EncounterRecord, decision: Decision, witness: InvariantChecker
) -> None:
    """Without mutation every gene is the mother's or the father's."""
    assert record.partner is not None
    child, mother, father = (
        np.frombuffer(genes, dtype="<f8")
        for genes in (decision.child, record.own.genes, record.partner.genes)
    )
    is_theirs = bool(((child == mother) | (child == father)).all())
    witness.demand(is_theirs, f"{name}: the child is not of these parents")


def _check_sums(
    chronicle: MergedHistory, memories: Sequence[StoredRobot], witness: InvariantChecker
) -> None:
    decisions = [made for memory in memories for _, made in memory.matings if made is not None]
    matings = [event for event in chronicle.events if isinstance(event, Mated)]
    conceived = sum(mated.conceived + mated.partner_conceived for mated in matings)
    one_sided = len(chronicle.one_sided)
    witness.demand(one_sided == 0, f"{one_sided} matings are one-sided")
    witness.demand(len(decisions) == 2 * len(matings) + one_sided, "the sum of decisions is wrong")
    witness.demand(
        one_sided > 0 or conceived == sum(made.conceived for made in decisions),
        "the sum of conceptions is wrong",
    )
    names = [event.agent for event in chronicle.events if isinstance(event, Born)]
    witness.demand(len(set(names)) == len(names), "two agents have one name")
