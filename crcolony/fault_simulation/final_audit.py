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
    robots: Sequence[SimulatedRobot], checker: InvariantChecker, mutates: bool
) -> MergedHistory:
    """Save and end all robots, check their memories against each other and the witness, and put them together."""
    for robot in robots:
        _end(robot, checker)
    stored_robots = [
        read_stored_robot(robot.context.folder / str(robot.number)) for robot in robots
    ]
    _check_matings(stored_robots, checker, mutates)
    merged = merge_robots(stored_robots)
    _check_sums(merged, stored_robots, checker)
    return merged


def _end(robot: SimulatedRobot, checker: InvariantChecker) -> None:
    """Nothing may be open; and who comes back from the disk is who was saved, and goes on like it."""
    if robot.robot is None:
        checker.complain(f"{short(robot.id)}: is not alive")
        return
    node = robot.robot.node
    for record in node.waiting:
        checker.complain(f"{in_words(node.id, record.encounter)}: still {record.state} at the end")
    checker.demand(node.next_s == math.inf, f"{short(node.id)}: still waits for something")
    checker.inspect(node)
    checker.demand(node.save(), f"{short(node.id)}: not saved")
    robot.crash()
    again = robot.new_node(_Silence())
    again.start(robot.context.schedule.now_s)
    name = short(node.id)
    checker.demand(_equal(node.robot.save(), again.robot.save()), f"{name}: another after restart")
    numbers = np.random.default_rng(node.number).random((_STEPS, OBSERVATION_WIDTH))
    lives = [[other.robot.step(row).copy() for row in numbers] for other in (node, again)]
    checker.demand(_equal(*lives), f"{name}: goes on differently after a restart")
    checker.demand(again.incarnation > node.incarnation, f"{name}: lives {node.incarnation} twice")
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
    stored_robots: Sequence[StoredRobot], checker: InvariantChecker, mutates: bool
) -> None:
    """Every mating has two sides, and each has of the other what that one gave, signed."""
    sides = {
        m.robot: {record.encounter: (record, made) for record, made in m.matings}
        for m in stored_robots
    }
    genes_of = {
        event.agent: event.genes
        for m in stored_robots
        for event in m.events
        if isinstance(event, Born)
    }
    for stored in stored_robots:
        known = checker.records.get(stored.robot, {})
        made = {record.encounter: made for record, made in stored.matings if made is not None}
        name = short(stored.robot)
        checker.demand(
            known == {record.encounter: record for record, _ in stored.matings}
            and made == checker.decisions.get(stored.robot, {}),
            f"{name}: its memory is not what was written into it",
        )
        for record, decision in stored.matings:
            if decision is None:
                is_over = record.state == "aborted"
                text = f"{in_words(stored.robot, record.encounter)}: ends {record.state}"
                checker.demand(is_over, text)
                continue
            theirs, their_decision = sides.get(record.peer, {}).get(record.encounter, (None, None))
            name = in_words(stored.robot, record.encounter)
            if theirs is None or their_decision is None:
                checker.complain(f"{name}: only one of the two mated")
                continue
            _check_side(name, stored.robot, record, theirs, checker)
            own_genes = genes_of.get(record.own.agent, record.own.genes)
            checker.demand(own_genes == record.own.genes, f"{name}: gave genes of another agent")
            if decision.conceived and not mutates:
                _check_child(name, record, decision, checker)


def _check_side(
    name: str,
    robot: RobotId,
    mine: EncounterRecord,
    theirs: EncounterRecord,
    checker: InvariantChecker,
) -> None:
    checker.demand(mine.partner == theirs.own, f"{name}: has genes its partner did not give")
    checker.demand(mine.nonce == theirs.nonce, f"{name}: the two met at different contacts")
    checker.demand(
        (robot, mine.peer, mine.nonce) in checker.contacts, f"{name}: there was no such contact"
    )
    try:
        envelope, message = open_envelope(mine.proof)
    except WireError as error:
        checker.complain(f"{name}: the proof is no letter: {error}")
        return
    assert mine.partner is not None
    is_proof = (
        has_valid_signature(envelope, COLONY)
        and isinstance(message, Propose | Accept)
        and message.encounter == mine.encounter
        and message.nonce == mine.nonce
        and (message.agent, message.genes) == (mine.partner.agent, mine.partner.genes)
    )
    checker.demand(is_proof, f"{name}: the proof proves nothing")


def _check_child(
    name: str, record: EncounterRecord, decision: Decision, checker: InvariantChecker
) -> None:
    """Without mutation every gene is the mother's or the father's."""
    assert record.partner is not None
    child, mother, father = (
        np.frombuffer(genes, dtype="<f8")
        for genes in (decision.child, record.own.genes, record.partner.genes)
    )
    is_theirs = bool(((child == mother) | (child == father)).all())
    checker.demand(is_theirs, f"{name}: the child is not of these parents")


def _check_sums(
    merged: MergedHistory, stored_robots: Sequence[StoredRobot], checker: InvariantChecker
) -> None:
    decisions = [made for stored in stored_robots for _, made in stored.matings if made is not None]
    matings = [event for event in merged.events if isinstance(event, Mated)]
    conceived = sum(mated.conceived + mated.partner_conceived for mated in matings)
    one_sided = len(merged.one_sided)
    checker.demand(one_sided == 0, f"{one_sided} matings are one-sided")
    checker.demand(len(decisions) == 2 * len(matings) + one_sided, "the sum of decisions is wrong")
    checker.demand(
        one_sided > 0 or conceived == sum(made.conceived for made in decisions),
        "the sum of conceptions is wrong",
    )
    names = [event.agent for event in merged.events if isinstance(event, Born)]
    checker.demand(len(set(names)) == len(names), "two agents have one name")
