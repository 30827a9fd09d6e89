"""Whoever comes late to a colony of processes learns what was before, who is there, and who dies and comes back."""

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import msgspec
import pytest

from crcolony.evolution.history import Born
from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.telemetry_messages import EventMessage
from crcolony.telemetry import subscriber
from crcolony.telemetry.colony_monitor import SampleKind, TelemetrySample
from crcolony.telemetry.robot_status import ArenaStatus
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    EventReceived,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
    StatusChange,
)
from crcolony.telemetry.subscriber import TelemetrySubscriber
from crcolony.transport.zenoh_session import NetworkSettings, free_port, open_session
from tests.support.process import Robot, wait_until
from tests.support.process_colony import colony

ROBOTS = 3


class ColonyView:
    """A watcher that asks, and all the news that it had."""

    def __init__(self, watcher: TelemetrySubscriber) -> None:
        self.watcher, self.monitor = watcher, watcher.monitor
        self.news: list[StatusChange] = []

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        def is_so() -> bool:
            self.news += self.watcher.poll()
            return condition()

        wait_until(is_so, what, 20.0)

    def told(self, robot: bytes, life: int) -> list[EventMessage]:
        """Return the events of a robot's life, in order."""
        events = [news.message for news in self.news if isinstance(news, EventReceived)]
        return sorted(
            (told for told in events if (told.robot, told.incarnation) == (robot, life)),
            key=lambda told: told.seq,
        )

    def knows_all(self) -> bool:
        """Whether all are there, have said what they are like and whom they see, and nothing is missing."""
        arena = self.monitor.arenas.get("arena")
        is_known = arena is not None and arena.metadata is not None
        return (
            is_known
            and len(self.monitor.alive) == ROBOTS
            and all(
                watched.metadata is not None
                and watched.metadata.incarnation == watched.incarnation
                and len(watched.metadata.peers) == ROBOTS - 1
                and watched.sequence is not None
                and not watched.sequence.missing
                for watched in self.monitor.alive
            )
        )


def check_past(spectator: ColonyView, robots: list[bytes]) -> None:
    """Every event of each robot has come, from its birth on, once; and what it is like, and whom it sees."""
    for watched in spectator.monitor.alive:
        told, about = spectator.told(watched.robot, watched.incarnation), watched.metadata
        assert [one.seq for one in told] == list(range(1, len(told) + 1))
        assert isinstance(told[0].event, Born)
        assert about is not None
        assert set(about.peers) == set(robots) - {watched.robot}
        assert msgspec.json.decode(about.settings)["life"]["agents"] == 8


def check_arena(arena: ArenaStatus) -> None:
    """What it is like is known, of this run of it."""
    assert arena.scene is not None
    assert arena.metadata is not None
    assert arena.metadata.arena_run == arena.arena_run == arena.scene.arena_run
    assert msgspec.json.decode(arena.metadata.settings)["body"]["encounter_range_m"] == 0.8


def check_comeback(spectator: ColonyView, robot: Robot) -> None:
    """A robot that is killed vanishes, and comes back in a newer life of which nothing is missed."""
    me, life = robot.id, spectator.monitor.robots[robot.id].incarnation
    robot.kill()
    spectator.wait(lambda: RobotLeft(me) in spectator.news, "it has vanished")
    robot.start()
    spectator.wait(lambda: spectator.monitor.robots[me].incarnation > life, "it is back")
    new_life = spectator.monitor.robots[me].incarnation
    spectator.wait(spectator.knows_all, "it is known in its new life")
    spectator.wait(lambda: bool(spectator.told(me, new_life)), "it tells of its new life")
    of_it = (RobotJoined(me), RobotLeft(me), RobotRestarted(me, new_life))
    news = [one for one in spectator.news if one in of_it]
    assert news == [of_it[0], of_it[1], of_it[0], of_it[2]]


def test_who_comes_late_learns_what_was_before_and_sees_who_dies_and_comes_back(
    tmp_path: Path,
) -> None:
    """By asking robots and the arena; nothing that was heard is malformed or lost."""
    heard: list[TelemetrySample] = []
    with colony(tmp_path) as made:
        made.arena(ROBOTS, "--hz", "30")
        for _ in range(ROBOTS):
            made.robot()
        for robot in made.robots:
            robot.wait_for("mated with")
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            late = ColonyView(
                TelemetrySubscriber(session, asks=True, history=10_000, hear=heard.append)
            )
            late.wait(late.knows_all, "all robots are known, with their past")
            check_past(late, made.ids)
            check_arena(late.monitor.arenas["arena"])
            assert ArenaJoined("arena") in late.news
            check_comeback(late, made.robots[0])
            assert late.monitor.malformed == late.monitor.ignored == late.watcher.dropped == 0
    assert {one.kind for one in heard} == set(get_args(SampleKind))


def test_too_much_at_once_is_dropped_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tokens have twice the room, since they are not said again; what is longer than a message may be is not kept."""
    monkeypatch.setattr(subscriber, "_MOST_WAITING", 10)
    of = ColonyKeys("blue")
    heard: list[TelemetrySample] = []
    with open_session(NetworkSettings(listen=(f"tcp/127.0.0.1:{free_port()}",))) as session:
        watching = TelemetrySubscriber(session, "blue", hear=heard.append)
        session.put(of.state(bytes(16)), bytes(MAX_BODY_MESSAGE_BYTES + 1))
        for _ in range(14):
            session.put(of.event(bytes(16)), b"noise")
        tokens = [
            session.liveliness().declare_token(of.alive(bytes(16), life, "a")) for life in range(15)
        ]
        assert watching.poll() == [
            RobotJoined(bytes(16)),
            *(RobotRestarted(bytes(16), life) for life in range(1, 10)),
        ]
        assert watching.dropped == 5 + 5
        assert watching.poll() == []
        assert len(tokens) == 15
    assert [one.kind for one in heard] == ["state", *["event"] * 9, *["alive"] * 10]
    assert heard[0].data == b""
    assert watching.monitor.malformed == 10
