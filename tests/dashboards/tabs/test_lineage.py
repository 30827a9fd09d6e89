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
    show.telemetry.join(0, 1, generation=0)
    return show


def report_births(
    show: TabHarness, robot: int, generation: int, agents: int = 4, colony: str = "blue"
) -> None:
    """Report the births of a generation; mothers have the same index, fathers the next one."""
    for k in range(agents):
        parents = {}
        if generation:
            parents["mother"] = agent(robot, 100 * (generation - 1) + k)
            parents["father"] = agent(robot, 100 * (generation - 1) + (k + 1) % agents)
        name = agent(robot, 100 * generation + k)
        show.telemetry.events(robot, born(name, generation, [float(k)], **parents), colony=colony)


def places(streams: RecordingStreams) -> Places:
    names = streams.shown(FAMILY, "node_ids")
    where = streams.shown(FAMILY, "positions")
    return {name: (x, y) for name, (x, y) in zip(names, where, strict=True)}


class TestFamily:
    """The family tree."""

    def test_nodes_are_agents_and_edges_go_from_parents(self, show: TabHarness) -> None:
        """To their children, if both are drawn."""
        report_births(show, 0, 0, 2)
        report_births(show, 0, 1, 2)
        streams = show.draw(2.0)
        mothers = [agent(0, 0), agent(0, 1)]
        children = [agent(0, 100), agent(0, 101)]
        assert sorted(streams.shown(FAMILY, "node_ids")) == sorted(mothers + children)
        edges = {(edge["first"], edge["second"]) for edge in streams.shown(FAMILY, "edges")}
        assert edges == {(parent, child) for parent in mothers for child in children}
        assert set(streams.shown(FAMILY, "labels")) == {"0", "1", "100", "101"}

    def test_the_tree_is_drawn_after_births(self, show: TabHarness) -> None:
        """At most every two seconds, and not without a birth."""
        assert show.draw(2.0).paths() == []
        report_births(show, 0, 0)
        assert show.draw(2.0).times(FAMILY) == 1
        for _ in range(5):
            assert show.draw(2.0).paths() == []
        drawn = 0
        for generation in range(1, 41):
            report_births(show, 0, generation)
            drawn += show.draw(0.25).times(FAMILY)
        assert drawn == pytest.approx(5, abs=1)

    def test_agents_keep_their_positions(self, show: TabHarness) -> None:
        """In a small colony, whatever other agents are born or robots leave."""
        report_births(show, 1, 0)
        seen = places(show.draw(2.0))
        for generation in range(6):
            for robot in (0, 1) if generation else (0,):
                report_births(show, robot, generation)
                now = places(show.draw(2.0))
                assert {name: now[name] for name in seen if name in now} == {
                    name: place for name, place in seen.items() if name in now
                }
                seen = now
            show.telemetry.offline(generation % 2)
        assert len(set(seen.values())) == len(seen)

    def test_robots_are_side_by_side_and_generations_below_each_other(
        self, show: TabHarness
    ) -> None:
        """In the order of the robots' numbers."""
        for generation in range(2):
            for robot in (1, 0):
                report_births(show, robot, generation, 3)
        where = places(show.draw(2.0))
        columns = [where[agent(robot, k)][0] for robot in (0, 1) for k in range(3)]
        assert columns == sorted(set(columns))
        below = [where[agent(robot, 100 + k)] for robot in (0, 1) for k in range(3)]
        assert [x for x, _ in below] == columns
        assert {y for _, y in where.values()} == {0.0, 200.0}

    def test_no_two_agents_have_the_same_position(self, show: TabHarness) -> None:
        """Also with agents of robots that were dropped, and in a colony of many robots."""
        for robot in (2, 3):
            show.telemetry.events(robot, born(agent(robot, 0)))
        for robot in (0, 1):
            report_births(show, robot, 0)
        show.telemetry.remove_absent()
        assert set(show.telemetry.monitor.robots) == set(IDS[:2])
        where = places(show.draw(2.0))
        assert len(set(where.values())) == len(where) == 10
        for robot in range(4, 54):
            show.telemetry.join(robot)
            report_births(show, robot, 0)
        where = places(show.draw(2.0))
        assert len(set(where.values())) == len(where) > 60
        assert max(x for x, _ in where.values()) < 22.0 * 160

    def test_colours_are_those_of_the_founders(self, show: TabHarness) -> None:
        """Of the founder of most of an agent's genes."""
        report_births(show, 0, 0, 2)
        show.telemetry.events(
            0, born(agent(0, 100), 1, [1.0], mother=agent(0, 0), father=agent(0, 1))
        )
        streams = show.draw(2.0)
        colours = dict(zip(streams.shown(FAMILY, "node_ids"), streams.colours(FAMILY), strict=True))
        assert colours[agent(0, 0)] == palette.founder_colour(0)
        assert colours[agent(0, 1)] == colours[agent(0, 100)] == palette.founder_colour(1)

    def test_the_number_of_drawn_agents_is_limited(self, show: TabHarness) -> None:
        """The last births are drawn."""
        for generation in range(20):
            report_births(show, 0, generation, 30)
        shown = places(show.draw(2.0))
        assert 100 < len(shown) <= 160
        assert agent(0, 1929) in shown
        assert agent(0, 0) not in shown

    def test_several_colonies_are_drawn_in_one_graph(self, show: TabHarness) -> None:
        """Each has its own lines of founders."""
        show.telemetry.join(2, colony="red")
        report_births(show, 0, 0)
        report_births(show, 2, 0, colony="red")
        streams = show.draw(2.0)
        assert {agent(0, 0), agent(2, 0)} <= set(places(streams))
        assert "blue_others" in streams.entities(FOUNDERS)
        assert "red_others" in streams.entities(FOUNDERS)


class TestFounders:
    """The founders' shares in the colony's genes."""

    def test_shares_are_drawn_as_lines(self, show: TabHarness) -> None:
        """With the founder's name and colour; they add up to 1."""
        report_births(show, 0, 0, 2)
        report_births(show, 1, 0, 2)
        show.telemetry.events(0, born(agent(0, 100), 1, [0.0], mother=agent(0, 0)))
        streams = show.draw(2.0)
        lines = {name: streams.scalars(FOUNDERS + name) for name in streams.entities(FOUNDERS)}
        assert sum(values[0][0] for values in lines.values()) == pytest.approx(1.0)
        line = f"{FOUNDERS}blue_{IDS[0].hex()}_0"
        assert streams.scalars(line) == [[pytest.approx(1 / 3)]]
        assert streams.shown(line, "names") == ["#0 agent 0"]
        assert streams.colours(line) == [palette.founder_colour(0)]

    def test_the_line_of_an_extinct_founder_falls_to_zero(self, show: TabHarness) -> None:
        """It does not end above it."""
        report_births(show, 0, 0, 2)
        show.draw(2.0)
        show.telemetry.events(0, born(agent(0, 100), 1, [0.0], mother=agent(0, 0)))
        streams = show.draw(2.0)
        assert streams.scalars(f"{FOUNDERS}blue_{IDS[0].hex()}_1") == [[0.0]]
        assert streams.scalars(f"{FOUNDERS}blue_{IDS[0].hex()}_0") == [[1.0]]

    def test_founders_with_small_shares_are_drawn_together(self, show: TabHarness) -> None:
        """Until the share of one has grown; a founder with a line keeps it."""
        report_births(show, 0, 0, 200)
        streams = show.draw(2.0)
        assert streams.entities(FOUNDERS) == ["blue_others"]
        assert streams.shown(f"{FOUNDERS}blue_others", "names") == ["all others"]
        assert streams.scalars(f"{FOUNDERS}blue_others") == [[pytest.approx(1.0)]]
        for k in range(150):
            show.telemetry.events(0, born(agent(0, 1000 + k), 1, [0.0], mother=agent(0, 3)))
            show.telemetry.events(0, born(agent(0, 2000 + k), 1, [0.0], mother=agent(0, k)))
        streams = show.draw(2.0)
        others = f"{FOUNDERS}blue_others"
        assert streams.entities(FOUNDERS) == [f"blue_{IDS[0].hex()}_3", "blue_others"]
        assert streams.scalars(others) == [[pytest.approx(1.0 - 151 / 300)]]

    def test_the_number_of_lines_is_limited(self, show: TabHarness) -> None:
        """Later founders count as others."""
        for generation in range(60):
            show.telemetry.events(0, born(f"{IDS[0].hex()}/{generation}", generation))
            show.draw(2.0)
        assert len(show.streams.entities(FOUNDERS)) == 24 + 1
        assert show.streams.scalars(f"{FOUNDERS}blue_others") == [[1.0]]

    def test_lines_are_styled_once(self, show: TabHarness) -> None:
        """However often they are drawn."""
        for generation in range(3):
            report_births(show, 0, generation, 2)
            streams = show.draw(2.0)
            named = [drawing.path for drawing in streams.drawings if drawing.is_static]
            assert (len(named) > 0) == (generation == 0)
