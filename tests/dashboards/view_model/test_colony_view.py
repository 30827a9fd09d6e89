"""Who has met and mated, what has ended, what was said and how fast it goes: each thing once, and nothing for ever."""

import itertools
import random

import pytest
from crcolony_dashboards.view_model import colony_view as spectator_module
from crcolony_dashboards.view_model.colony_view import (
    MATING_S,
    MEETING_S,
    MOST_COLONIES,
    ColonyView,
    Pairing,
)
from crcolony_dashboards.view_model.generations import PATIENCE_S
from hypothesis import given
from hypothesis import strategies as st

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import SILENT_AFTER_S, Fault
from crcolony.telemetry import presence
from crcolony.telemetry.colony_monitor import ColonyMonitor
from tests.support.fake_telemetry import IDS, FakeTelemetry, T, agent, born, lived, mated, met


@pytest.fixture
def heard() -> FakeTelemetry:
    return FakeTelemetry()


def pairings(heard: FakeTelemetry) -> list[Pairing]:
    return list(heard.spectator.pairings)


def texts(heard: FakeTelemetry) -> list[str]:
    return [line.text for line in heard.spectator.take_log_lines()]


class TestPairings:
    """Two robots meet, or mate: it is one thing, though both tell it."""

    def test_a_mating_is_one_pairing_though_both_tell_it(self, heard: FakeTelemetry) -> None:
        """With how many of the two have conceived, and when it was heard of first."""
        heard.tell(0, mated(0, 1, conceived=True))
        heard.at_s += 0.4
        heard.tell(1, mated(0, 1, conceived=True))
        assert pairings(heard) == [Pairing((IDS[0], IDS[1]), T, mated=True, conceived=2)]

    def test_every_encounter_is_a_pairing_of_its_own(self, heard: FakeTelemetry) -> None:
        """Of the same two robots too; and a meeting is another thing than the mating."""
        heard.tell(0, met(1), mated(0, 1, 1), mated(0, 1, 2), mated(0, 2, 3))
        heard.tell(1, met(0), mated(0, 1, 2), mated(0, 1, 1))
        told = [(p.robots, p.mated) for p in pairings(heard)]
        assert sorted(told[0][0]) == sorted(IDS[:2])
        assert not told[0][1]
        assert told[1:] == [((IDS[0], IDS[k]), True) for k in (1, 1, 2)]

    def test_a_meeting_lasts_a_moment(self, heard: FakeTelemetry) -> None:
        """Whoever meets again after it meets anew; both of its sides, and contact after contact, are one."""
        for _ in range(5):
            heard.tell(0, met(1))
            heard.tell(1, met(0))
            heard.at_s += MEETING_S / 6
        assert len(pairings(heard)) == 1
        heard.at_s += MEETING_S
        heard.tell(1, met(0))
        assert [p.unix_s for p in pairings(heard)] == [T, pytest.approx(heard.at_s)]

    def test_pairings_are_forgotten(self, heard: FakeTelemetry) -> None:
        """After they were shown long enough; a partner that tells of it late does not bring one back."""
        heard.tell(0, mated(0, 1), met(2))
        heard.pass_s(MATING_S)
        assert len(pairings(heard)) == 2
        heard.pass_s(0.1)
        assert pairings(heard) == []
        heard.tell(1, mated(0, 1, conceived=True))
        assert pairings(heard) == []

    def test_what_happened_long_ago_is_not_shown(self, heard: FakeTelemetry) -> None:
        """Whoever comes late hears of it all the same; robots' clocks need not be right for that."""
        for count, clock_s in enumerate((-1e6, 0.0, 1e6), 2):
            heard.join(0, unix_ms=round(1000.0 * (heard.at_s + clock_s)))
            told_s = heard.at_s + clock_s
            heard.tell(0, mated(0, 1, agent=agent(0, 0), conceived=True), told_s=told_s - 60.0)
            assert pairings(heard) == []
            heard.tell(0, mated(0, 1, count), met(1), told_s=told_s - 1.0)
            assert len(pairings(heard)) == 2
            heard.pass_s(60.0)
        heard.tell(0, lived(agent(0, 0)))
        heard.go(0)
        heard.pass_s(60.0)
        ((_, generation),) = heard.spectator.take_ended_generations(heard.at_s)
        assert generation.conceptions.mean == 3.0

    def test_they_are_forgotten_when_the_clock_is_set_back_too(self, heard: FakeTelemetry) -> None:
        """And the next meeting is shown."""
        heard.tell(0, mated(0, 1), met(1))
        heard.pass_s(-3600.0)
        assert pairings(heard) == []
        heard.tell(0, met(1))
        assert [p.unix_s for p in pairings(heard)] == [heard.at_s]

    def test_many_take_a_limited_memory(
        self, heard: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """However many there are, and however long it goes on."""
        monkeypatch.setattr(spectator_module, "_MOST_PAIRS", 20)
        heard = FakeTelemetry()
        for count in range(500):
            heard.tell(0, mated(0, 1, count))
            heard.pass_s(0.5)
            assert len(heard.spectator.pairings) <= 20
            assert len(heard.spectator._known_pairings) <= 50

    @given(st.lists(st.tuples(st.integers(0, 9), st.booleans()), max_size=40))
    def test_whoever_tells_first_and_how_often(self, told: list[tuple[int, bool]]) -> None:
        """There is one pairing for every encounter that anybody told of."""
        heard = FakeTelemetry()
        for count, is_initiators in told:
            heard.tell(0 if is_initiators else 1, mated(0, 1, count))
        assert len(pairings(heard)) == len({count for count, _ in told})


class TestLog:
    """What was said, in moderation."""

    def test_lines_of_one_kind_are_thinned(self, heard: FakeTelemetry) -> None:
        """The first are there, the others are counted; other kinds are not touched by it."""
        for number in range(20):
            heard.tell(0, Fault(7, f"fault {number}"))
        heard.come(1)
        lines = texts(heard)
        assert lines[:8] == [f"{IDS[0].hex()[:8]}: fault {number}" for number in range(8)]
        assert lines[8:] == [f"{IDS[1].hex()[:8]} is here", "… and 12 more (fault)"]

    def test_every_time_begins_anew(self, heard: FakeTelemetry) -> None:
        """Nothing is said twice."""
        for _ in range(2):
            heard.tell(0, *(Fault(7, str(number)) for number in range(9)))
            assert len(texts(heard)) == 9
        assert texts(heard) == []


class TestNames:
    """How robots are called: shortly, and no two alike."""

    def test_a_robot_is_called_by_its_number(self, heard: FakeTelemetry) -> None:
        """Once it has said it; before that by its id."""
        heard.come(0)
        heard.pass_s(0.5)
        assert heard.spectator.call(IDS[0]) == IDS[0].hex()[:8]
        heard.join(0, number=12)
        assert heard.spectator.call(IDS[0]) == "#12"
        assert heard.spectator.call(IDS[9]) == IDS[9].hex()[:8]

    def test_two_robots_with_one_number_are_called_by_their_ids(self, heard: FakeTelemetry) -> None:
        """A third is not touched by that."""
        heard.join(0, 1, number=0)
        heard.join(2, number=7)
        names = [heard.spectator.call(robot) for robot in IDS[:3]]
        assert names == [IDS[0].hex()[:8], IDS[1].hex()[:8], "#7"]

    def test_of_several_colonies_the_colony_is_said(self, heard: FakeTelemetry) -> None:
        """Numbers may repeat then."""
        heard.join(0, number=0)
        heard.join(1, number=0, colony="red")
        heard.pass_s(0.5)
        assert [heard.spectator.call(robot) for robot in IDS[:2]] == ["blue #0", "red #0"]

    @given(
        st.lists(
            st.tuples(st.sampled_from(["blue", "red"]), st.none() | st.integers(0, 3)), max_size=12
        )
    )
    def test_no_two_are_called_alike(self, robots: list[tuple[str, int | None]]) -> None:
        """Whatever numbers they say they have, in however many colonies."""
        heard = FakeTelemetry()
        for robot, (colony, number) in enumerate(robots):
            heard.come(robot, colony=colony)
            if number is not None:
                heard.state(robot, colony=colony, number=number)
        heard.pass_s(0.5)
        heard.pass_s(0.5)
        names = [heard.spectator.call(robot) for robot in IDS[: len(robots)]]
        assert len(set(names)) == len(names)


class TestColonies:
    """Several colonies are told apart."""

    def test_everybody_counts_in_their_own_colony(self, heard: FakeTelemetry) -> None:
        """Robots, generations, families, and what has ended."""
        for robot, colony in enumerate(("blue", "red")):
            heard.join(robot, colony=colony, generation=1 + robot)
            heard.tell(robot, born(agent(robot, 0)), lived(agent(robot, 0)), colony=colony)
            heard.tell(robot, born(agent(robot, 1), 1), colony=colony)
        heard.pass_s(0.5)
        assert [state.robot for state in heard.spectator.states("red")] == [IDS[1]]
        assert {state.robot for state in heard.spectator.states()} == set(IDS[:2])
        assert heard.spectator.generation() == 1
        ended = heard.spectator.take_ended_generations(heard.at_s)
        assert [(colony.name, generation.best) for colony, generation in ended] == [
            ("blue", agent(0, 0)),
            ("red", agent(1, 0)),
        ]
        blue, red = heard.spectator.colonies.values()
        assert (blue.best, red.best) == (agent(0, 0), agent(1, 0))
        assert (blue.family[agent(1, 0)], red.family[agent(0, 0)]) == (None, None)
        assert heard.spectator.take_ended_generations(heard.at_s + 100.0) == []

    def test_of_too_many_the_first_are_told_apart(self, heard: FakeTelemetry) -> None:
        """Who lives in another is seen, but not counted."""
        for robot in range(MOST_COLONIES + 2):
            heard.join(robot, colony=f"c{robot}")
            heard.tell(robot, mated(robot, robot + 1), colony=f"c{robot}")
            heard.state(robot, colony=f"c{robot}", matings=1 + robot)
            heard.spectator.update_rates(heard.at_s)
        heard.come(MOST_COLONIES + 3)
        heard.pass_s(0.5)
        heard.spectator.update_rates(heard.at_s)
        assert len(heard.spectator.colonies) == MOST_COLONIES
        assert len(heard.spectator.alive) == MOST_COLONIES + 3
        assert len(heard.spectator.states()) == MOST_COLONIES

    def test_a_colony_that_is_over_makes_room(self, heard: FakeTelemetry) -> None:
        """For one that comes when there are too many to be told apart."""
        for robot in range(MOST_COLONIES):
            heard.join(robot, colony=f"c{robot}")
            heard.tell(robot, born(agent(robot, 0)), colony=f"c{robot}")
        heard.go(3, colony="c3")
        heard.pass_s(0.5)
        heard.join(MOST_COLONIES, colony="new")
        heard.tell(MOST_COLONIES, born(agent(MOST_COLONIES, 0)), colony="new")
        assert "new" in heard.spectator.colonies
        assert "c3" not in heard.spectator.colonies

    def test_a_colony_that_begins_anew_is_another(self, heard: FakeTelemetry) -> None:
        """If all were gone, and come again with founders; whoever goes on from a memory is the same."""
        heard.join(0)
        heard.tell(0, born(agent(0, 0)), lived(agent(0, 0)), born(agent(0, 1), 1))
        first = heard.spectator.colonies["blue"]
        heard.go(0)
        heard.pass_s(0.5)
        heard.join(0)
        heard.tell(0, born(agent(0, 2), 2))
        assert heard.spectator.colonies["blue"] is first
        heard.go(0)
        heard.pass_s(0.5)
        heard.join(0)
        heard.tell(0, born(agent(0, 0)))
        again = heard.spectator.colonies["blue"]
        assert again is not first
        assert again.generations.last == -1
        assert len(again.family) == 1

    def test_who_is_gone_is_in_no_colony(self, heard: FakeTelemetry) -> None:
        """From the next look on; its agents count again when it is back."""
        heard.join(0, 1)
        for robot in (0, 1):
            heard.tell(robot, born(agent(robot, 0)))
        family = heard.spectator.colonies["blue"].family

        def shares() -> list[float]:
            return list(family.shares(watched.robot for watched in heard.spectator.alive).values())

        assert shares() == [0.5, 0.5]
        heard.go(0)
        heard.pass_s(0.5)
        assert [state.robot for state in heard.spectator.states("blue")] == [IDS[1]]
        assert shares() == [1.0]
        heard.come(0)
        heard.pass_s(0.5)
        assert shares() == [0.5, 0.5]

    def test_nonsense_is_not_counted(self, heard: FakeTelemetry) -> None:
        """What nobody could be born with, and lives that nobody has led."""
        heard.join(0)
        heard.tell(0, born("x/1", genes=[float("nan")]), lived("x/1", 2**60), lived("x" * 65))
        assert heard.spectator.take_ended_generations(heard.at_s + 100.0) == []
        assert len(heard.spectator.colonies["blue"].family) == 0

    def test_a_generation_ended_when_it_was_told(self, heard: FakeTelemetry) -> None:
        """Not when it was heard of."""
        heard.join(0, generation=1)
        heard.tell(0, lived(agent(0, 0)), told_s=T - 500.0)
        ((_, generation),) = heard.spectator.take_ended_generations(heard.at_s + PATIENCE_S)
        assert generation.unix_s == T - 500.0


def rates(heard: FakeTelemetry, colony: str = "blue") -> tuple[float, float] | None:
    return heard.spectator.rates(heard.spectator.colonies[colony])


class TestRates:
    """How often a robot mates and captures in a minute of its colony's time."""

    def test_each_mating_counts_once_for_both(self, heard: FakeTelemetry) -> None:
        """Two robots that mate with each other once a minute mate once a minute, each of them."""
        heard.join(0, 1, matings=0, captures=0)
        for minute in range(4):
            heard.state(0, 1, matings=minute, captures=10 * minute)
            heard.spectator.update_rates(heard.at_s)
            heard.pass_s(20.0)
        assert rates(heard) == pytest.approx((3.0, 30.0))
        assert heard.spectator.colonies["blue"].matings == 3.0

    def test_what_was_before_is_not_counted(self, heard: FakeTelemetry) -> None:
        """A robot comes with all the matings of its life."""
        heard.join(0, matings=1_000, captures=7_000)
        heard.spectator.update_rates(heard.at_s)
        heard.pass_s(30.0)
        heard.join(1, matings=500, captures=100)
        heard.spectator.update_rates(heard.at_s)
        assert rates(heard) == (0.0, 0.0)

    def test_rates_are_of_the_last_minute(self, heard: FakeTelemetry) -> None:
        """What was long ago counts no more."""
        heard.join(0, matings=0, captures=0)
        heard.spectator.update_rates(heard.at_s)
        heard.state(0, matings=50, captures=50)
        for _ in range(100):
            heard.pass_s(1.0)
            heard.spectator.update_rates(heard.at_s)
        assert rates(heard) == (0.0, 0.0)
        assert len(heard.spectator.colonies["blue"].samples) <= 62

    def test_they_are_the_same_as_long_as_nothing_changes(self, heard: FakeTelemetry) -> None:
        """However long that goes on."""
        heard.join(0, matings=0, captures=0)
        for second in range(300):
            heard.state(0, matings=second, captures=7)
            heard.pass_s(1.0)
            heard.spectator.update_rates(heard.at_s)
            if second in (20, 100, 299):
                assert rates(heard) == pytest.approx((60.0, 0.0), abs=60.0 / second)

    def test_nobody_unmates(self, heard: FakeTelemetry) -> None:
        """A robot whose counts fall has another memory than before: it counts on from there."""
        heard.join(0, matings=0, captures=0)
        for matings, captures in ((10, 10), (2, 3), (3, 3)):
            heard.spectator.update_rates(heard.at_s)
            heard.state(0, matings=matings, captures=captures)
            heard.pass_s(1.0)
        heard.spectator.update_rates(heard.at_s)
        colony = heard.spectator.colonies["blue"]
        assert (colony.matings, colony.captures) == (5.5, 10.0)

    def test_minutes_are_those_of_the_arena(self, heard: FakeTelemetry) -> None:
        """A colony that lives ten times as fast mates ten times as often only if it does so by its own clock."""
        heard.join(0, 1, arena="lab", matings=0, captures=0, tick=0)
        for minute in range(4):
            heard.scene((0, 0.0, 0.0), tick=300 * minute)
            heard.state(0, 1, arena="lab", matings=minute, captures=minute, tick=300 * minute)
            heard.pass_s(6.0)
            heard.spectator.update_rates(heard.at_s)
        assert rates(heard) == pytest.approx((1.0, 1.0))

    def test_another_clock_makes_no_leap(self, heard: FakeTelemetry) -> None:
        """An arena that comes or goes has a time of its own; it is counted anew from there."""
        heard.join(0, matings=0, captures=0)
        heard.scene((0, 0.0, 0.0), tick=10_000_000, arena="b")
        heard.spectator.update_rates(heard.at_s)
        heard.pass_s(0.5)
        heard.spectator.update_rates(heard.at_s)
        heard.scene((0, 0.0, 0.0), tick=900_000_000, arena="a")
        heard.pass_s(0.5)
        heard.spectator.update_rates(heard.at_s)
        assert rates(heard) is None
        heard.scene((0, 0.0, 0.0), tick=900_000_300, arena="a")
        heard.state(0, matings=2, captures=5)
        heard.pass_s(0.5)
        heard.spectator.update_rates(heard.at_s)
        assert rates(heard) == pytest.approx((2.0, 5.0))

    def test_who_is_forgotten_is_not_remembered_here(
        self, heard: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Anybody can make up robots without end."""
        monkeypatch.setattr(presence, "MOST_ROBOTS", 3)
        heard = FakeTelemetry(ColonyView(ColonyMonitor()))
        for robot in range(40):
            heard.join(robot)
            heard.spectator.update_rates(heard.at_s)
            heard.go(robot)
        assert len(heard.spectator._counted) <= 4


class TestTime:
    """What time it is in the colony, and who is late."""

    def test_it_is_the_arenas_time(self, heard: FakeTelemetry) -> None:
        """Of the first by name; there is none before one was seen."""
        heard.join(0)
        assert heard.spectator.sim_s() is None
        assert heard.spectator.period_s() is None
        heard.scene(tick=50, arena="b")
        heard.scene(tick=100, arena="a", period_s=0.1)
        heard.pass_s(0.1)
        assert heard.spectator.sim_s() == pytest.approx(10.0)
        assert heard.spectator.period_s() == 0.1
        assert [scene.arena for scene in heard.spectator.scenes()] == ["a", "b"]

    def test_robots_tell_it_when_the_arena_is_silent(self, heard: FakeTelemetry) -> None:
        """One that is far ahead does not; nor those of another arena."""
        heard.scene(tick=100)
        for robot, tick in enumerate((200, 210, 90_000)):
            heard.join(robot, tick=tick, arena="lab")
        heard.join(3, tick=5_000, arena="other")
        assert heard.spectator.sim_s() == pytest.approx(42.0)

    def test_no_robot_makes_it_too_late_for_a_clock(self, heard: FakeTelemetry) -> None:
        """Time has to fit into nanoseconds of 64 bits."""
        heard.scene()
        heard.join(0, tick=2**53 - 1, arena="lab")
        assert heard.spectator.sim_s() == 1e9

    def test_what_cannot_be_drawn_is_not_there(self, heard: FakeTelemetry) -> None:
        """Until the arena says something that can be."""
        heard.scene(width_m=0.0)
        heard.pass_s(0.1)
        assert heard.spectator.scenes() == []
        assert heard.spectator.sim_s() is None
        heard.scene()
        heard.pass_s(0.1)
        assert len(heard.spectator.scenes()) == 1

    def test_who_says_nothing_is_stale(self, heard: FakeTelemetry) -> None:
        """Or is gone, or was never there."""
        heard.join(0)
        watched, said_s = heard.watch.robots[IDS[0]], T
        assert not heard.spectator.is_stale(watched, said_s + SILENT_AFTER_S)
        assert heard.spectator.is_stale(watched, said_s + SILENT_AFTER_S + 0.1)
        heard.go(0)
        assert heard.spectator.is_stale(watched, said_s)
        assert heard.spectator.is_stale(None, said_s)

    def test_the_generation_is_that_of_the_last(self, heard: FakeTelemetry) -> None:
        """Of nobody it is 0."""
        assert heard.spectator.generation() == 0
        for robot, generation in enumerate((5, 3, 4)):
            heard.join(robot, generation=generation)
        assert heard.spectator.generation() == 3


def test_whatever_order_news_come_in_the_same_is_known() -> None:
    """Of generations and matings, when all of it was heard."""
    events = [(robot, born(agent(robot, k))) for robot in (0, 1) for k in range(3)]
    told: list[tuple[int, object]] = [*events]
    told += [(r, lived(agent(r, k), matings=k)) for r in (0, 1) for k in range(3)]
    told += [
        (r, mated(0, 1, k, agent=agent(r, k), conceived=True)) for r in (0, 1) for k in range(3)
    ]
    found = []
    for seed in range(20):
        heard = FakeTelemetry()
        heard.join(0, 1, generation=1)
        for robot, event in random.Random(seed).sample(told, len(told)):
            heard.tell(robot, event)  # type: ignore[arg-type]
        ((_, generation),) = heard.spectator.take_ended_generations(heard.at_s + PATIENCE_S)
        found.append((generation.agents, generation.matings, generation.conceptions))
        assert len(pairings(heard)) == 3
    assert all(one == other for one, other in itertools.pairwise(found))


def test_robots_are_in_order_of_their_numbers(heard: FakeTelemetry) -> None:
    """Whoever has said none yet comes last; they are looked at twice a second."""
    for robot in (2, 0, 1):
        heard.come(robot)
        if robot:
            heard.state(robot, number=robot)
    heard.pass_s(0.0)
    expected: list[RobotId] = [IDS[1], IDS[2], IDS[0]]
    assert [watched.robot for watched in heard.spectator.alive] == expected
    heard.come(3)
    heard.pass_s(0.1)
    assert len(heard.spectator.alive) == 3
    heard.pass_s(0.4)
    assert len(heard.spectator.alive) == 4
