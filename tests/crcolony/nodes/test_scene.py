"""A scene contains what an observer needs of an arena, and fits into a message."""

from crcolony.body import contract
from crcolony.protocol.codec import encode
from crcolony.protocol.telemetry_messages import decode_scene
from tests.support.arena_nodes import IDS, join, new_node


def test_a_scene_contains_every_body_and_pack() -> None:
    """With its robot, pose, beacon and lamp, and whether its jaw holds a pack; bodies that have left are not in it."""
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
    body = scene.robots[1]
    assert [body.x_m, body.y_m, body.heading_rad] == world.poses[2].tolist()
    assert (body.beacon, body.red, body.green, body.blue, body.holds) == (True, 0, 0.5, 0, True)
    assert [(pack.x_m, pack.y_m) for pack in scene.packs] == [tuple(p) for p in world.packs]
    assert [pack.charge for pack in scene.packs] == world.pack_charges.tolist()


def test_the_scene_of_many_robots_fits_into_a_message() -> None:
    """However many robots there are and however long the names of their colonies."""
    node = new_node("robots=1100", "arena.packs_per_robot=2")
    for number in range(1100):
        node.join(number.to_bytes(16), "c" * 64)
    scene = decode_scene(encode(node.scene("a" * 64, 2**52, 2**52)))
    assert (len(scene.robots), len(scene.packs)) == (1000, 2000)
