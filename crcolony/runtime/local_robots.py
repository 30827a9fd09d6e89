"""How the process of an arena or a bridge comes to share memory with the robots on its machine."""

import contextlib
from collections.abc import Callable

from crcolony.body_server.body_server import BodyServer
from crcolony.protocol.identity import RobotId
from crcolony.transport.inbox import Inbox
from crcolony.transport.local_robots import LocalRobots
from crcolony.transport.local_socket import HAS_LOCAL_LINKS


def accept_local_robots(
    server: BodyServer, arena_run: int, inbox: Inbox, publish: Callable[[RobotId, bytes], None]
) -> None:
    """Share memory with the robots on this machine, where that is possible; all others use the network, with `publish`.

    A robot gets the present observation as soon as its link is open.
    """
    if HAS_LOCAL_LINKS:
        with contextlib.suppress(OSError):  # a system that has no such sockets or memory
            server.local_robots = LocalRobots(
                arena_run,
                inbox,
                server.prove_local,
                lambda robot: server.publish_observations([robot], publish),
            )
