"""Whoever comes late to a colony of processes learns what was before, who is there, and who dies and comes back."""

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import msgspec
import pytest

from crcolony.evolution.history import Born
from crcolony.protocol.codec import BODY_BYTES
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.protocol.telemetry_messages import Told
from crcolony.telemetry import subscriber
from crcolony.telemetry.colony_monitor import Heard, Kind
from crcolony.telemetry.robot_status import WatchedArena
from crcolony.telemetry.status_changes import (
    Appeared,
    ArenaAppeared,
    Happened,
    News,
    Restarted,
    Vanished,
)
from crcolony.telemetry.subscriber import Watcher
from crcolony.transport.zenoh_session import Network, free_port, open_session
from tests.support.process import Robot, wait_until
from tests.support.process_colony import colony

ROBOTS = 3


class Spectator:
    """A watcher that asks, and all the news that it had."""

    def __init__(self, watcher: Watcher) -> None:
        self.watcher, self.watch = watcher, watcher.watch
        self.news: list[News] = []

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        def is_so() -> bool:
            self.news += self.watcher.update()
            return condition()

        wait_until(is_so, what, 20.0)

    def told(self, robot: bytes, life: int) -> list[Told]:
        """Return the events of a robot's life, in order."""
        events = [news.told for news in self.news if isinstance(news, Happened)]
        return sorted(
            (told for told in events if (told.robot, told.life) == (robot, life)),
            key=lambda told: told.seq,
        )

    def knows_all(self) -> bool:
        """Whether all are there, have said what they are like and whom they see, and nothing is missing."""
        arena = self.watch.arenas.get("arena")
        is_known = arena is not None and arena.about is not None
        return (
            is_known
            and len(self.watch.alive) == ROBOTS
            and all(
                watched.about is not None
                and watched.about.life == watched.life
                and len(watched.about.peers) == ROBOTS - 1
                and watched.gaps is not None
                and not watched.gaps.missing
                for watched in self.watch.alive
            )
        )


def check_past(spectator: Spectator, robots: list[bytes]) -> None:
    """Every event of each robot has come, from its birth on, once; and what it is like, and whom it sees."""
    for watched in spectator.watch.alive:
        told, about = spectator.told(watched.robot, watched.life), watched.about
        assert [one.seq for one in told] == list(range(1, len(told) + 1))
        assert isinstance(told[0].event, Born)
        assert about is not None
        assert set(about.peers) == set(robots) - {watched.robot}
        assert msgspec.json.decode(about.settings)["life"]["agents"] == 8


def check_arena(arena: WatchedArena) -> None:
    """What it is like is known, of this run of it."""
    assert arena.scene is not None
    assert arena.about is not None
    assert arena.about.world == arena.world == arena.scene.world
    assert msgspec.json.decode(arena.about.settings)["body"]["encounter_range_m"] == 0.8


def check_comeback(spectator: Spectator, robot: Robot) -> None:
    """A robot that is killed vanishes, and comes back in a newer life of which nothing is missed."""
    me, life = robot.id, spectator.watch.robots[robot.id].life
    robot.kill()
    spectator.wait(lambda: Vanished(me) in spectator.news, "it has vanished")
    robot.start()
    spectator.wait(lambda: spectator.watch.robots[me].life > life, "it is back")
    new_life = spectator.watch.robots[me].life
    spectator.wait(spectator.knows_all, "it is known in its new life")
    spectator.wait(lambda: bool(spectator.told(me, new_life)), "it tells of its new life")
    of_it = (Appeared(me), Vanished(me), Restarted(me, new_life))
    news = [one for one in spectator.news if one in of_it]
    assert news == [of_it[0], of_it[1], of_it[0], of_it[2]]


def test_who_comes_late_learns_what_was_before_and_sees_who_dies_and_comes_back(
    tmp_path: Path,
) -> None:
    """By asking robots and the arena; nothing that was heard is malformed or lost."""
    heard: list[Heard] = []
    with colony(tmp_path) as made:
        made.arena(ROBOTS, "--hz", "30")
        for _ in range(ROBOTS):
            made.robot()
        for robot in made.robots:
            robot.wait_for("mated with")
        with open_session(Network(connect=(made.endpoint,))) as session:
            late = Spectator(Watcher(session, asks=True, history=10_000, hear=heard.append))
            late.wait(late.knows_all, "all robots are known, with their past")
            check_past(late, made.ids)
            check_arena(late.watch.arenas["arena"])
            assert ArenaAppeared("arena") in late.news
            check_comeback(late, made.robots[0])
            assert late.watch.malformed == late.watch.ignored == late.watcher.dropped == 0
    assert {one.kind for one in heard} == set(get_args(Kind))


def test_too_much_at_once_is_dropped_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tokens have twice the room, since they are not said again; what is longer than a message may be is not kept."""
    monkeypatch.setattr(subscriber, "_MOST_WAITING", 10)
    of = ColonyKeys("blue")
    heard: list[Heard] = []
    with open_session(Network(listen=(f"tcp/127.0.0.1:{free_port()}",))) as session:
        watching = Watcher(session, "blue", hear=heard.append)
        session.put(of.state(bytes(16)), bytes(BODY_BYTES + 1))
        for _ in range(14):
            session.put(of.event(bytes(16)), b"noise")
        tokens = [
            session.liveliness().declare_token(of.alive(bytes(16), life, "a")) for life in range(15)
        ]
        assert watching.update() == [
            Appeared(bytes(16)),
            *(Restarted(bytes(16), life) for life in range(1, 10)),
        ]
        assert watching.dropped == 5 + 5
        assert watching.update() == []
        assert len(tokens) == 15
    assert [one.kind for one in heard] == ["state", *["event"] * 9, *["alive"] * 10]
    assert heard[0].data == b""
    assert watching.watch.malformed == 10
