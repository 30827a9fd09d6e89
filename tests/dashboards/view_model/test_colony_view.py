"""Who has met and mated, what has ended, what was said and how fast it goes: each thing once, and nothing for ever."""

import itertools
import random

import pytest
from crcolony_dashboards.view_model.colony_view import MAX_COLONIES
from crcolony_dashboards.view_model.generations import PATIENCE_S

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import SILENT_AFTER_S
from tests.support.fake_telemetry import IDS, FakeTelemetry, T, agent, born, lived, mated


@pytest.fixture
def sample() -> FakeTelemetry:
    return FakeTelemetry()


def pairings(sample: FakeTelemetry) -> list[object]:
    return list(sample.view.pairings)


class TestColonies:
    """Several colonies are told apart."""

    def test_everybody_counts_in_their_own_colony(self, sample: FakeTelemetry) -> None:
        """Robots, generations, families, and what has ended."""
        for robot, colony in enumerate(("blue", "red")):
            sample.join(robot, colony=colony, generation=1 + robot)
            sample.tell(robot, born(agent(robot, 0)), lived(agent(robot, 0)), colony=colony)
            sample.tell(robot, born(agent(robot, 1), 1), colony=colony)
        sample.pass_s(0.5)
        assert [state.robot for state in sample.view.states("red")] == [IDS[1]]
        assert {state.robot for state in sample.view.states()} == set(IDS[:2])
        assert sample.view.generation() == 1
        ended = sample.view.pop_ended_generations(sample.at_s)
        assert [(colony.name, generation.best) for colony, generation in ended] == [
            ("blue", agent(0, 0)),
            ("red", agent(1, 0)),
        ]
        blue, red = sample.view.colonies.values()
        assert (blue.best, red.best) == (agent(0, 0), agent(1, 0))
        assert (blue.family[agent(1, 0)], red.family[agent(0, 0)]) == (None, None)
        assert sample.view.pop_ended_generations(sample.at_s + 100.0) == []

    def test_of_too_many_the_first_are_told_apart(self, sample: FakeTelemetry) -> None:
        """Who lives in another is seen, but not counted."""
        for robot in range(MAX_COLONIES + 2):
            sample.join(robot, colony=f"c{robot}")
            sample.tell(robot, mated(robot, robot + 1), colony=f"c{robot}")
            sample.state(robot, colony=f"c{robot}", matings=1 + robot)
            sample.view.update_rates(sample.at_s)
        sample.come(MAX_COLONIES + 3)
        sample.pass_s(0.5)
        sample.view.update_rates(sample.at_s)
        assert len(sample.view.colonies) == MAX_COLONIES
        assert len(sample.view.alive) == MAX_COLONIES + 3
        assert len(sample.view.states()) == MAX_COLONIES

    def test_a_colony_that_is_over_makes_room(self, sample: FakeTelemetry) -> None:
        """For one that comes when there are too many to be told apart."""
        for robot in range(MAX_COLONIES):
            sample.join(robot, colony=f"c{robot}")
            sample.tell(robot, born(agent(robot, 0)), colony=f"c{robot}")
        sample.go(3, colony="c3")
        sample.pass_s(0.5)
        sample.join(MAX_COLONIES, colony="new")
        sample.tell(MAX_COLONIES, born(agent(MAX_COLONIES, 0)), colony="new")
        assert "new" in sample.view.colonies
        assert "c3" not in sample.view.colonies

    def test_a_colony_that_begins_anew_is_another(self, sample: FakeTelemetry) -> None:
        """If all were gone, and come again with founders; whoever goes on from a memory is the same."""
        sample.join(0)
        sample.tell(0, born(agent(0, 0)), lived(agent(0, 0)), born(agent(0, 1), 1))
        first = sample.view.colonies["blue"]
        sample.go(0)
        sample.pass_s(0.5)
        sample.join(0)
        sample.tell(0, born(agent(0, 2), 2))
        assert sample.view.colonies["blue"] is first
        sample.go(0)
        sample.pass_s(0.5)
        sample.join(0)
        sample.tell(0, born(agent(0, 0)))
        again = sample.view.colonies["blue"]
        assert again is not first
        assert again.generations.last == -1
        assert len(again.family) == 1

    def test_who_is_gone_is_in_no_colony(self, sample: FakeTelemetry) -> None:
        """From the next look on; its agents count again when it is back."""
        sample.join(0, 1)
        for robot in (0, 1):
            sample.tell(robot, born(agent(robot, 0)))
        family = sample.view.colonies["blue"].family

        def shares() -> list[float]:
            return list(family.shares(status.robot for status in sample.view.alive).values())

        assert shares() == [0.5, 0.5]
        sample.go(0)
        sample.pass_s(0.5)
        assert [state.robot for state in sample.view.states("blue")] == [IDS[1]]
        assert shares() == [1.0]
        sample.come(0)
        sample.pass_s(0.5)
        assert shares() == [0.5, 0.5]

    def test_nonsense_is_not_counted(self, sample: FakeTelemetry) -> None:
        """What nobody could be born with, and lives that nobody has led."""
        sample.join(0)
        sample.tell(0, born("x/1", genes=[float("nan")]), lived("x/1", 2**60), lived("x" * 65))
        assert sample.view.pop_ended_generations(sample.at_s + 100.0) == []
        assert len(sample.view.colonies["blue"].family) == 0

    def test_a_generation_ended_when_it_was_told(self, sample: FakeTelemetry) -> None:
        """Not when it was heard of."""
        sample.join(0, generation=1)
        sample.tell(0, lived(agent(0, 0)), told_s=T - 500.0)
        ((_, generation),) = sample.view.pop_ended_generations(sample.at_s + PATIENCE_S)
        assert generation.unix_s == T - 500.0


class TestTime:
    """What time it is in the colony, and who is late."""

    def test_it_is_the_arenas_time(self, sample: FakeTelemetry) -> None:
        """Of the first by name; there is none before one was seen."""
        sample.join(0)
        assert sample.view.sim_s() is None
        assert sample.view.period_s() is None
        sample.scene(tick=50, arena="b")
        sample.scene(tick=100, arena="a", period_s=0.1)
        sample.pass_s(0.1)
        assert sample.view.sim_s() == pytest.approx(10.0)
        assert sample.view.period_s() == 0.1
        assert [scene.arena for scene in sample.view.scenes()] == ["a", "b"]

    def test_robots_tell_it_when_the_arena_is_silent(self, sample: FakeTelemetry) -> None:
        """One that is far ahead does not; nor those of another arena."""
        sample.scene(tick=100)
        for robot, tick in enumerate((200, 210, 90_000)):
            sample.join(robot, tick=tick, arena="lab")
        sample.join(3, tick=5_000, arena="other")
        assert sample.view.sim_s() == pytest.approx(42.0)

    def test_no_robot_makes_it_too_late_for_a_clock(self, sample: FakeTelemetry) -> None:
        """Time has to fit into nanoseconds of 64 bits."""
        sample.scene()
        sample.join(0, tick=2**53 - 1, arena="lab")
        assert sample.view.sim_s() == 1e9

    def test_what_cannot_be_drawn_is_not_there(self, sample: FakeTelemetry) -> None:
        """Until the arena says something that can be."""
        sample.scene(width_m=0.0)
        sample.pass_s(0.1)
        assert sample.view.scenes() == []
        assert sample.view.sim_s() is None
        sample.scene()
        sample.pass_s(0.1)
        assert len(sample.view.scenes()) == 1

    def test_who_says_nothing_is_stale(self, sample: FakeTelemetry) -> None:
        """Or is gone, or was never there."""
        sample.join(0)
        status, said_s = sample.monitor.robots[IDS[0]], T
        assert not sample.view.is_stale(status, said_s + SILENT_AFTER_S)
        assert sample.view.is_stale(status, said_s + SILENT_AFTER_S + 0.1)
        sample.go(0)
        assert sample.view.is_stale(status, said_s)
        assert sample.view.is_stale(None, said_s)

    def test_the_generation_is_that_of_the_last(self, sample: FakeTelemetry) -> None:
        """Of nobody it is 0."""
        assert sample.view.generation() == 0
        for robot, generation in enumerate((5, 3, 4)):
            sample.join(robot, generation=generation)
        assert sample.view.generation() == 3


def test_whatever_order_news_come_in_the_same_is_known() -> None:
    """Of generations and matings, when all of it was heard."""
    events = [(robot, born(agent(robot, k))) for robot in (0, 1) for k in range(3)]
    message: list[tuple[int, object]] = [*events]
    message += [(r, lived(agent(r, k), matings=k)) for r in (0, 1) for k in range(3)]
    message += [
        (r, mated(0, 1, k, agent=agent(r, k), conceived=True)) for r in (0, 1) for k in range(3)
    ]
    found = []
    for seed in range(20):
        sample = FakeTelemetry()
        sample.join(0, 1, generation=1)
        for robot, event in random.Random(seed).sample(message, len(message)):
            sample.tell(robot, event)  # type: ignore[arg-type]
        ((_, generation),) = sample.view.pop_ended_generations(sample.at_s + PATIENCE_S)
        found.append((generation.agents, generation.matings, generation.conceptions))
        assert len(pairings(sample)) == 3
    assert all(one == other for one, other in itertools.pairwise(found))


def test_robots_are_in_order_of_their_numbers(sample: FakeTelemetry) -> None:
    """Whoever has said none yet comes last; they are looked at twice a second."""
    for robot in (2, 0, 1):
        sample.come(robot)
        if robot:
            sample.state(robot, number=robot)
    sample.pass_s(0.0)
    expected: list[RobotId] = [IDS[1], IDS[2], IDS[0]]
    assert [status.robot for status in sample.view.alive] == expected
    sample.come(3)
    sample.pass_s(0.1)
    assert len(sample.view.alive) == 3
    sample.pass_s(0.4)
    assert len(sample.view.alive) == 4
