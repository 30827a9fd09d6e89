"""The final audit of a simulated colony: its robots' files agree with each other, and robots restart from them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from crcolony.body.contract import OBSERVATION_WIDTH
from crcolony.evolution.history import Born, Mated
from crcolony.fault_simulation.invariants import InvariantChecker, format_encounter, format_robot
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
"""Control steps in which a restarted robot is compared with the one that was saved."""


def audit_colony(
    robots: Sequence[SimulatedRobot], checker: InvariantChecker, mutates: bool
) -> MergedHistory:
    """Save and stop all robots, check their files against each other and the checker, and return the merged history."""
    for robot in robots:
        _audit_robot(robot, checker)
    stored_robots = [
        read_stored_robot(robot.context.folder / str(robot.number)) for robot in robots
    ]
    _check_matings(stored_robots, checker, mutates)
    merged = merge_robots(stored_robots)
    _check_sums(merged, stored_robots, checker)
    return merged


def _audit_robot(robot: SimulatedRobot, checker: InvariantChecker) -> None:
    """Check that nothing is open, and that a robot restarted from the disk equals the saved one and acts like it."""
    if robot.robot is None:
        checker.report(f"{format_robot(robot.id)}: is not running")
        return
    node = robot.robot.node
    for record in node.waiting:
        checker.report(
            f"{format_encounter(node.id, record.encounter)}: still {record.state} at the end"
        )
    checker.require(node.next_s == math.inf, f"{format_robot(node.id)}: a timer is still set")
    checker.inspect(node)
    checker.require(node.save(), f"{format_robot(node.id)}: not saved")
    robot.crash()
    restarted = robot.new_node(_NullTransport())
    restarted.start(robot.context.schedule.now_s)
    name = format_robot(node.id)
    checker.require(
        _equal(node.robot.save(), restarted.robot.save()), f"{name}: differs after a restart"
    )
    rows = np.random.default_rng(node.number).random((_STEPS, OBSERVATION_WIDTH))
    actions = [[one.robot.step(row).copy() for row in rows] for one in (node, restarted)]
    checker.require(_equal(*actions), f"{name}: acts differently after a restart")
    checker.require(
        restarted.incarnation > node.incarnation, f"{name}: repeats incarnation {node.incarnation}"
    )
    robot.crash()


class _NullTransport:
    """A transport that drops everything."""

    def send_envelope(self, *_: Any) -> None: ...
    def request_body(self, *_: Any) -> None: ...
    def request_arena_metadata(self, *_: Any) -> None: ...
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
    """Check that every mating has two sides, each with the genes, signed, that the other sent."""
    sides = {
        stored.robot: {record.encounter: (record, made) for record, made in stored.matings}
        for stored in stored_robots
    }
    genes_of = {
        event.agent: event.genes
        for stored in stored_robots
        for event in stored.events
        if isinstance(event, Born)
    }
    for stored in stored_robots:
        known = checker.records.get(stored.robot, {})
        made = {record.encounter: made for record, made in stored.matings if made is not None}
        name = format_robot(stored.robot)
        checker.require(
            known == {record.encounter: record for record, _ in stored.matings}
            and made == checker.decisions.get(stored.robot, {}),
            f"{name}: its file is not what was written to it",
        )
        for record, decision in stored.matings:
            if decision is None:
                is_over = record.state == "aborted"
                text = f"{format_encounter(stored.robot, record.encounter)}: ends {record.state}"
                checker.require(is_over, text)
                continue
            theirs, their_decision = sides.get(record.peer, {}).get(record.encounter, (None, None))
            name = format_encounter(stored.robot, record.encounter)
            if theirs is None or their_decision is None:
                checker.report(f"{name}: only one of the two mated")
                continue
            _check_side(name, stored.robot, record, theirs, checker)
            own_genes = genes_of.get(record.own.agent, record.own.genes)
            checker.require(own_genes == record.own.genes, f"{name}: sent genes of another agent")
            if decision.conceived and not mutates:
                _check_child(name, record, decision, checker)


def _check_side(
    name: str,
    robot: RobotId,
    mine: EncounterRecord,
    theirs: EncounterRecord,
    checker: InvariantChecker,
) -> None:
    checker.require(mine.partner == theirs.own, f"{name}: has genes its partner did not send")
    checker.require(mine.nonce == theirs.nonce, f"{name}: the two sides are of different contacts")
    checker.require(
        (robot, mine.peer, mine.nonce) in checker.contacts, f"{name}: there was no such contact"
    )
    try:
        envelope, message = open_envelope(mine.proof)
    except WireError as error:
        checker.report(f"{name}: the proof is no envelope: {error}")
        return
    assert mine.partner is not None
    is_proof = (
        has_valid_signature(envelope, COLONY)
        and isinstance(message, Propose | Accept)
        and message.encounter == mine.encounter
        and message.nonce == mine.nonce
        and (message.agent, message.genes) == (mine.partner.agent, mine.partner.genes)
    )
    checker.require(is_proof, f"{name}: the proof is not the partner's proposal or acceptance")


def _check_child(
    name: str, record: EncounterRecord, decision: Decision, checker: InvariantChecker
) -> None:
    """Check that without mutation every gene is the mother's or the father's."""
    assert record.partner is not None
    child, mother, father = (
        np.frombuffer(genes, dtype="<f8")
        for genes in (decision.child, record.own.genes, record.partner.genes)
    )
    is_theirs = bool(((child == mother) | (child == father)).all())
    checker.require(is_theirs, f"{name}: the child is not of these parents")


def _check_sums(
    merged: MergedHistory, stored_robots: Sequence[StoredRobot], checker: InvariantChecker
) -> None:
    decisions = [made for stored in stored_robots for _, made in stored.matings if made is not None]
    matings = [event for event in merged.events if isinstance(event, Mated)]
    conceived = sum(mated.conceived + mated.partner_conceived for mated in matings)
    one_sided = len(merged.one_sided)
    checker.require(one_sided == 0, f"{one_sided} matings are one-sided")
    checker.require(len(decisions) == 2 * len(matings) + one_sided, "the sum of decisions is wrong")
    checker.require(
        one_sided > 0 or conceived == sum(made.conceived for made in decisions),
        "the sum of conceptions is wrong",
    )
    names = [event.agent for event in merged.events if isinstance(event, Born)]
    checker.require(len(set(names)) == len(names), "two agents have the same name")
