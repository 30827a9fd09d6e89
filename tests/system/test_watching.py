"""Whoever comes late to a colony of processes learns what was before, who is there, and who dies and comes back."""

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import msgspec

from crcolony.evolution.history import Born
from crcolony.protocol.telemetry_messages import EventMessage
from crcolony.telemetry.robot_status import ArenaStatus
from crcolony.telemetry.samples import RawSample, SampleKind
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.zenoh_session import NetworkSettings, open_session
from tests.support.process import Robot, wait_until
from tests.support.process_colony import colony

ROBOTS = 3


class ColonyView:
    """A watcher that asks, and all the news that it had."""

    def __init__(self, subscriber: TelemetrySubscriber) -> None:
        self.subscriber, self.monitor = subscriber, subscriber.monitor
        self.changes: list[StatusChange] = []

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        def is_so() -> bool:
            self.changes += self.subscriber.poll()
            return condition()

        wait_until(is_so, what, 20.0)

    def message(self, robot: bytes, incarnation: int) -> list[EventMessage]:
        """Return the events of a robot's life, in order."""
        events = [changes.message for changes in self.changes if isinstance(changes, EventReceived)]
        return sorted(
            (
                message
                for message in events
                if (message.robot, message.incarnation) == (robot, incarnation)
            ),
            key=lambda message: message.seq,
        )

    def knows_all(self) -> bool:
        """Whether all are there, have said what they are like and whom they see, and nothing is missing."""
        arena = self.monitor.arenas.get("arena")
        is_known = arena is not None and arena.metadata is not None
        return (
            is_known
            and len(self.monitor.alive) == ROBOTS
            and all(
                status.metadata is not None
                and status.metadata.incarnation == status.incarnation
                and len(status.metadata.peers) == ROBOTS - 1
                and status.sequence is not None
                and not status.sequence.missing
                for status in self.monitor.alive
            )
        )


def check_past(view: ColonyView, robots: list[bytes]) -> None:
    """Every event of each robot has come, from its birth on, once; and what it is like, and whom it sees."""
    for status in view.monitor.alive:
        message, about = view.message(status.robot, status.incarnation), status.metadata
        assert [one.seq for one in message] == list(range(1, len(message) + 1))
        assert isinstance(message[0].event, Born)
        assert about is not None
        assert set(about.peers) == set(robots) - {status.robot}
        assert msgspec.json.decode(about.settings)["life"]["agents"] == 8


def check_arena(arena: ArenaStatus) -> None:
    """What it is like is known, of this run of it."""
    assert arena.scene is not None
    assert arena.metadata is not None
    assert arena.metadata.arena_run == arena.arena_run == arena.scene.arena_run
    assert msgspec.json.decode(arena.metadata.settings)["body"]["encounter_range_m"] == 0.8


def check_comeback(view: ColonyView, robot: Robot) -> None:
    """A robot that is killed vanishes, and comes back in a newer life of which nothing is missed."""
    me, incarnation = robot.id, view.monitor.robots[robot.id].incarnation
    robot.kill()
    view.wait(lambda: RobotLeft(me) in view.changes, "it has vanished")
    robot.start()
    view.wait(lambda: view.monitor.robots[me].incarnation > incarnation, "it is back")
    new_life = view.monitor.robots[me].incarnation
    view.wait(view.knows_all, "it is known in its new life")
    view.wait(lambda: bool(view.message(me, new_life)), "it tells of its new life")
    of_it = (RobotJoined(me), RobotLeft(me), RobotRestarted(me, new_life))
    changes = [one for one in view.changes if one in of_it]
    assert changes == [of_it[0], of_it[1], of_it[0], of_it[2]]


def test_who_comes_late_learns_what_was_before_and_sees_who_dies_and_comes_back(
    tmp_path: Path,
) -> None:
    """By asking robots and the arena; nothing that was heard is malformed or lost."""
    sample: list[RawSample] = []
    with colony(tmp_path) as made:
        made.arena(ROBOTS, "--hz", "30")
        for _ in range(ROBOTS):
            made.robot()
        for robot in made.robots:
            robot.wait_for("mated with")
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            late = ColonyView(
                TelemetrySubscriber(
                    session, sends_requests=True, history=10_000, on_raw_sample=sample.append
                )
            )
            late.wait(late.knows_all, "all robots are known, with their past")
            check_past(late, made.ids)
            check_arena(late.monitor.arenas["arena"])
            assert ArenaJoined("arena") in late.changes
            check_comeback(late, made.robots[0])
            assert late.monitor.malformed == late.monitor.ignored == late.subscriber.dropped == 0
    assert {one.kind for one in sample} == set(get_args(SampleKind))
