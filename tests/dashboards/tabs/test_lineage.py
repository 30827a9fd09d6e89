"""The family is drawn when it has grown, everybody in a place that they keep, in the colour of their founder."""

import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.lineage import LineageTab

from tests.support.drawn import RecordingStreams, TabHarness
from tests.support.fake_telemetry import IDS, agent, born

FAMILY, FOUNDERS = "/lineage/family", "/lineage/founders/"
Places = dict[str, tuple[float, float]]


@pytest.fixture
def show() -> TabHarness:
    show = TabHarness(LineageTab())
    show.sample.join(0, 1, generation=0)
    return show


def bear(
    show: TabHarness, robot: int, generation: int, agents: int = 4, colony: str = "blue"
) -> None:
    """Let a robot bear a generation, of the mothers at the same places, and the fathers next to them."""
    for k in range(agents):
        parents = {}
        if generation:
            parents["mother"] = agent(robot, 100 * (generation - 1) + k)
            parents["father"] = agent(robot, 100 * (generation - 1) + (k + 1) % agents)
        name = agent(robot, 100 * generation + k)
        show.sample.tell(robot, born(name, generation, [float(k)], **parents), colony=colony)


def places(streams: RecordingStreams) -> Places:
    names = streams.shown(FAMILY, "node_ids")
    where = streams.shown(FAMILY, "positions")
    return {name: (x, y) for name, (x, y) in zip(names, where, strict=True)}


class TestFamily:
    """Who was born of whom."""

    def test_nodes_are_agents_and_edges_go_from_parents(self, show: TabHarness) -> None:
        """To their children, where both are shown."""
        bear(show, 0, 0, 2)
        bear(show, 0, 1, 2)
        streams = show.draw(2.0)
        mothers = [agent(0, 0), agent(0, 1)]
        children = [agent(0, 100), agent(0, 101)]
        assert sorted(streams.shown(FAMILY, "node_ids")) == sorted(mothers + children)
        edges = {(edge["first"], edge["second"]) for edge in streams.shown(FAMILY, "edges")}
        assert edges == {(parent, child) for parent in mothers for child in children}
        assert set(streams.shown(FAMILY, "labels")) == {"0", "1", "100", "101"}

    def test_it_is_drawn_when_it_has_grown(self, show: TabHarness) -> None:
        """Every two seconds at most, and not again without a birth."""
        assert show.draw(2.0).paths() == []
        bear(show, 0, 0)
        assert show.draw(2.0).times(FAMILY) == 1
        for _ in range(5):
            assert show.draw(2.0).paths() == []
        drawn = 0
        for generation in range(1, 41):
            bear(show, 0, generation)
            drawn += show.draw(0.25).times(FAMILY)
        assert drawn == pytest.approx(5, abs=1)

    def test_everybody_keeps_their_place(self, show: TabHarness) -> None:
        """In a small colony, whoever else is born or gone."""
        bear(show, 1, 0)
        seen = places(show.draw(2.0))
        for generation in range(6):
            for robot in (0, 1) if generation else (0,):
                bear(show, robot, generation)
                now = places(show.draw(2.0))
                assert {name: now[name] for name in seen if name in now} == {
                    name: place for name, place in seen.items() if name in now
                }
                seen = now
            show.sample.go(generation % 2)
        assert len(set(seen.values())) == len(seen)

    def test_robots_stand_side_by_side_and_generations_below_each_other(
        self, show: TabHarness
    ) -> None:
        """In the order of robots' numbers."""
        for generation in range(2):
            for robot in (1, 0):
                bear(show, robot, generation, 3)
        where = places(show.draw(2.0))
        columns = [where[agent(robot, k)][0] for robot in (0, 1) for k in range(3)]
        assert columns == sorted(set(columns))
        below = [where[agent(robot, 100 + k)] for robot in (0, 1) for k in range(3)]
        assert [x for x, _ in below] == columns
        assert {y for _, y in where.values()} == {0.0, 200.0}

    def test_no_two_stand_in_one_place(self, show: TabHarness) -> None:
        """Agents of robots that are forgotten neither; nor in a colony of many robots."""
        for robot in (2, 3):
            show.sample.tell(robot, born(agent(robot, 0)))
        for robot in (0, 1):
            bear(show, robot, 0)
        show.sample.forget_absent()
        assert set(show.sample.monitor.robots) == set(IDS[:2])
        where = places(show.draw(2.0))
        assert len(set(where.values())) == len(where) == 10
        for robot in range(4, 54):
            show.sample.join(robot)
            bear(show, robot, 0)
        where = places(show.draw(2.0))
        assert len(set(where.values())) == len(where) > 60
        assert max(x for x, _ in where.values()) < 22.0 * 160

    def test_colours_are_those_of_the_founders(self, show: TabHarness) -> None:
        """Of most of an agent's genes."""
        bear(show, 0, 0, 2)
        show.sample.tell(0, born(agent(0, 100), 1, [1.0], mother=agent(0, 0), father=agent(0, 1)))
        streams = show.draw(2.0)
        colours = dict(zip(streams.shown(FAMILY, "node_ids"), streams.colours(FAMILY), strict=True))
        assert colours[agent(0, 0)] == palette.founder_colour(0)
        assert colours[agent(0, 1)] == colours[agent(0, 100)] == palette.founder_colour(1)

    def test_of_many_births_the_last_are_shown(self, show: TabHarness) -> None:
        """Not more than a person can look at."""
        for generation in range(20):
            bear(show, 0, generation, 30)
        shown = places(show.draw(2.0))
        assert 100 < len(shown) <= 160
        assert agent(0, 1929) in shown
        assert agent(0, 0) not in shown

    def test_several_colonies_share_the_picture(self, show: TabHarness) -> None:
        """And each has lines of its own."""
        show.sample.join(2, colony="red")
        bear(show, 0, 0)
        bear(show, 2, 0, colony="red")
        streams = show.draw(2.0)
        assert {agent(0, 0), agent(2, 0)} <= set(places(streams))
        assert "blue_others" in streams.entities(FOUNDERS)
        assert "red_others" in streams.entities(FOUNDERS)


class TestFounders:
    """How much of the colony goes back to whom."""

    def test_shares_are_drawn_as_lines(self, show: TabHarness) -> None:
        """With the founder's name and colour; all of them together are the whole colony."""
        bear(show, 0, 0, 2)
        bear(show, 1, 0, 2)
        show.sample.tell(0, born(agent(0, 100), 1, [0.0], mother=agent(0, 0)))
        streams = show.draw(2.0)
        lines = {name: streams.scalars(FOUNDERS + name) for name in streams.entities(FOUNDERS)}
        assert sum(values[0][0] for values in lines.values()) == pytest.approx(1.0)
        line = f"{FOUNDERS}blue_{IDS[0].hex()}_0"
        assert streams.scalars(line) == [[pytest.approx(1 / 3)]]
        assert streams.shown(line, "names") == ["#0 agent 0"]
        assert streams.colours(line) == [palette.founder_colour(0)]

    def test_a_founder_that_has_died_out_comes_down_to_nothing(self, show: TabHarness) -> None:
        """Its line does not end above it."""
        bear(show, 0, 0, 2)
        show.draw(2.0)
        show.sample.tell(0, born(agent(0, 100), 1, [0.0], mother=agent(0, 0)))
        streams = show.draw(2.0)
        assert streams.scalars(f"{FOUNDERS}blue_{IDS[0].hex()}_1") == [[0.0]]
        assert streams.scalars(f"{FOUNDERS}blue_{IDS[0].hex()}_0") == [[1.0]]

    def test_founders_with_small_shares_are_drawn_together(self, show: TabHarness) -> None:
        """Until one of them has grown; whoever has a line keeps it, but there are not many."""
        bear(show, 0, 0, 200)
        streams = show.draw(2.0)
        assert streams.entities(FOUNDERS) == ["blue_others"]
        assert streams.shown(f"{FOUNDERS}blue_others", "names") == ["all others"]
        assert streams.scalars(f"{FOUNDERS}blue_others") == [[pytest.approx(1.0)]]
        for k in range(150):
            show.sample.tell(0, born(agent(0, 1000 + k), 1, [0.0], mother=agent(0, 3)))
            show.sample.tell(0, born(agent(0, 2000 + k), 1, [0.0], mother=agent(0, k)))
        streams = show.draw(2.0)
        others = f"{FOUNDERS}blue_others"
        assert streams.entities(FOUNDERS) == [f"blue_{IDS[0].hex()}_3", "blue_others"]
        assert streams.scalars(others) == [[pytest.approx(1.0 - 151 / 300)]]

    def test_lines_are_few(self, show: TabHarness) -> None:
        """Whoever comes later than the first two dozen is one of the others."""
        for generation in range(60):
            show.sample.tell(0, born(f"{IDS[0].hex()}/{generation}", generation))
            show.draw(2.0)
        assert len(show.streams.entities(FOUNDERS)) == 24 + 1
        assert show.streams.scalars(f"{FOUNDERS}blue_others") == [[1.0]]

    def test_lines_are_named_once(self, show: TabHarness) -> None:
        """However often they are drawn."""
        for generation in range(3):
            bear(show, 0, generation, 2)
            streams = show.draw(2.0)
            named = [drawing.path for drawing in streams.drawings if drawing.is_static]
            assert (len(named) > 0) == (generation == 0)
