"""The process of a host: an arena, and robots that live in the same process.

The bodies and the robots of the process step together in compiled code; robots of other processes may have bodies in
the same arena. All of them mate by the same messages.
"""

import time
from collections.abc import Callable

from crcolony.runtime.hosted_robots import HostedRobots
from crcolony.runtime.networked_arena import NetworkedArena
from crcolony.runtime.real_time_loop import run_in_real_time
from crcolony.transport.connection import Connection
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import (
    EnvelopeReceived,
    InboundEvent,
    QueryReceived,
    RobotOffline,
    RobotOnline,
)

_STATUS_PERIOD_S = 5.0
"""How often a line about the robots is printed."""


class HostProcess:
    """Runs a `NetworkedArena` and the robots of this process, by the wall clock or as fast as possible."""

    def __init__(
        self,
        arena: NetworkedArena,
        robots: HostedRobots,
        inbox: Inbox,
        connection: Connection,
        print_line: Callable[[str], None],
    ) -> None:
        self._arena, self._robots, self._inbox = arena, robots, inbox
        self._connection, self._print_line = connection, print_line
        self._status_due_s = time.monotonic()

    def start(self, settings: str) -> None:
        """Start all robots, which report `settings` as JSON. Raises CrcolonyError if a stored one does not fit."""
        self._connection.on_roster(lambda roster: self._robots.set_revoked(roster.revoked_robots))
        self._robots.start(time.monotonic(), self._arena.node, self._arena.name, settings)

    def stop(self) -> None:
        """Save all robots, and disconnect them."""
        self._robots.stop()

    def run(self, is_stopped: Callable[[], bool], wall_period_s: float | None) -> None:
        """Run until stopped, then save. `wall_period_s` None: as fast as possible, without waiting for robots."""
        self._arena.accept_local_robots(self._inbox)
        try:
            if wall_period_s is None:
                self._run_fast(is_stopped)
            else:
                run_in_real_time(self, self._inbox, wall_period_s, is_stopped)
        finally:
            self._arena.close()
        self._arena.save()

    def _run_fast(self, is_stopped: Callable[[], bool]) -> None:
        while not is_stopped():
            self.step()
            while (event := self._inbox.get(0.0)) is not None:
                self.handle_event(event)
            self.handle_timers(time.monotonic())

    def step(self) -> None:
        """Make one control period pass for the arena and for the robots of this process."""
        node = self._arena.node
        self._robots.set_actions(node)
        node.step()
        self._robots.step(time.monotonic(), node)
        self._arena.publish_tick(robot for robot in node.robots if robot not in self._robots)

    def handle_event(self, event: InboundEvent) -> None:
        """Pass an inbound event to the robots, to the arena, or to both."""
        is_for_arena = is_for_robots = True
        match event:
            case EnvelopeReceived() | QueryReceived(topic="history"):
                is_for_arena = False
            case QueryReceived(topic="metadata", robot=robot):
                is_for_robots = bool(robot)
                is_for_arena = not robot
            case RobotOffline(robot=robot):  # a robot of this process never loses its body
                is_for_arena = robot not in self._robots
            case RobotOnline():
                pass
            case _:
                is_for_robots = False
        if is_for_arena:
            self._arena.handle_event(event)
        if is_for_robots:
            self._robots.handle_event(time.monotonic(), event)

    def handle_timers(self, now_s: float) -> None:
        """Do what is due."""
        self._connection.handle_timers(now_s)
        self._arena.handle_timers(now_s)
        self._robots.handle_timers(now_s, self._inbox.dropped)
        if now_s >= self._status_due_s:
            self._status_due_s = now_s + _STATUS_PERIOD_S
            self._print_line(self._format_status())

    def _format_status(self) -> str:
        node, robots = self._arena.node, self._robots.nodes
        return (
            f"tick {node.tick}: {len(robots)} robots here,"
            f" {len(node.robots) - len(robots)} from other processes,"
            f" generation {min(robot.robot.generation for robot in robots)},"
            f" matings {sum(robot.matings for robot in robots) / 2:g},"
            f" offspring {sum(robot.conceptions for robot in robots)}"
        )
