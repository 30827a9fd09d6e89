"""Robots join an arena, act and leave; it waits for the right ones, and refuses invalid requests and actions."""

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.body_server.body_slots import NoBodyError
from crcolony.config import load
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.body_messages import (
    Action,
    Contact,
    decode_observation,
    pack_row,
)
from tests.support.arena_nodes import ARENA_RUN, IDS, awaited, filled_node, forward, join, new_node

# Joining and leaving ------------------------------------------------------------------------------------------------


def test_a_robot_that_joins_receives_the_description_of_its_body() -> None:
    """Slot, run, tick, period, whether the arena waits for actions, and the settings of the body."""
    node = new_node("body.camera_range_m=1.25", "arena.control_period_s=0.1")
    join(node, 0)
    node.step()
    answer = join(node, 1)
    assert (answer.slot, answer.arena_run, answer.tick) == (1, ARENA_RUN, 1)
    assert (answer.period_s, answer.lockstep) == (0.1, True)
    assert load(None, [f"body={{{_toml(answer.body)}}}"]).body == CyberRodent(camera_range_m=1.25)


def _toml(json: str) -> str:
    return json.strip("{}").replace('"', "").replace(":", "=")


def test_a_robot_gets_the_slot_it_requests_if_it_is_free() -> None:
    """Otherwise the first free one; a slot that does not exist counts as no request."""
    node = new_node()
    assert join(node, 0, number=2).slot == 2
    assert join(node, 1, number=2).slot == 0
    assert join(node, 2, number=99).slot == 1
    assert join(node, 3).slot == 3
    assert node.robots == {IDS[0]: 2, IDS[1]: 0, IDS[2]: 1, IDS[3]: 3}


def test_a_full_arena_denies_a_body_and_reports_its_size() -> None:
    """Until a robot leaves."""
    node = filled_node()
    with pytest.raises(NoBodyError, match="all 4 slots"):
        node.join(IDS[4], "test")
    assert node.counts["full"] == 1
    assert node.refusals == "refused: 1 full"
    node.leave(IDS[1])
    node.leave(IDS[1])
    assert join(node, 4, number=3).slot == 1


def test_a_robot_that_joins_again_keeps_its_body() -> None:
    """It has the same slot and pose, even if it requests another slot now."""
    node = filled_node()
    node.leave(IDS[3])
    pose = node.arena.world.poses[1].copy()
    assert join(node, 1, number=3).slot == 1
    assert np.array_equal(node.arena.world.poses[1], pose)
    assert len(node.robots) == 3


def test_more_expected_robots_than_slots_are_rejected() -> None:
    """The arena would wait for ever."""
    with pytest.raises(ValueError, match="5 are expected"):
        new_node(expect=5)


def test_lockstep_starts_when_all_expected_robots_have_joined() -> None:
    """The first tick precedes all observations."""
    node = new_node(expect=2)
    assert not node.is_ready
    join(node, 0)
    assert not node.is_ready
    join(node, 1)
    assert node.is_ready
    assert not node.waiting_for


def test_lockstep_waits_for_every_robot_with_an_observation() -> None:
    """Once for each; for a robot that joins late from the next tick on, for one that leaves not at all."""
    node = filled_node()
    assert awaited(node) == [0, 1, 2, 3]
    node.leave(IDS[3])
    for robot in (0, 2):
        assert node.apply_action(IDS[robot], forward(node))
    join(node, 5)
    assert awaited(node) == [1]
    assert not node.is_ready
    node.apply_action(IDS[1], forward(node))
    assert node.is_ready
    node.step()
    assert awaited(node) == [0, 1, 2, 5]


def test_lockstep_stops_while_no_robot_is_online() -> None:
    """Whether all have left or all are offline; real time continues."""
    node = new_node()
    assert not node.is_ready
    join(node, 0)
    node.step()
    node.mark_offline(IDS[0], 0.0)
    assert not node.is_ready
    assert new_node(lockstep=False).is_ready


def test_lockstep_continues_without_an_offline_robot_whose_body_stops() -> None:
    """Within its time to live; once the robot is online again the arena waits for it, in the same slot."""
    node = filled_node()
    node.arena.world.poses[:, :2] = [(-0.4, -0.4), (0.0, 0.0), (0.4, -0.4), (0.4, 0.4)]
    node.apply_action(IDS[1], forward(node))
    node.mark_offline(IDS[1], 100.0)
    poses = []
    for _ in range(6):
        for robot in (0, 2, 3):
            node.apply_action(IDS[robot], forward(node, 0.0))
        assert node.is_ready
        node.step()
        poses.append(node.arena.world.poses[1].copy())
    distances_m = np.hypot(*np.diff(poses, axis=0)[:, :2].T)
    assert distances_m == pytest.approx([0.02, 0.02, 0.0, 0.0, 0.0])
    node.mark_online(IDS[1])
    assert awaited(node) == [0, 1, 2, 3]
    assert node.apply_action(IDS[1], forward(node))


def test_the_body_of_an_offline_robot_is_removed_after_the_grace_period() -> None:
    """Counted from when it went offline first; not if the robot came online or joined again meanwhile."""
    node = filled_node(lockstep=False)
    for robot in (0, 1, 2):
        node.mark_offline(IDS[robot], 100.0)
    node.mark_offline(IDS[0], 120.0)
    node.mark_online(IDS[1])
    join(node, 2)
    node.mark_offline(IDS[7], 100.0)
    assert node.remove_absent(129.9) == []
    assert node.remove_absent(130.0) == [IDS[0]]
    assert list(node.robots) == [IDS[1], IDS[2], IDS[3]]
    assert node.arena.world.colonies.tolist() == [-1, 0, 0, 0]
    assert node.remove_absent(1e9) == []


# Colonies -----------------------------------------------------------------------------------------------------------


def face_to_face(node: ArenaNode, *robots: int) -> None:
    """Place two robots opposite each other with their beacons on, and make one tick."""
    slots = [node.robots[IDS[robot]] for robot in robots]
    node.arena.world.poses[slots] = [(-0.2, 0.0, 0.0), (0.2, 0.0, np.pi)]
    row = np.zeros(contract.ACTION_WIDTH)
    row[[contract.BEACON, contract.TTL]] = 1.0
    for robot in robots:
        assert node.apply_action(IDS[robot], Action(node.tick, pack_row(row)))
    node.step()


def contact(node: ArenaNode, robot: int) -> Contact | None:
    return decode_observation(node.observation(IDS[robot])).contact


def test_a_contact_names_the_other_robot_and_the_nonce() -> None:
    """Both sides receive the other's id and the same nonce; no other robot receives a contact."""
    node = filled_node()
    node.arena.world.poses[[1, 2], :2] = [(-0.5, -0.5), (0.5, 0.5)]
    face_to_face(node, 3, 0)
    one, other = contact(node, 3), contact(node, 0)
    assert one is not None
    assert other is not None
    assert (one.robot, other.robot) == (IDS[0], IDS[3])
    assert one.nonce == other.nonce > 0
    assert contact(node, 1) is None
    node.leave(IDS[0])
    assert contact(node, 3) is None


def test_two_colonies_share_an_arena_and_never_encounter_each_other() -> None:
    """Colonies are numbered in the order of their first robots; robots of one colony do meet."""
    node = new_node("robots=3")
    for robot, colony in ((0, "red"), (1, "blue"), (2, "red")):
        join(node, robot, colony)
    node.step()
    assert node.colonies == ["red", "blue"]
    assert [node.colony_of(IDS[robot]) for robot in range(3)] == ["red", "blue", "red"]
    node.arena.world.poses[2, :2] = 0.5
    face_to_face(node, 0, 1)
    assert contact(node, 0) is None
    assert contact(node, 1) is None
    node.arena.world.poses[1, :2] = 0.5
    face_to_face(node, 0, 2)
    assert contact(node, 0) is not None


def test_the_names_of_colonies_without_bodies_are_bounded() -> None:
    """A robot that joins with ever new names leaves no more of them than there are slots.

    It has to leave before it does: a body in use never goes to another colony.
    """
    node = new_node()
    join(node, 0, "here")
    for k in range(20):
        join(node, 1, f"passing-{k}")
        assert node.colony_of(IDS[1]) == f"passing-{k}"
        with pytest.raises(
            NoBodyError, match=f"in use: the robot has a body in colony passing-{k}"
        ):
            join(node, 1, "another")
        assert node.colony_of(IDS[1]) == f"passing-{k}"
        node.leave(IDS[1])
    join(node, 1, "last")
    assert len(node.robots) == 2
    assert len(node.colonies) == 4
    assert node.colony_of(IDS[0]) == "here"


# Refused actions ----------------------------------------------------------------------------------------------------


def test_an_invalid_action_is_refused_and_counted() -> None:
    """NaN, rows of another length, and actions of robots without a body move nothing."""
    node = filled_node()
    poses = node.arena.world.poses.copy()
    row = np.full(contract.ACTION_WIDTH, 0.1)
    row[3] = np.nan
    assert not node.apply_action(IDS[0], Action(node.tick, pack_row(row)))
    assert not node.apply_action(IDS[0], Action(node.tick, pack_row(np.ones(3))))
    assert not node.apply_action(IDS[0], Action(node.tick, b"12345"))
    assert not node.apply_action(IDS[5], forward(node))
    assert node.counts == {"malformed": 3, "unknown": 1}
    node.step()
    assert np.array_equal(node.arena.world.poses[:, 2], poses[:, 2])
    assert not node.arena.world.actions.any()


def test_lockstep_accepts_one_action_for_the_present_tick() -> None:
    """The first; no second one, none for an earlier or a later tick, and none before an observation."""
    node = filled_node()
    assert not node.apply_action(IDS[0], forward(node, age=1))
    assert not node.apply_action(IDS[0], forward(node, age=-1))
    assert node.apply_action(IDS[0], forward(node, 0.1))
    assert not node.apply_action(IDS[0], forward(node, 0.2))
    node.leave(IDS[1])
    join(node, 1)
    assert not node.apply_action(IDS[1], forward(node))
    assert node.counts == {"stale": 4}
    node.step()
    assert node.arena.world.wheel_speeds[:2, 0].tolist() == [0.1, 0.0]


def test_real_time_accepts_late_actions_in_order_within_their_time_to_live() -> None:
    """Half a second is two ticks; older ones are refused, as are those overtaken by a later one."""
    node = filled_node(lockstep=False)
    for _ in range(5):
        node.step()
    assert not node.apply_action(IDS[0], forward(node, age=3))
    assert not node.apply_action(IDS[0], forward(node, age=-1))
    assert node.apply_action(IDS[0], forward(node, 0.1, age=2))
    assert node.apply_action(IDS[0], forward(node, 0.2, age=1))
    assert not node.apply_action(IDS[0], forward(node, 0.3, age=2))
    assert node.counts == {"stale": 3}
    node.step()
    assert node.arena.world.wheel_speeds[0, 0] == 0.2


def test_a_command_to_stop_is_never_too_late() -> None:
    """It has no time to live that could have expired."""
    node = filled_node(lockstep=False)
    assert node.apply_action(IDS[0], forward(node, 0.1, ttl_s=10.0))
    for _ in range(9):
        node.step()
    assert node.arena.world.wheel_speeds[0, 0] == 0.1
    assert node.apply_action(IDS[0], forward(node, 0.1, ttl_s=0.0, age=8))
    node.step()
    assert node.arena.world.wheel_speeds[0, 0] == 0.0


def test_an_action_is_clipped_to_the_limits() -> None:
    """As by every body."""
    node = filled_node()
    node.apply_action(IDS[0], Action(node.tick, pack_row(np.full(contract.ACTION_WIDTH, 1e9))))
    node.step()
    assert (node.arena.world.actions[0] == contract.limits(contract.ACTION)[1]).all()
