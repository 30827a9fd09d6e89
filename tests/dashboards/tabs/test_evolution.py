"""Each generation is drawn once, when it is over; and the potentials are those that the robot learns by."""

import json
import math

import numpy as np
import pytest
from crcolony_dashboards.rerun_streams import Moment
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.agent_potentials import potential
from crcolony_dashboards.tabs.evolution import EvolutionTab

from crcolony.body.settings import CyberRodent
from crcolony.protocol.identity import RobotId
from crcolony.robot.genes import META_PARAMETERS, agent_schema
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.peer_settings import Mind
from tests.support.drawn import Drawing, RecordingStreams, TabHarness
from tests.support.fake_telemetry import IDS, SCHEMA, SETTINGS, T, agent, born, lived

RNG = np.random.default_rng(1)
GENES = [SCHEMA.random(RNG) for _ in range(200)]
"""Of agents"""


@pytest.fixture
def show() -> TabHarness:
    """Two robots that have published their settings."""
    show = TabHarness(EvolutionTab())
    show.telemetry.join(0, 1, generation=0)
    show.telemetry.robot_metadata(0, 1)
    return show


def live(show: TabHarness, number: int, agents: int = 3, robots: tuple[int, ...] = (0, 1)) -> None:
    """Report a whole generation and the births of the next; agents of robots with higher numbers mate more."""
    for robot in robots:
        names = [agent(robot, 100 * number + k) for k in range(agents)]
        for k, name in enumerate(names):
            show.telemetry.events(
                robot, born(name, number, list(GENES[(robot + 2 * k) % len(GENES)]))
            )
        for k, name in enumerate(names):
            show.telemetry.events(robot, lived(name, number, matings=robot + k, captures=10 * k))
        child = agent(robot, 100 * (number + 1))
        show.telemetry.events(robot, born(child, number + 1, list(GENES[7])))
        show.telemetry.state(robot, generation=number + 1, agent=child)
    show.telemetry.advance_s(0.5)


def drawn(streams: RecordingStreams, path: str) -> list[Drawing]:
    return [drawing for drawing in streams.drawings if drawing.path == path]


class TestMeasures:
    """Mean and spread of what the agents of a generation did."""

    def test_a_generation_is_drawn_once(self, show: TabHarness) -> None:
        """When it has ended, with mean and variance of all its agents."""
        assert "/evolution/matings/blue" not in show.draw(1.0).paths()
        live(show, 0)
        streams = show.draw(1.0)
        assert streams.times("/evolution/matings/blue") == 1
        assert streams.shown("/evolution/matings/blue", "values") == [1.5]
        assert streams.shown("/evolution/matings/blue", "variances") == pytest.approx([11 / 12])
        assert streams.shown("/evolution/captures/blue", "values") == [10.0]
        assert streams.shown("/evolution/conceptions/blue", "values") == [0.0]
        ends = streams.scalars("/evolution/matings/blue_ends")
        assert ends == [pytest.approx([1.5 - (11 / 12) ** 0.5, 1.5 + (11 / 12) ** 0.5])]
        for _ in range(30):
            assert not any("matings" in path or "genes" in path for path in show.draw(1.0).paths())

    def test_a_generation_is_drawn_at_the_time_of_its_end(self, show: TabHarness) -> None:
        """On every timeline, also when it is received later."""
        show.telemetry.scene((0, 0.0, 0.0), tick=9_000)
        for robot in (0, 1):
            for number in (0, 1):
                name = agent(robot, number)
                incarnation = lived(name, number, tick=5_000 + 100 * number)
                show.telemetry.events(robot, incarnation, told_s=T - 300.0 + number)
                show.telemetry.events(robot, born(agent(robot, 9 + number), number + 1))
            show.telemetry.state(robot, generation=2)
        show.telemetry.advance_s(0.5)
        moments = [drawing.moment for drawing in drawn(show.draw(1.0), "/evolution/matings/blue")]
        assert moments == [Moment(T - 300.0, 1_000.0, 0), Moment(T - 299.0, 1_020.0, 1)]

    @pytest.mark.parametrize(("tick", "sim_s"), [(2**60, 20.0), (50, 10.0), (-7, 0.0)])
    def test_no_generation_ends_in_the_future(
        self, show: TabHarness, tick: int, sim_s: float
    ) -> None:
        """Nor before the start, whatever a robot's clock says."""
        show.telemetry.scene(tick=100)
        show.telemetry.events(0, lived(agent(0, 0), tick=tick), told_s=T + 1e9)
        show.telemetry.state(0, 1, generation=1)
        streams = show.draw(20.0)
        (drawing,) = drawn(streams, "/evolution/matings/blue")
        assert drawing.moment == Moment(show.telemetry.at_s, sim_s, 0)

    def test_colonies_have_different_colours(self, show: TabHarness) -> None:
        """They keep them when colonies with earlier names join."""
        live(show, 0)
        blue = show.draw(1.0).colours("/evolution/matings/blue")
        show.telemetry.join(2, colony="ash", generation=1)
        show.telemetry.events(2, lived(agent(2, 0)), colony="ash")
        live(show, 1)
        show.draw(1.0)
        streams = show.draw(12.0)
        assert streams.colours("/evolution/matings/ash") == [palette.series_colour(1)]
        assert streams.colours("/evolution/matings/blue") == blue == [palette.series_colour(0)]


class TestGenes:
    """The distribution of the meta-parameters."""

    def test_clouds_and_medians_are_of_the_genes(self, show: TabHarness) -> None:
        """Every agent is a point if there are few; lines are styled once."""
        live(show, 0)
        streams = show.draw(1.0)
        for module in ("foraging", "mating"):
            for meta in META_PARAMETERS:
                place = SCHEMA.index(f"{module}.{meta}")
                path = f"/evolution/genes/{module}/{meta}/blue"
                values = [GENES[(robot + 2 * k) % 200][place] for robot in (0, 1) for k in range(3)]
                (points,) = streams.scalars(path)
                assert len(points) == 60
                assert sorted(point for point in points if not math.isnan(point)) == sorted(values)
                assert streams.scalars(f"{path}_median") == [[pytest.approx(np.median(values))]]
        assert any(drawing.is_static for drawing in streams.drawings)
        live(show, 1)
        assert not any(drawing.is_static for drawing in show.draw(1.0).drawings)

    def test_a_cloud_has_a_limited_number_of_points(self, show: TabHarness) -> None:
        """They are taken evenly from all agents."""
        live(show, 0, agents=90)
        path = "/evolution/genes/mating/alpha/blue"
        (points,) = show.draw(1.0).scalars(path)
        assert sum(not math.isnan(point) for point in points) == 60

    def test_the_mean_selector_is_drawn(self, show: TabHarness) -> None:
        """Its weights are averaged over all agents."""
        live(show, 0)
        mean = np.mean([GENES[robot + 2 * k][:4] for robot in (0, 1) for k in range(3)], axis=0)
        assert show.draw(1.0).scalars("/evolution/selector/blue") == [pytest.approx(mean)]

    def test_genes_are_not_drawn_without_the_settings_to_decode_them(self) -> None:
        """Until a robot with as many genes has published its settings only the measures are drawn."""
        other = json.loads(SETTINGS)
        other["learning"]["potential_distances"] = 3
        for settings in (None, json.dumps(other)):
            show = TabHarness(EvolutionTab())
            show.telemetry.join(0, generation=0)
            if settings is not None:
                show.telemetry.robot_metadata(0, settings=settings)
            live(show, 0, robots=(0,))
            streams = show.draw(1.0)
            assert streams.entities("/evolution/matings/") == ["blue", "blue_ends"]
            assert streams.entities("/evolution/genes/") == []
            assert streams.entities("/evolution/potential/") == []


class TestAgent:
    """One agent: the best of the last generation, or the chosen one."""

    def test_the_best_agent_is_drawn_when_it_has_changed(self, show: TabHarness) -> None:
        """Its potentials, with large distances at the top, and its text; not again while it is the same agent."""
        live(show, 0)
        streams = show.draw(1.0)
        best = GENES[(1 + 2 * 2) % 200]
        weights = best[4 + 5 : 4 + 5 + 16].reshape(4, 4)
        picture = streams.picture("/evolution/potential/foraging")
        mind = Mind(CyberRodent(camera_range_m=1.5), Learning(), Heredity())
        expected = palette.heat_map(potential(mind, weights))
        assert np.array_equal(picture, expected[::-1])
        axes = "/evolution/potential/foraging/axes"
        labels, marks = streams.shown(axes, "labels"), streams.shown(axes, "positions")
        assert labels == ["75° left", "ahead, 0 m", "75° right", "1.5 m"]
        assert [x for x, _ in marks] == [0.0, 30.0, 60.0, 30.0]
        assert [y > 60.0 for _, y in marks] == [True, True, True, False]
        assert marks[3][1] < 0.0
        assert streams.text("/evolution/agent").startswith("**Agent 2 of #1**")
        assert "/evolution/agent" not in show.draw(1.0).paths()
        live(show, 1)
        assert show.draw(1.0).text("/evolution/agent").startswith("**Agent 102 of #1**")

    def test_before_the_first_generation_has_ended_any_agent_is_drawn(
        self, show: TabHarness
    ) -> None:
        """One whose birth was received; it is not replaced before there is a best agent."""
        assert "/evolution/agent" not in show.draw(1.0).paths()
        for robot in (0, 1):
            show.telemetry.events(robot, born(agent(robot, 5), 0, list(GENES[robot])))
            show.telemetry.state(robot, generation=0, agent=agent(robot, 5))
        assert show.draw(1.0).text("/evolution/agent").startswith("**Agent 5 of #0**")
        show.telemetry.state(0, generation=0, agent=agent(0, 6))
        show.telemetry.events(0, born(agent(0, 6), 0, list(GENES[8])))
        assert show.draw(1.0).paths() == []

    def test_the_chosen_agent_is_drawn(self) -> None:
        """As soon as its birth was received, even if others mate more."""
        show = TabHarness(EvolutionTab(agent(0, 1)))
        show.telemetry.join(0, 1, generation=0)
        show.telemetry.robot_metadata(0, 1)
        live(show, 0)
        assert show.draw(1.0).text("/evolution/agent").startswith("**Agent 1 of #0**")
        live(show, 1)
        assert "/evolution/agent" not in show.draw(1.0).paths()

    def test_the_text_has_what_an_agent_inherited(self, show: TabHarness) -> None:
        """Meta-parameters of both modules, the range of its potentials, and its selector."""
        live(show, 0)
        text = show.draw(1.0).text("/evolution/agent")
        best = dict(zip((gene.name for gene in SCHEMA.genes), GENES[5], strict=True))
        assert f"| α | {best['foraging.alpha']:.3f} | {best['mating.alpha']:.3f} |" in text
        assert f"- {best['selector.mating.bias']:+.2f} bias" in text
        assert (
            f"- {best['selector.mating.mating_target_visible']:+.2f} mating target visible" in text
        )
        assert "| lowest Φ |" in text

    @pytest.mark.parametrize("sense", ["camera_half_angle_rad", "camera_range_m"])
    def test_without_a_camera_there_are_no_potentials(self, sense: str) -> None:
        """And nothing is raised."""
        blind = json.loads(SETTINGS)
        blind["body"][sense] = 0.0 if sense == "camera_half_angle_rad" else 1e-320
        show = TabHarness(EvolutionTab())
        show.telemetry.join(0, generation=0)
        show.telemetry.robot_metadata(0, settings=json.dumps(blind))
        live(show, 0, robots=(0,))
        assert show.draw(1.0).entities("/evolution/potential/") == []

    def test_the_largest_genes_are_drawn(self, show: TabHarness) -> None:
        """Any peer can publish them."""
        show.telemetry.events(0, born(agent(0, 5), 0, [1e9, -1e9] * (len(SCHEMA) // 2)))
        show.telemetry.state(0, generation=0, agent=agent(0, 5))
        assert len(SCHEMA) % 2 == 0
        assert show.draw(1.0).picture("/evolution/potential/mating").shape == (61, 61, 3)


def test_the_schema_of_these_tests_is_that_of_the_settings() -> None:
    """The tests of this file rely on it."""
    assert len(SCHEMA) == len(agent_schema(Learning(), Heredity())) == len(GENES[0])
    robots: list[RobotId] = IDS[:2]
    assert len(set(robots)) == 2
