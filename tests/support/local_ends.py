"""Both ends of links on one machine in one process, for tests: an arena's, and those of robots, over real sockets."""

import gc
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.compiled import FloatArray
from crcolony.protocol.body_messages import LocalLink
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import RobotId, seeded
from crcolony.protocol.link_keys import LinkKeys
from crcolony.protocol.local_link import check_robot, prove_body, read_claim
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import LocalObservation
from crcolony.transport.local_body import LocalBody
from crcolony.transport.local_robots import LocalRobots, LocalRobotsUser

IDS = [seeded("test", 1, number).id for number in range(4)]
SLOTS = len(IDS)
_ROUNDS = 8
"""A handshake takes fewer rounds of both loops"""


def new_keys() -> LinkKeys:
    return LinkKeys(secrets.token_bytes(32), secrets.token_bytes(32))


def new_run() -> int:
    """Return a run that no other process of this machine has."""
    return secrets.randbelow(2**62)


def observation(number: float = 0.0) -> FloatArray:
    return np.full(OBSERVATION_WIDTH, number)


def action(number: float = 0.0) -> FloatArray:
    return np.full(ACTION_WIDTH, number)


def open_files() -> int:
    """Return how many files this process has open, without those of objects that nobody has any more."""
    gc.collect()
    return len(os.listdir("/proc/self/fd"))


class ArenaEnd:
    """The process of an arena: robot k of `IDS` has slot k."""

    def __init__(self, run: int | None = None) -> None:
        self.run = new_run() if run is None else run
        self.inbox = Inbox()
        self.keys: dict[RobotId, LinkKeys] = {}
        self.opened: list[RobotId] = []
        """Robots whose links were opened, in order"""
        self.actions: list[tuple[RobotId, int, float]] = []
        """Robot, tick, and the first number of the row"""
        user = LocalRobotsUser(self._verify, self.opened.append, self._take)
        self.local = LocalRobots(self.run, SLOTS, self.inbox, user)

    def _verify(self, challenge: bytes, data: bytes) -> tuple[RobotId, int, bytes]:
        robot = read_claim(data).robot
        if robot not in self.keys:
            raise WireError("of no link")
        link = LocalLink(robot, self.run, challenge)
        check_robot(data, link, self.keys[robot])
        return robot, IDS.index(robot), prove_body(link, self.keys[robot])

    def _take(self) -> None:
        for robot, tick, row in self.local.take_actions():
            self.actions.append((robot, tick, float(row[0])))

    def handle(self) -> None:
        """Handle everything that waits, in its one loop."""
        while self.inbox.get(0.0) is not None:
            pass


class RobotEnd:
    """The process of one robot."""

    def __init__(self, robot: RobotId = IDS[0]) -> None:
        self.id = robot
        self.inbox = Inbox()
        self.local = LocalBody(self.inbox)
        self.observations: list[LocalObservation] = []

    def handle(self) -> None:
        """Handle everything that waits, in its one loop."""
        while (event := self.inbox.get(0.0)) is not None:
            assert isinstance(event, LocalObservation)
            self.observations.append(event)

    def open(self, arena: ArenaEnd, keys: LinkKeys | None = None) -> None:
        """Ask for the link with the keys that the arena has given to it, or others."""
        if keys is None:
            keys = arena.keys[self.id] = new_keys()
        self.local.open(self.id, arena.run, keys)


def exchange(*ends: ArenaEnd | RobotEnd) -> None:
    """Let the loops of these processes run until nobody has anything to say."""
    for _ in range(_ROUNDS):
        for end in ends:
            end.handle()


@contextmanager
def linked(robot: RobotId = IDS[0]) -> Iterator[tuple[ArenaEnd, RobotEnd]]:
    """An arena and a robot with an open link."""
    arena, end = ArenaEnd(), RobotEnd(robot)
    end.open(arena)
    exchange(arena, end)
    assert end.local.is_open
    yield arena, end
    end.local.close()
    arena.local.close()
