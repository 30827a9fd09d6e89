"""Who has met and mated, what has ended, what was said and how fast it goes: each thing once, and nothing for ever."""

import itertools
import random

import pytest
from crcolony_dashboards.view_model import colony_view as spectator_module
from crcolony_dashboards.view_model.colony_view import (
    MATING_S,
    MAX_COLONIES,
    MEETING_S,
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
def sample() -> FakeTelemetry:
    return FakeTelemetry()


def pairings(sample: FakeTelemetry) -> list[Pairing]:
    return list(sample.view.pairings)


def texts(sample: FakeTelemetry) -> list[str]:
    return [line.text for line in sample.view.take_log_lines()]


class TestPairings:
    """Two robots meet, or mate: it is one thing, though both tell it."""

    def test_a_mating_is_one_pairing_though_both_tell_it(self, sample: FakeTelemetry) -> None:
        """With how many of the two have conceived, and when it was heard of first."""
        sample.tell(0, mated(0, 1, conceived=True))
        sample.at_s += 0.4
        sample.tell(1, mated(0, 1, conceived=True))
        assert pairings(sample) == [Pairing((IDS[0], IDS[1]), T, mated=True, conceived=2)]

    def test_every_encounter_is_a_pairing_of_its_own(self, sample: FakeTelemetry) -> None:
        """Of the same two robots too; and a meeting is another thing than the mating."""
        sample.tell(0, met(1), mated(0, 1, 1), mated(0, 1, 2), mated(0, 2, 3))
        sample.tell(1, met(0), mated(0, 1, 2), mated(0, 1, 1))
        message = [(p.robots, p.mated) for p in pairings(sample)]
        assert sorted(message[0][0]) == sorted(IDS[:2])
        assert not message[0][1]
        assert message[1:] == [((IDS[0], IDS[k]), True) for k in (1, 1, 2)]

    def test_a_meeting_lasts_a_moment(self, sample: FakeTelemetry) -> None:
        """Whoever meets again after it meets anew; both of its sides, and contact after contact, are one."""
        for _ in range(5):
            sample.tell(0, met(1))
            sample.tell(1, met(0))
            sample.at_s += MEETING_S / 6
        assert len(pairings(sample)) == 1
        sample.at_s += MEETING_S
        sample.tell(1, met(0))
        assert [p.unix_s for p in pairings(sample)] == [T, pytest.approx(sample.at_s)]

    def test_pairings_are_forgotten(self, sample: FakeTelemetry) -> None:
        """After they were shown long enough; a partner that tells of it late does not bring one back."""
        sample.tell(0, mated(0, 1), met(2))
        sample.pass_s(MATING_S)
        assert len(pairings(sample)) == 2
        sample.pass_s(0.1)
        assert pairings(sample) == []
        sample.tell(1, mated(0, 1, conceived=True))
        assert pairings(sample) == []

    def test_what_happened_long_ago_is_not_shown(self, sample: FakeTelemetry) -> None:
        """Whoever comes late hears of it all the same; robots' clocks need not be right for that."""
        for count, clock_s in enumerate((-1e6, 0.0, 1e6), 2):
            sample.join(0, unix_ms=round(1000.0 * (sample.at_s + clock_s)))
            told_s = sample.at_s + clock_s
            sample.tell(0, mated(0, 1, agent=agent(0, 0), conceived=True), told_s=told_s - 60.0)
            assert pairings(sample) == []
            sample.tell(0, mated(0, 1, count), met(1), told_s=told_s - 1.0)
            assert len(pairings(sample)) == 2
            sample.pass_s(60.0)
        sample.tell(0, lived(agent(0, 0)))
        sample.go(0)
        sample.pass_s(60.0)
        ((_, generation),) = sample.view.take_ended_generations(sample.at_s)
        assert generation.conceptions.mean == 3.0

    def test_they_are_forgotten_when_the_clock_is_set_back_too(self, sample: FakeTelemetry) -> None:
        """And the next meeting is shown."""
        sample.tell(0, mated(0, 1), met(1))
        sample.pass_s(-3600.0)
        assert pairings(sample) == []
        sample.tell(0, met(1))
        assert [p.unix_s for p in pairings(sample)] == [sample.at_s]

    def test_many_take_a_limited_memory(
        self, sample: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """However many there are, and however long it goes on."""
        monkeypatch.setattr(spectator_module, "_MAX_PAIRS", 20)
        sample = FakeTelemetry()
        for count in range(500):
            sample.tell(0, mated(0, 1, count))
            sample.pass_s(0.5)
            assert len(sample.view.pairings) <= 20
            assert len(sample.view._known_pairings) <= 50

    @given(st.lists(st.tuples(st.integers(0, 9), st.booleans()), max_size=40))
    def test_whoever_tells_first_and_how_often(self, message: list[tuple[int, bool]]) -> None:
        """There is one pairing for every encounter that anybody told of."""
        sample = FakeTelemetry()
        for count, is_initiators in message:
            sample.tell(0 if is_initiators else 1, mated(0, 1, count))
        assert len(pairings(sample)) == len({count for count, _ in message})


class TestLog:
    """What was said, in moderation."""

    def test_lines_of_one_kind_are_thinned(self, sample: FakeTelemetry) -> None:
        """The first are there, the others are counted; other kinds are not touched by it."""
        for number in range(20):
            sample.tell(0, Fault(7, f"fault {number}"))
        sample.come(1)
        lines = texts(sample)
        assert lines[:8] == [f"{IDS[0].hex()[:8]}: fault {number}" for number in range(8)]
        assert lines[8:] == [f"{IDS[1].hex()[:8]} is here", "… and 12 more (fault)"]

    def test_every_time_begins_anew(self, sample: FakeTelemetry) -> None:
        """Nothing is said twice."""
        for _ in range(2):
            sample.tell(0, *(Fault(7, str(number)) for number in range(9)))
            assert len(texts(sample)) == 9
        assert texts(sample) == []


class TestNames:
    """How robots are called: shortly, and no two alike."""

    def test_a_robot_is_called_by_its_number(self, sample: FakeTelemetry) -> None:
        """Once it has said it; before that by its id."""
        sample.come(0)
        sample.pass_s(0.5)
        assert sample.view.call(IDS[0]) == IDS[0].hex()[:8]
        sample.join(0, number=12)
        assert sample.view.call(IDS[0]) == "#12"
        assert sample.view.call(IDS[9]) == IDS[9].hex()[:8]

    def test_two_robots_with_one_number_are_called_by_their_ids(
        self, sample: FakeTelemetry
    ) -> None:
        """A third is not touched by that."""
        sample.join(0, 1, number=0)
        sample.join(2, number=7)
        names = [sample.view.call(robot) for robot in IDS[:3]]
        assert names == [IDS[0].hex()[:8], IDS[1].hex()[:8], "#7"]

    def test_of_several_colonies_the_colony_is_said(self, sample: FakeTelemetry) -> None:
        """Numbers may repeat then."""
        sample.join(0, number=0)
        sample.join(1, number=0, colony="red")
        sample.pass_s(0.5)
        assert [sample.view.call(robot) for robot in IDS[:2]] == ["blue #0", "red #0"]

    @given(
        st.lists(
            st.tuples(st.sampled_from(["blue", "red"]), st.none() | st.integers(0, 3)), max_size=12
        )
    )
    def test_no_two_are_called_alike(self, robots: list[tuple[str, int | None]]) -> None:
        """Whatever numbers they say they have, in however many colonies."""
        sample = FakeTelemetry()
        for robot, (colony, number) in enumerate(robots):
            sample.come(robot, colony=colony)
            if number is not None:
                sample.state(robot, colony=colony, number=number)
        sample.pass_s(0.5)
        sample.pass_s(0.5)
        names = [sample.view.call(robot) for robot in IDS[: len(robots)]]
        assert len(set(names)) == len(names)


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
        ended = sample.view.take_ended_generations(sample.at_s)
        assert [(colony.name, generation.best) for colony, generation in ended] == [
            ("blue", agent(0, 0)),
            ("red", agent(1, 0)),
        ]
        blue, red = sample.view.colonies.values()
        assert (blue.best, red.best) == (agent(0, 0), agent(1, 0))
        assert (blue.family[agent(1, 0)], red.family[agent(0, 0)]) == (None, None)
        assert sample.view.take_ended_generations(sample.at_s + 100.0) == []

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
        assert sample.view.take_ended_generations(sample.at_s + 100.0) == []
        assert len(sample.view.colonies["blue"].family) == 0

    def test_a_generation_ended_when_it_was_told(self, sample: FakeTelemetry) -> None:
        """Not when it was heard of."""
        sample.join(0, generation=1)
        sample.tell(0, lived(agent(0, 0)), told_s=T - 500.0)
        ((_, generation),) = sample.view.take_ended_generations(sample.at_s + PATIENCE_S)
        assert generation.unix_s == T - 500.0


def rates(sample: FakeTelemetry, colony: str = "blue") -> tuple[float, float] | None:
    return sample.view.rates(sample.view.colonies[colony])


class TestRates:
    """How often a robot mates and captures in a minute of its colony's time."""

    def test_each_mating_counts_once_for_both(self, sample: FakeTelemetry) -> None:
        """Two robots that mate with each other once a minute mate once a minute, each of them."""
        sample.join(0, 1, matings=0, captures=0)
        for minute in range(4):
            sample.state(0, 1, matings=minute, captures=10 * minute)
            sample.view.update_rates(sample.at_s)
            sample.pass_s(20.0)
        assert rates(sample) == pytest.approx((3.0, 30.0))
        assert sample.view.colonies["blue"].matings == 3.0

    def test_what_was_before_is_not_counted(self, sample: FakeTelemetry) -> None:
        """A robot comes with all the matings of its life."""
        sample.join(0, matings=1_000, captures=7_000)
        sample.view.update_rates(sample.at_s)
        sample.pass_s(30.0)
        sample.join(1, matings=500, captures=100)
        sample.view.update_rates(sample.at_s)
        assert rates(sample) == (0.0, 0.0)

    def test_rates_are_of_the_last_minute(self, sample: FakeTelemetry) -> None:
        """What was long ago counts no more."""
        sample.join(0, matings=0, captures=0)
        sample.view.update_rates(sample.at_s)
        sample.state(0, matings=50, captures=50)
        for _ in range(100):
            sample.pass_s(1.0)
            sample.view.update_rates(sample.at_s)
        assert rates(sample) == (0.0, 0.0)
        assert len(sample.view.colonies["blue"].samples) <= 62

    def test_they_are_the_same_as_long_as_nothing_changes(self, sample: FakeTelemetry) -> None:
        """However long that goes on."""
        sample.join(0, matings=0, captures=0)
        for second in range(300):
            sample.state(0, matings=second, captures=7)
            sample.pass_s(1.0)
            sample.view.update_rates(sample.at_s)
            if second in (20, 100, 299):
                assert rates(sample) == pytest.approx((60.0, 0.0), abs=60.0 / second)

    def test_nobody_unmates(self, sample: FakeTelemetry) -> None:
        """A robot whose counts fall has another memory than before: it counts on from there."""
        sample.join(0, matings=0, captures=0)
        for matings, captures in ((10, 10), (2, 3), (3, 3)):
            sample.view.update_rates(sample.at_s)
            sample.state(0, matings=matings, captures=captures)
            sample.pass_s(1.0)
        sample.view.update_rates(sample.at_s)
        colony = sample.view.colonies["blue"]
        assert (colony.matings, colony.captures) == (5.5, 10.0)

    def test_minutes_are_those_of_the_arena(self, sample: FakeTelemetry) -> None:
        """A colony that lives ten times as fast mates ten times as often only if it does so by its own clock."""
        sample.join(0, 1, arena="lab", matings=0, captures=0, tick=0)
        for minute in range(4):
            sample.scene((0, 0.0, 0.0), tick=300 * minute)
            sample.state(0, 1, arena="lab", matings=minute, captures=minute, tick=300 * minute)
            sample.pass_s(6.0)
            sample.view.update_rates(sample.at_s)
        assert rates(sample) == pytest.approx((1.0, 1.0))

    def test_another_clock_makes_no_leap(self, sample: FakeTelemetry) -> None:
        """An arena that comes or goes has a time of its own; it is counted anew from there."""
        sample.join(0, matings=0, captures=0)
        sample.scene((0, 0.0, 0.0), tick=10_000_000, arena="b")
        sample.view.update_rates(sample.at_s)
        sample.pass_s(0.5)
        sample.view.update_rates(sample.at_s)
        sample.scene((0, 0.0, 0.0), tick=900_000_000, arena="a")
        sample.pass_s(0.5)
        sample.view.update_rates(sample.at_s)
        assert rates(sample) is None
        sample.scene((0, 0.0, 0.0), tick=900_000_300, arena="a")
        sample.state(0, matings=2, captures=5)
        sample.pass_s(0.5)
        sample.view.update_rates(sample.at_s)
        assert rates(sample) == pytest.approx((2.0, 5.0))

    def test_who_is_forgotten_is_not_remembered_here(
        self, sample: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Anybody can make up robots without end."""
        monkeypatch.setattr(presence, "MAX_ROBOTS", 3)
        sample = FakeTelemetry(ColonyView(ColonyMonitor()))
        for robot in range(40):
            sample.join(robot)
            sample.view.update_rates(sample.at_s)
            sample.go(robot)
        assert len(sample.view._counted) <= 4


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
        ((_, generation),) = sample.view.take_ended_generations(sample.at_s + PATIENCE_S)
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
