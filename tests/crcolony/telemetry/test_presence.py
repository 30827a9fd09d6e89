"""Robots and arenas are online by their tokens, in their newest incarnation, and only so many are remembered."""

import pytest

from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.telemetry import presence
from crcolony.telemetry.status_changes import (
    ArenaJoined,
    ArenaLeft,
    RobotJoined,
    RobotLeft,
    RobotRestarted,
)
from tests.support.fed_monitor import A_SCENE, ARENA, IDS, ME, PEER, FedMonitor, T, message, state


@pytest.fixture
def monitor() -> FedMonitor:
    return FedMonitor()


class TestTokens:
    """Who is online, and in which incarnation."""

    def test_a_robot_is_online_until_its_last_token_is_gone(self, monitor: FedMonitor) -> None:
        """A token that is declared again, or was never declared, changes nothing."""
        assert monitor.online(3) == [RobotJoined(ME)]
        assert monitor.online(3) == []
        assert monitor.online(3, session="b") == []
        assert monitor.offline(3) == []
        assert monitor.offline(3) == []
        assert [status.robot for status in monitor.alive] == [ME]
        assert monitor.offline(3, session="b") == [RobotLeft(ME)]
        assert monitor.alive == []
        assert monitor.offline(3, PEER) == []

    def test_a_newer_incarnation_is_a_restart(self, monitor: FedMonitor) -> None:
        """By what the robot signs, and not by a token, which anybody can declare; the first incarnation is none."""
        monitor.online(3)
        assert monitor.state(state(incarnation=3)) == []
        assert monitor.online(4, session="b") == []
        assert monitor.state(state(incarnation=4)) == [RobotRestarted(ME, 4)]
        monitor.offline(3)
        assert monitor.offline(4, session="b") == [RobotLeft(ME)]
        assert monitor.online(5, session="c") == [RobotJoined(ME)]
        assert monitor.state(state(incarnation=5)) == [RobotRestarted(ME, 5)]
        assert monitor.robots[ME].restarts == 2
        assert list(monitor.robots[ME].tokens) == [(5, "c")]

    def test_arenas_come_online_and_go_offline(self, monitor: FedMonitor) -> None:
        """By their tokens; the last scene and when it arrived are kept."""
        assert monitor.handle("online", ARENA.alive(7, "a")) == [ArenaJoined("lab")]
        assert monitor.handle("online", ARENA.alive(8, "b")) == []
        assert monitor.handle("offline", ARENA.alive(7, "a")) == []
        assert monitor.handle("scene", ARENA.scene, A_SCENE) == []
        assert monitor.handle("offline", ARENA.alive(8, "b")) == [ArenaLeft("lab")]
        arena = monitor.arenas["lab"]
        assert (arena.scene, arena.updated_s) == (A_SCENE, T)
        assert not arena.is_alive

    def test_the_token_decides_in_which_colony_a_robot_is(self, monitor: FedMonitor) -> None:
        """Whatever others have published in its name."""
        monitor.handle("state", ColonyKeys("lies").state(ME), state())
        monitor.online(3)
        assert monitor.robots[ME].colony == "blue"

    def test_a_token_of_a_future_incarnation_silences_nobody(self, monitor: FedMonitor) -> None:
        """Anybody can declare one; what the robot tells of its own incarnation counts."""
        monitor.online(3)
        monitor.online(2**32 - 1, session="b")
        assert monitor.state(state(incarnation=3)) == []
        assert monitor.events(message(1)) == [1]
        assert monitor.stale == 0
        assert monitor.robots[ME].incarnation == 3


class TestLimits:
    """Anyone can publish any name: what is remembered is bounded."""

    def test_robots_that_are_offline_make_room(
        self, monitor: FedMonitor, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The one silent for longest first; where all are online a new robot is ignored."""
        monkeypatch.setattr(presence, "MAX_ROBOTS", 3)
        monitor = FedMonitor()
        monitor.online(3, IDS[0])
        for number in (1, 2, 1, 3):
            monitor.state(state(robot=IDS[number]))
        assert set(monitor.robots) == {IDS[0], IDS[1], IDS[3]}
        monitor.online(3, IDS[1])
        monitor.online(3, IDS[4])
        assert set(monitor.robots) == {IDS[0], IDS[1], IDS[4]}
        assert monitor.online(3, IDS[5]) == []
        assert monitor.state(state(robot=IDS[5])) == []
        assert monitor.events(message(1, robot=IDS[5])) == []
        assert monitor.ignored == 3

    def test_robots_that_are_offline_and_silent_are_removed(self, monitor: FedMonitor) -> None:
        """A robot with a token is not, however silent it is; to a robot that was removed no requests are sent."""
        for robot in (ME, PEER):
            monitor.online(3, robot)
            monitor.events(message(1, robot=robot), message(3, robot=robot))
        monitor.handle("scene", ARENA.scene, A_SCENE)
        monitor.now_s = T + 100.0
        monitor.offline(3, ME)
        monitor.handle_timeouts(T + presence.FORGET_S + 50.0)
        assert set(monitor.robots) == {ME, PEER}
        assert monitor.arenas == {}
        monitor.handle_timeouts(T + presence.FORGET_S + 101.0)
        assert set(monitor.robots) == {PEER}
        assert all(key.endswith(PEER.hex()) for key, _ in monitor.requests(T + 1_000.0))

    def test_a_thousand_tokens_of_one_robot_are_too_many(self, monitor: FedMonitor) -> None:
        """Those beyond the limit are ignored and counted."""
        for number in range(1000):
            monitor.online(3, session=str(number))
            monitor.handle("online", ARENA.alive(number, "a"))
        assert len(monitor.robots[ME].tokens) == len(monitor.arenas["lab"].tokens) == 100
        assert monitor.ignored == 1800
