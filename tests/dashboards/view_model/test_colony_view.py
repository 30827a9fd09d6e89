"""Colonies, ended generations and the colony's time are those of the telemetry; everything counts once."""

import itertools
import random

import pytest
from crcolony_dashboards.view_model.colony_view import MAX_COLONIES
from crcolony_dashboards.view_model.generations import PATIENCE_S

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from tests.support.fake_telemetry import IDS, FakeTelemetry, T, agent, born, lived, mated


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


def pairings(telemetry: FakeTelemetry) -> list[object]:
    return list(telemetry.view.pairings)


class TestColonies:
    """Several colonies are kept apart."""

    def test_robots_count_in_their_own_colony(self, telemetry: FakeTelemetry) -> None:
        """Their states, generations, families and ended generations."""
        for robot, colony in enumerate(("blue", "red")):
            telemetry.join(robot, colony=colony, generation=1 + robot)
            telemetry.events(robot, born(agent(robot, 0)), lived(agent(robot, 0)), colony=colony)
            telemetry.events(robot, born(agent(robot, 1), 1), colony=colony)
        telemetry.advance_s(0.5)
        assert [state.robot for state in telemetry.view.states("red")] == [IDS[1]]
        assert {state.robot for state in telemetry.view.states()} == set(IDS[:2])
        assert telemetry.view.generation() == 1
        for _ in range(2):
            telemetry.view.update_generations(telemetry.at_s)
        blue, red = telemetry.view.colonies.values()
        assert (blue.best, red.best) == (agent(0, 0), agent(1, 0))
        assert (blue.family[agent(1, 0)], red.family[agent(0, 0)]) == (None, None)
        assert [row.number for row in blue.history.rows] == [0]
        assert [row.number for row in red.history.rows] == [0]

    def test_the_number_of_colonies_is_limited(self, telemetry: FakeTelemetry) -> None:
        """Robots of further ones are listed but not counted."""
        for robot in range(MAX_COLONIES + 2):
            telemetry.join(robot, colony=f"c{robot}")
            telemetry.events(robot, mated(robot, robot + 1), colony=f"c{robot}")
            telemetry.state(robot, colony=f"c{robot}", matings=1 + robot)
            telemetry.view.update_rates(telemetry.at_s)
        telemetry.online(MAX_COLONIES + 3)
        telemetry.advance_s(0.5)
        telemetry.view.update_rates(telemetry.at_s)
        assert len(telemetry.view.colonies) == MAX_COLONIES
        assert len(telemetry.view.alive) == MAX_COLONIES + 3
        assert len(telemetry.view.states()) == MAX_COLONIES

    def test_a_colony_that_has_ended_makes_room(self, telemetry: FakeTelemetry) -> None:
        """For a new one, if there are too many."""
        for robot in range(MAX_COLONIES):
            telemetry.join(robot, colony=f"c{robot}")
            telemetry.events(robot, born(agent(robot, 0)), colony=f"c{robot}")
        telemetry.offline(3, colony="c3")
        telemetry.advance_s(0.5)
        telemetry.join(MAX_COLONIES, colony="new")
        telemetry.events(MAX_COLONIES, born(agent(MAX_COLONIES, 0)), colony="new")
        assert "new" in telemetry.view.colonies
        assert "c3" not in telemetry.view.colonies

    def test_founders_after_the_end_of_a_colony_start_another_one(
        self, telemetry: FakeTelemetry
    ) -> None:
        """Robots that continue from their memories belong to the same one."""
        telemetry.join(0)
        telemetry.events(0, born(agent(0, 0)), lived(agent(0, 0)), born(agent(0, 1), 1))
        first = telemetry.view.colonies["blue"]
        telemetry.offline(0)
        telemetry.advance_s(0.5)
        telemetry.join(0)
        telemetry.events(0, born(agent(0, 2), 2))
        assert telemetry.view.colonies["blue"] is first
        telemetry.offline(0)
        telemetry.advance_s(0.5)
        telemetry.join(0)
        telemetry.events(0, born(agent(0, 0)))
        again = telemetry.view.colonies["blue"]
        assert again is not first
        assert again.generations.last == -1
        assert len(again.family) == 1

    def test_robots_that_are_offline_do_not_count(self, telemetry: FakeTelemetry) -> None:
        """From the next update on; they count again when they are back."""
        telemetry.join(0, 1)
        for robot in (0, 1):
            telemetry.events(robot, born(agent(robot, 0)))
        family = telemetry.view.colonies["blue"].family

        def shares() -> list[float]:
            return list(family.shares(status.robot for status in telemetry.view.alive).values())

        assert shares() == [0.5, 0.5]
        telemetry.offline(0)
        telemetry.advance_s(0.5)
        assert [state.robot for state in telemetry.view.states("blue")] == [IDS[1]]
        assert shares() == [1.0]
        telemetry.online(0)
        telemetry.advance_s(0.5)
        assert shares() == [0.5, 0.5]

    def test_implausible_events_are_not_counted(self, telemetry: FakeTelemetry) -> None:
        """Neither births nor lifetimes."""
        telemetry.join(0)
        telemetry.events(0, born("x/1", genes=[float("nan")]), lived("x/1", 2**60), lived("x" * 65))
        telemetry.view.update_generations(telemetry.at_s + 100.0)
        assert telemetry.view.colonies["blue"].history.rows == []
        assert len(telemetry.view.colonies["blue"].family) == 0


class TestTime:
    """The colony's time, stale robots and the current generation."""

    def test_the_time_is_that_of_the_first_arena(self, telemetry: FakeTelemetry) -> None:
        """By name; there is none before the first scene."""
        telemetry.join(0)
        assert telemetry.view.sim_s() is None
        assert telemetry.view.period_s() is None
        telemetry.scene(tick=50, arena="b")
        telemetry.scene(tick=100, arena="a", period_s=0.1)
        telemetry.advance_s(0.1)
        assert telemetry.view.sim_s() == pytest.approx(10.0)
        assert telemetry.view.period_s() == 0.1
        assert [scene.arena for scene in telemetry.view.scenes()] == ["a", "b"]

    def test_the_time_continues_by_the_robots_states(self, telemetry: FakeTelemetry) -> None:
        """By the median of the robots of that arena, so that a single one far ahead does not matter."""
        telemetry.scene(tick=100)
        for robot, tick in enumerate((200, 210, 90_000)):
            telemetry.join(robot, tick=tick, arena="lab")
        telemetry.join(3, tick=5_000, arena="other")
        assert telemetry.view.sim_s() == pytest.approx(42.0)

    def test_the_time_is_bounded(self, telemetry: FakeTelemetry) -> None:
        """It must fit into nanoseconds of 64 bits."""
        telemetry.scene()
        telemetry.join(0, tick=2**53 - 1, arena="lab")
        assert telemetry.view.sim_s() == 1e9

    def test_an_implausible_scene_is_ignored(self, telemetry: FakeTelemetry) -> None:
        """Until there is a plausible one."""
        telemetry.scene(width_m=0.0)
        telemetry.advance_s(0.1)
        assert telemetry.view.scenes() == []
        assert telemetry.view.sim_s() is None
        telemetry.scene()
        telemetry.advance_s(0.1)
        assert len(telemetry.view.scenes()) == 1

    def test_silent_offline_and_unknown_robots_are_stale(self, telemetry: FakeTelemetry) -> None:
        """A robot with a recent state is not."""
        telemetry.join(0)
        status, said_s = telemetry.monitor.robots[IDS[0]], T
        assert not telemetry.view.is_stale(status, said_s + SILENT_AFTER_S)
        assert telemetry.view.is_stale(status, said_s + SILENT_AFTER_S + 0.1)
        telemetry.offline(0)
        assert telemetry.view.is_stale(status, said_s)
        assert telemetry.view.is_stale(None, said_s)

    def test_the_generation_is_the_lowest_of_all_robots(self, telemetry: FakeTelemetry) -> None:
        """Without robots it is 0."""
        assert telemetry.view.generation() == 0
        for robot, generation in enumerate((5, 3, 4)):
            telemetry.join(robot, generation=generation)
        assert telemetry.view.generation() == 3


def test_the_order_of_arrival_does_not_matter() -> None:
    """For generations and matings, once all events were received."""
    events: list[tuple[int, object]] = []
    events += [(r, born(agent(r, k))) for r in (0, 1) for k in range(3)]
    events += [(r, lived(agent(r, k), matings=k)) for r in (0, 1) for k in range(3)]
    events += [
        (r, mated(0, 1, k, agent=agent(r, k), conceived=True)) for r in (0, 1) for k in range(3)
    ]
    found = []
    for seed in range(20):
        telemetry = FakeTelemetry()
        telemetry.join(0, 1, generation=1)
        for robot, event in random.Random(seed).sample(events, len(events)):
            telemetry.events(robot, event)  # type: ignore[arg-type]
        telemetry.view.update_generations(telemetry.at_s + PATIENCE_S)
        (generation,) = telemetry.view.colonies["blue"].history.rows
        found.append((generation.agents, generation.matings, generation.conceptions))
        assert len(pairings(telemetry)) == 3
    assert all(one == other for one, other in itertools.pairwise(found))


def test_robots_are_in_order_of_their_numbers(telemetry: FakeTelemetry) -> None:
    """Those without a state come last; the list is updated twice a second."""
    for robot in (2, 0, 1):
        telemetry.online(robot)
        if robot:
            telemetry.state(robot, number=robot)
    telemetry.advance_s(0.0)
    expected: list[RobotId] = [IDS[1], IDS[2], IDS[0]]
    assert [status.robot for status in telemetry.view.alive] == expected
    telemetry.online(3)
    telemetry.advance_s(0.1)
    assert len(telemetry.view.alive) == 3
    telemetry.advance_s(0.4)
    assert len(telemetry.view.alive) == 4
