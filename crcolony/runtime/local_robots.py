"""How the process of an arena or a bridge comes to share memory with the robots on its machine."""

from collections.abc import Callable

from crcolony.body_server.body_server import BodyServer
from crcolony.body_server.body_slots import BodySlots
from crcolony.protocol.identity import RobotId
from crcolony.transport.inbox import Inbox
from crcolony.transport.local_robots import LocalRobots, LocalRobotsUser
from crcolony.transport.local_socket import HAS_LOCAL_LINKS


def accept_local_robots(
    server: BodyServer,
    bodies: BodySlots,
    inbox: Inbox,
    publish: Callable[[RobotId, bytes], None],
    on_actions: Callable[[], None] | None = None,
) -> None:
    """Share memory with the robots on this machine, where that is possible; all others use the network, with `publish`.

    A robot that has not answered the present observation gets it again as soon as its link is open; one that has joined
    in this tick gets the next one first. `on_actions` takes the actions of all robots at once; without it they are
    applied one by one.
    """
    if not HAS_LOCAL_LINKS:
        return

    def apply_actions() -> None:
        for robot, tick, row in local.take_actions():
            bodies.apply_row(robot, tick, row)

    def repeat_observation(robot: RobotId) -> None:
        if robot in bodies.waiting_for:
            server.publish_observations([robot], publish)

    user = LocalRobotsUser(server.prove_local, repeat_observation, on_actions or apply_actions)
    try:
        local = LocalRobots(bodies.arena_run, bodies.slots, inbox, user)
    except OSError:  # a system that has no such sockets or memory
        return
    server.local_robots = local
