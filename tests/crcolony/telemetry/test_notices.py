"""A person is told what is awaited, and which robots cannot be reached from here."""

import msgspec

from crcolony.protocol.telemetry_messages import Activity, Scene, SceneRobot
from crcolony.telemetry.notices import notices
from tests.support.fed_monitor import A_SCENE, ARENA, COLONY, IDS, ME, FedMonitor, T, state


def scene_of(*robots: bytes, colony: str = "blue") -> Scene:
    """Return a scene with these robots."""
    assert isinstance(A_SCENE, Scene)
    bodies = [
        SceneRobot(robot, colony, 0.0, 0.0, 0.0, False, 1.0, 0.0, 0.0, False) for robot in robots
    ]
    return msgspec.structs.replace(A_SCENE, robots=bodies)


def monitor_of(colony: str = "*") -> FedMonitor:
    """Return a monitor that an arena of four robots has been seen by, and two of them."""
    monitor = FedMonitor(colony)
    monitor.handle("online", ARENA.alive(7, "a"))
    for robot in IDS[:2]:
        monitor.online(robot=robot)
    monitor.handle("scene", ARENA.scene, scene_of(*IDS[:4]))
    return monitor


def test_robots_of_the_scene_whose_tokens_are_not_seen_cannot_be_reached() -> None:
    """Said after a moment, as tokens may still come; with what helps."""
    monitor = monitor_of()
    assert notices(monitor, T + 1.0) == []
    line = (
        "2 of 4 robots in arena lab cannot be reached from here: open their ports, or use --client"
    )
    assert notices(monitor, T + 4.0) == [line]
    monitor.online(robot=IDS[2])
    monitor.online(robot=IDS[3])
    monitor.handle("scene", ARENA.scene, scene_of(*IDS[:4]))
    assert notices(monitor, T + 4.0) == []


def test_a_robot_that_went_offline_is_not_called_unreachable_while_its_body_stays() -> None:
    """The arena removes the body 30 s later; if not, the arena sees a robot that is not seen here."""
    monitor = monitor_of()
    monitor.handle("scene", ARENA.scene, scene_of(*IDS[:2]))
    monitor.offline(robot=IDS[0])
    monitor.handle("scene", ARENA.scene, scene_of(*IDS[:2]))
    assert notices(monitor, T + 30.0) == []
    assert notices(monitor, T + 40.0)[0].startswith("1 of 2 robots in arena lab cannot be reached")


def test_robots_of_other_colonies_are_not_expected() -> None:
    """Of one colony only its own tokens arrive."""
    monitor = monitor_of("blue")
    monitor.handle("scene", ARENA.scene, scene_of(*IDS[2:4], colony="red"))
    assert notices(monitor, T + 4.0) == []


def test_what_is_awaited_is_said() -> None:
    """Robots and an arena, or robots only; nothing where a robot is on its way or nobody answers."""
    monitor = FedMonitor()
    assert notices(monitor, T) == ["waiting for robots and an arena to come online …"]
    assert notices(monitor, T, ["nobody answers"]) == ["nobody answers"]
    monitor.handle("activity", ARENA.activity, Activity(7, "compiling the world", 1, 2))
    assert notices(monitor, T) == ["waiting for robots to come online …"]
    monitor.handle("activity", COLONY.activity(ME), Activity(7, "compiling the step", 1, 2))
    assert notices(monitor, T) == []
    monitor.online()
    monitor.state(state())
    assert notices(monitor, T + 60.0) == []
