"""Robots come to an arena, act, and go; it waits for whom it should, and nothing that is sent to it does harm."""

import io
from pathlib import Path

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract import Body
from crcolony.body.contract_test import BodyContract, random_action
from crcolony.body.settings import CyberRodent
from crcolony.compiled import FloatArray
from crcolony.config import Config, load
from crcolony.evolution.history import Mated
from crcolony.in_process.colony import InProcessColony
from crcolony.nodes.arena_node import ArenaNode
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    decode_action,
    decode_join_reply,
    decode_observation,
    pack_row,
    unpack_row,
)
from crcolony.protocol.codec import encode
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.telemetry_messages import decode_scene
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.robot.robot import Robot
from crcolony.robot.state import SLICE_OVER
from crcolony.storage.checkpoint import read_checkpoint, write_checkpoint
from tests.support.small_colony import Recorder, small

IDS = [seeded("test", 1, number).id for number in range(8)]


def new_node(*settings: str, lockstep: bool = True, expect: int = 0) -> ArenaNode:
    return ArenaNode(small(*settings), 7, lockstep, expect)


def join(node: ArenaNode, robot: int, colony: str = "test", number: int = -1) -> BodyGranted:
    answer = decode_join_reply(encode(node.join(Join(IDS[robot], colony, number))))
    assert isinstance(answer, BodyGranted)
    return answer


def filled_node(*settings: str, lockstep: bool = True) -> ArenaNode:
    """Return a node with four robots, observed once."""
    node = new_node(*settings, lockstep=lockstep)
    for robot in range(4):
        join(node, robot)
    node.step()
    return node


def forward(node: ArenaNode, speed_m_s: float = 0.1, ttl_s: float = 0.5, age: int = 0) -> Action:
    row = np.zeros(contract.ACTION_WIDTH)
    row[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]] = speed_m_s
    row[contract.TTL] = ttl_s
    return Action(node.tick - age, pack_row(row))


def ids(node: ArenaNode) -> list[int]:
    """Return the numbers of those that are waited for."""
    return [IDS.index(robot) for robot in node.waiting_for]


# The same world -----------------------------------------------------------------------------------------------------


def lone_robot(config: Config, number: int) -> Robot:
    """Return one robot of a colony in a batch of its own, as its own process has it."""
    streams = numbered_streams(config.seed, number, 1)
    robot = make_robots(config, [str(number)], streams)[2][0]
    robot.start()
    return robot


def test_robots_that_send_messages_live_in_the_embedded_colonys_world() -> None:
    """Until the first mating every pose and every pack is the same in every tick, bit for bit."""
    config = small("seed=4")
    recorder = Recorder()
    colony = InProcessColony(config, recorder)
    colony.start()
    node = ArenaNode(config, 7, lockstep=True, expect=4)
    robots = {IDS[number]: lone_robot(config, number) for number in range(4)}
    for number in (2, 0, 3, 1):
        join(node, number, number=number)
    while True:
        colony.run(1)
        if recorder.all(Mated):
            break
        assert node.is_ready
        node.step()
        assert np.array_equal(node.arena.world.poses, colony.arena.world.poses)
        assert np.array_equal(node.arena.world.packs, colony.arena.world.packs)
        for name, robot in robots.items():
            assert not node.is_ready
            observation = decode_observation(node.observation(name))
            answer = Action(observation.tick, pack_row(robot.step(unpack_row(observation.row))))
            if robot.events & SLICE_OVER:
                assert robot.hand_over()
            assert node.apply_action(name, decode_action(encode(answer)))
    assert node.tick > 300


def test_robots_of_this_process_command_their_bodies_directly() -> None:
    """It is the same world as with messages, and in lockstep they count as having acted."""
    node, direct = filled_node(), filled_node()
    rng = np.random.default_rng(1)
    for _ in range(50):
        for robot in range(4):
            asked = random_action(rng)
            assert node.apply_action(IDS[robot], Action(node.tick, pack_row(asked)))
            assert not direct.is_ready
            direct.set_action(direct.slot_of(IDS[robot]), asked)
        assert direct.is_ready
        node.step()
        direct.step()
        assert node.observation(IDS[0]) == direct.observation(IDS[0])
    assert np.array_equal(node.arena.world.poses, direct.arena.world.poses)


@pytest.mark.parametrize("storage", ["memory", "checkpoint"])
def test_a_restored_arena_goes_on_identically(storage: str, tmp_path: Path) -> None:
    """Also from between two actions of a tick, and from a file: the same places, answers, poses and scenes."""
    node = filled_node("body.observation_latency_steps=1")
    node.leave(IDS[2])
    join(node, 5, "other")
    rng = np.random.default_rng(2)
    for _ in range(30):
        for robot in node.waiting_for:
            node.apply_action(robot, Action(node.tick, pack_row(random_action(rng))))
        node.step()
    node.apply_action(IDS[3], Action(node.tick, pack_row(random_action(rng))))
    saved = node.save()
    if storage == "checkpoint":
        buffer = io.BytesIO()
        write_checkpoint(buffer, saved)
        (tmp_path / "arena.npz").write_bytes(buffer.getvalue())
        saved = read_checkpoint(tmp_path / "arena.npz")
    other = new_node("body.observation_latency_steps=1")
    other.restore(saved)
    futures = []
    for one in (node, other):
        again = np.random.default_rng(3)
        assert [IDS.index(robot) for robot in one.waiting_for] == [0, 1, 5]
        for _ in range(30):
            for robot in one.waiting_for:
                one.apply_action(robot, Action(one.tick, pack_row(random_action(again))))
            one.step()
        futures.append([one.observation(robot) for robot in one.robots])
        futures[-1].append(encode(one.scene("arena", 1, 2)))
    assert futures[0] == futures[1]


def test_a_saved_arena_of_other_settings_is_refused() -> None:
    """It does not fit, and says so."""
    with pytest.raises(ValueError, match="does not fit"):
        new_node("robots=5").restore(new_node().save())


# Coming and going ---------------------------------------------------------------------------------------------------


def test_who_joins_learns_about_its_body() -> None:
    """Place, run, tick, period, whether it is waited for, and what the body can do."""
    node = new_node("body.camera_range_m=1.25", "arena.control_period_s=0.1")
    join(node, 0)
    node.step()
    answer = join(node, 1)
    assert (answer.slot, answer.arena_run, answer.tick) == (1, 7, 1)
    assert (answer.period_s, answer.lockstep) == (0.1, True)
    assert load(None, [f"body={{{_toml(answer.body)}}}"]).body == CyberRodent(camera_range_m=1.25)


def _toml(json: str) -> str:
    return json.strip("{}").replace('"', "").replace(":", "=")


def test_a_robot_gets_the_place_it_would_like_if_it_is_free() -> None:
    """Else the first that is; a wish that no arena could grant is no wish."""
    node = new_node()
    assert join(node, 0, number=2).slot == 2
    assert join(node, 1, number=2).slot == 0
    assert join(node, 2, number=99).slot == 1
    assert join(node, 3).slot == 3
    assert node.robots == {IDS[0]: 2, IDS[1]: 0, IDS[2]: 1, IDS[3]: 3}


def test_a_full_arena_refuses_and_says_how_large_it_is() -> None:
    """Until somebody leaves."""
    node = filled_node()
    answer = node.join(Join(IDS[4], "test", -1))
    assert isinstance(answer, BodyDenied)
    assert "all 4 places" in answer.reason
    assert node.counts["full"] == 1
    node.leave(IDS[1])
    node.leave(IDS[1])
    assert join(node, 4, number=3).slot == 1


def test_a_robot_that_joins_again_keeps_its_body() -> None:
    """It has moved nowhere, even if it would like another place now."""
    node = filled_node()
    node.leave(IDS[3])
    pose = node.arena.world.poses[1].copy()
    assert join(node, 1, number=3).slot == 1
    assert np.array_equal(node.arena.world.poses[1], pose)
    assert len(node.robots) == 3


def test_more_robots_than_places_are_not_expected() -> None:
    """It would wait for ever."""
    with pytest.raises(ValueError, match="5 are expected"):
        new_node(expect=5)


def test_lockstep_begins_when_all_who_are_expected_have_joined() -> None:
    """The first tick comes before anybody has observed anything."""
    node = new_node(expect=2)
    assert not node.is_ready
    join(node, 0)
    assert not node.is_ready
    join(node, 1)
    assert node.is_ready
    assert not node.waiting_for


def test_lockstep_waits_for_everybody_who_has_observed() -> None:
    """And for nobody twice; who joins late is waited for from the next tick on, who leaves never."""
    node = filled_node()
    assert ids(node) == [0, 1, 2, 3]
    node.leave(IDS[3])
    for robot in (0, 2):
        assert node.apply_action(IDS[robot], forward(node))
    join(node, 5)
    assert ids(node) == [1]
    assert not node.is_ready
    node.apply_action(IDS[1], forward(node))
    assert node.is_ready
    node.step()
    assert ids(node) == [0, 1, 2, 5]


def test_lockstep_stands_still_where_nobody_is_there() -> None:
    """Whether all have left or all are lost; real time goes on."""
    node = new_node()
    assert not node.is_ready
    join(node, 0)
    node.step()
    node.mark_offline(IDS[0], 0.0)
    assert not node.is_ready
    assert new_node(lockstep=False).is_ready


def test_nobody_waits_for_a_lost_robot_and_its_body_stops() -> None:
    """Within its time to live; when it is back it is waited for, and drives on in the same place."""
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
    ways_m = np.hypot(*np.diff(poses, axis=0)[:, :2].T)
    assert ways_m == pytest.approx([0.02, 0.02, 0.0, 0.0, 0.0])
    node.mark_online(IDS[1])
    assert ids(node) == [0, 1, 2, 3]
    assert node.apply_action(IDS[1], forward(node))


def test_a_lost_body_is_removed_after_the_grace() -> None:
    """Counted from when it was lost first, and not if the robot was found or joined again meanwhile."""
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
    """Let two robots stand opposite each other with their beacons on, and a tick pass."""
    slots = [node.slot_of(IDS[robot]) for robot in robots]
    node.arena.world.poses[slots] = [(-0.2, 0.0, 0.0), (0.2, 0.0, np.pi)]
    row = np.zeros(contract.ACTION_WIDTH)
    row[[contract.BEACON, contract.TTL]] = 1.0
    for robot in robots:
        assert node.apply_action(IDS[robot], Action(node.tick, pack_row(row)))
    node.step()


def contact(node: ArenaNode, robot: int) -> Contact | None:
    return decode_observation(node.observation(IDS[robot])).contact


def test_a_contact_names_the_other_robot_and_the_nonce() -> None:
    """Both sides hear of each other and of the same number, and nobody else hears of anybody."""
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
    """Numbers are given in the order of their first robots; those of one colony do meet."""
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


def test_the_names_of_colonies_that_are_gone_take_no_memory() -> None:
    """Whoever comes with ever new names leaves no more of them behind than there are places."""
    node = new_node()
    join(node, 0, "here")
    for k in range(20):
        join(node, 1, f"passing-{k}")
        assert node.colony_of(IDS[1]) == f"passing-{k}"
    assert len(node.robots) == 2
    assert len(node.colonies) == 4
    assert node.colony_of(IDS[0]) == "here"


# What is refused ----------------------------------------------------------------------------------------------------


def test_what_is_no_action_is_refused_and_counted() -> None:
    """Numbers that are none, rows of another length, and actions of robots without a body move nothing."""
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


def test_lockstep_takes_one_action_for_the_present_tick() -> None:
    """The first; not another, not one for a tick that has passed or is to come, and none before an observation."""
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


def test_real_time_takes_late_actions_in_order_while_they_live() -> None:
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
    """It has no time to live that could have run out."""
    node = filled_node(lockstep=False)
    assert node.apply_action(IDS[0], forward(node, 0.1, ttl_s=10.0))
    for _ in range(9):
        node.step()
    assert node.arena.world.wheel_speeds[0, 0] == 0.1
    assert node.apply_action(IDS[0], forward(node, 0.1, ttl_s=0.0, age=8))
    node.step()
    assert node.arena.world.wheel_speeds[0, 0] == 0.0


def test_what_is_beyond_limits_is_clipped() -> None:
    """As every body does."""
    node = filled_node()
    node.apply_action(IDS[0], Action(node.tick, pack_row(np.full(contract.ACTION_WIDTH, 1e9))))
    node.step()
    assert (node.arena.world.actions[0] == contract.limits(contract.ACTION)[1]).all()


# What is shown ------------------------------------------------------------------------------------------------------


def test_a_scene_shows_every_body_and_pack_as_they_are() -> None:
    """With whose it is, where it stands, its beacon and lamp, and what its jaw holds; absent ones are not shown."""
    node = new_node()
    for robot, colony in ((0, "red"), (1, "blue"), (2, "red")):
        join(node, robot, colony)
    node.leave(IDS[1])
    world = node.arena.world
    world.actions[2, [contract.BEACON, contract.LED + 1]] = 1.0, 0.5
    world.holding[2] = 3
    scene = decode_scene(encode(node.scene("arena", 5, 6)))
    assert (scene.arena, scene.arena_run, scene.seq, scene.tick, scene.unix_ms) == (
        "arena",
        7,
        5,
        0,
        6,
    )
    assert [(robot.robot, robot.colony) for robot in scene.robots] == [
        (IDS[0], "red"),
        (IDS[2], "red"),
    ]
    seen = scene.robots[1]
    assert [seen.x_m, seen.y_m, seen.heading_rad] == world.poses[2].tolist()
    assert (seen.beacon, seen.red, seen.green, seen.blue, seen.holds) == (True, 0, 0.5, 0, True)
    assert [(pack.x_m, pack.y_m) for pack in scene.packs] == [tuple(p) for p in world.packs]
    assert [pack.charge for pack in scene.packs] == world.pack_charges.tolist()


def test_the_scene_of_a_crowd_fits_into_a_message() -> None:
    """However many robots there are and however long the names of their colonies."""
    node = new_node("robots=1100", "arena.packs_per_robot=2")
    for number in range(1100):
        assert isinstance(node.join(Join(number.to_bytes(16), "c" * 64, -1)), BodyGranted)
    scene = decode_scene(encode(node.scene("a" * 64, 2**52, 2**52)))
    assert (len(scene.robots), len(scene.packs)) == (1000, 2000)


# The contract -------------------------------------------------------------------------------------------------------


class NodeBody:
    """A body at the other end of the messages: what a robot's process has, without the network."""

    def __init__(self, node: ArenaNode, robot: RobotId) -> None:
        self._node, self._robot = node, robot
        self._tick = 0

    def read(self) -> FloatArray:
        self._node.step()
        observation = decode_observation(self._node.observation(self._robot))
        self._tick = observation.tick
        return unpack_row(observation.row)

    def act(self, action: FloatArray) -> FloatArray:
        applied = contract.clip_action(action)
        message = encode(Action(self._tick, pack_row(applied)))
        self._node.apply_action(self._robot, decode_action(message))
        return applied

    def close(self) -> None:
        self._node.leave(self._robot)


class TestNodeBody(BodyContract):
    """A body behind messages keeps the contract, with all its senses."""

    def new_body(self) -> Body:
        senses = ("body.infrared=true", "body.inertial=true", "body.microphones=true")
        node = new_node(*senses, "arena.width_m=2.0", lockstep=False)
        join(node, 0)
        return NodeBody(node, IDS[0])
