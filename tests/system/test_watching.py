"""An observer that joins late receives the history, the robots that are online, and those that crash and restart."""

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
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.support.process import Robot, wait_until
from tests.support.process_colony import colony

ROBOTS = 3


class ColonyView:
    """A subscriber that requests the history, and all its status changes."""

    def __init__(self, subscriber: TelemetrySubscriber) -> None:
        self.subscriber, self.monitor = subscriber, subscriber.monitor
        self.changes: list[StatusChange] = []

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Poll the subscriber until a condition holds."""

        def is_met() -> bool:
            self.changes += self.subscriber.poll()
            return condition()

        wait_until(is_met, what, 20.0)

    def events_of(self, robot: bytes, incarnation: int) -> list[EventMessage]:
        """Return the events of an incarnation of a robot, in order."""
        events = [change.message for change in self.changes if isinstance(change, EventReceived)]
        return sorted(
            (
                message
                for message in events
                if (message.robot, message.incarnation) == (robot, incarnation)
            ),
            key=lambda message: message.seq,
        )

    def knows_all(self) -> bool:
        """Return whether all robots and the arena are online with their metadata, and no event is missing."""
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


def check_history(view: ColonyView, robots: list[bytes]) -> None:
    """Check that every event of each robot has arrived once, from its birth on, with its settings and peers."""
    for status in view.monitor.alive:
        events, metadata = view.events_of(status.robot, status.incarnation), status.metadata
        assert [event.seq for event in events] == list(range(1, len(events) + 1))
        assert isinstance(events[0].event, Born)
        assert metadata is not None
        assert set(metadata.peers) == set(robots) - {status.robot}
        assert msgspec.json.decode(metadata.settings)["life"]["agents"] == 8


def check_arena(arena: ArenaStatus) -> None:
    """Check that its metadata are of its present run."""
    assert arena.scene is not None
    assert arena.metadata is not None
    assert arena.metadata.arena_run == arena.arena_run == arena.scene.arena_run
    assert msgspec.json.decode(arena.metadata.settings)["body"]["encounter_range_m"] == 0.8


def check_restart(view: ColonyView, robot: Robot) -> None:
    """Check that a robot that is killed goes offline, and restarts in a new incarnation without a missing event."""
    me, incarnation = robot.id, view.monitor.robots[robot.id].incarnation
    robot.kill()
    view.wait(lambda: RobotLeft(me) in view.changes, "it is offline")
    robot.start()
    view.wait(lambda: view.monitor.robots[me].incarnation > incarnation, "it has restarted")
    newer = view.monitor.robots[me].incarnation
    view.wait(view.knows_all, "its new incarnation is known")
    view.wait(lambda: bool(view.events_of(me, newer)), "its new incarnation publishes events")
    expected = (RobotJoined(me), RobotLeft(me), RobotRestarted(me, newer))
    changes = [one for one in view.changes if one in expected]
    assert changes == [expected[0], expected[1], expected[0], expected[2]]


def test_a_late_observer_receives_the_history_and_notices_a_restart(
    tmp_path: Path,
) -> None:
    """By queries to the robots and the arena; no sample is malformed or lost."""
    samples: list[RawSample] = []
    with colony(tmp_path) as made:
        made.arena(ROBOTS, "--hz", "30")
        for _ in range(ROBOTS):
            made.robot()
        for robot in made.robots:
            robot.wait_for("mated with")
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            late = ColonyView(
                TelemetrySubscriber(
                    session, sends_requests=True, history=10_000, on_raw_sample=samples.append
                )
            )
            late.wait(late.knows_all, "all robots are known, with their history")
            check_history(late, made.ids)
            check_arena(late.monitor.arenas["arena"])
            assert ArenaJoined("arena") in late.changes
            check_restart(late, made.robots[0])
            assert late.monitor.malformed == late.monitor.ignored == late.subscriber.dropped == 0
    assert {one.kind for one in samples} == set(get_args(SampleKind))
