"""A decision can be rolled back, and replayed from storage with the same result."""

import numpy as np
import pytest

from crcolony.nodes.mating_decision import MatingDecisions, exchanged_event
from crcolony.protocol.encounters import EncounterRecord, Offer
from crcolony.protocol.mating_messages import Encounter, pack_genes
from crcolony.robot.factory import make_robots, own_streams
from crcolony.robot.robot import Robot
from tests.support.lone_robot import ME, PEER
from tests.support.small_colony import small


def new_robot(*settings: str) -> tuple[Robot, MatingDecisions]:
    batch, _, (robot,) = make_robots(small(*settings), [ME.id.hex()], own_streams([ME.id]))
    robot.start()
    return robot, MatingDecisions(robot, batch)


def record_of(robot: Robot, agent: str) -> EncounterRecord:
    """Return the record of an encounter of one of the robot's agents."""
    schema = robot.subpopulation.schema
    genes = pack_genes(schema.random(np.random.default_rng(1)))
    encounter = Encounter(ME.id, PEER.id, 1, 1)
    own = Offer(agent, pack_genes(robot.subpopulation.genotypes[0]))
    return EncounterRecord(encounter, "initiator", "proposed", 7, 3, own, Offer("peer/1", genes))


def state_of(robot: Robot) -> tuple[bytes, list[bytes], int]:
    subpopulation = robot.subpopulation
    pool = [offspring.genes.tobytes() for offspring in subpopulation.pool]
    return robot.stream.tobytes(), pool, subpopulation.conceived


def test_a_full_agent_conceives_and_a_rollback_leaves_no_trace() -> None:
    """Energy 1 makes a conception certain; afterwards stream and pool are as before."""
    robot, decisions = new_robot()
    before = state_of(robot)
    decision = decisions.decide(record_of(robot, robot.subpopulation.ids[0]))
    assert decision.conceived
    assert len(robot.subpopulation.pool) == 1
    decisions.rollback()
    assert state_of(robot) == before


@pytest.mark.parametrize("selection", ["implicit", "medea"])
def test_a_replayed_decision_gives_the_same_state(selection: str) -> None:
    """On a robot as it was before the decision, in each way of selection that robots as processes know."""
    robot, decisions = new_robot(f"selection={selection}")
    record = record_of(robot, robot.subpopulation.ids[0])
    decision = decisions.decide(record)
    restored, replayed = new_robot(f"selection={selection}")
    assert replayed.replay(record, decision)
    assert state_of(restored)[:2] == state_of(robot)[:2]


def test_an_agent_of_an_earlier_generation_has_no_offspring() -> None:
    """The decision says that it came too late."""
    robot, decisions = new_robot()
    record = record_of(robot, "gone/1")
    decision = decisions.decide(record)
    assert (decision.conceived, decision.too_late, decision.child) == (False, True, b"")
    assert not robot.subpopulation.pool
    assert not decisions.replay(record, decision)
    assert exchanged_event(record, decision).too_late
