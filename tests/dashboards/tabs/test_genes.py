"""The genes tab shows how meta-parameters spread, and of one agent the potentials that its robot learns by."""

import json

import numpy as np
import pytest
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.agent_potentials import heat_map_with_scale
from crcolony_dashboards.tabs.genes import GenesTab
from crcolony_dashboards.view_model.generation_history import MIN_DRAWN
from crcolony_dashboards.view_model.potentials import potential

from crcolony.body.settings import CyberRodent
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.peer_settings import Mind
from tests.support.drawn import TabHarness
from tests.support.fake_telemetry import SCHEMA, SETTINGS, agent, born
from tests.support.reported_generations import GENES, report_generation


@pytest.fixture
def show() -> TabHarness:
    """Two robots that have published their settings."""
    show = TabHarness(GenesTab())
    show.telemetry.join(0, 1, generation=0)
    show.telemetry.robot_metadata(0, 1)
    return show


class TestSpreads:
    """The distribution of the meta-parameters."""

    def test_every_meta_parameter_has_its_median_and_its_spread(self, show: TabHarness) -> None:
        """Of both modules, in their colours; only the medians have names."""
        for number in range(MIN_DRAWN):
            report_generation(show, number)
        streams = show.draw(1.0)
        for meta in META_PARAMETERS:
            path = f"/genes/{meta}"
            assert len(streams.shown(f"{path}/lines", "strips")) == 6
            assert streams.colours(f"{path}/names") == list(palette.MODULES)
            texts = streams.shown(f"{path}/names", "labels")
            for module, text in zip(("foraging", "mating"), texts, strict=True):
                column = SCHEMA.index(f"{module}.{meta}")
                values = [GENES[robot + 2 * k][column] for robot in (0, 1) for k in range(3)]
                name, value = text.split()
                assert name == module
                assert float(value) == pytest.approx(np.median(values), abs=0.006)

    def test_nothing_is_drawn_of_few_generations(self, show: TabHarness) -> None:
        """A text says how many have ended."""
        report_generation(show, 0)
        streams = show.draw(1.0)
        assert streams.shown("/genes/alpha/lines", "strips") == []
        (message,) = streams.shown("/genes/alpha/message", "labels")
        assert message.startswith("1 generation has ended")


class TestAgent:
    """One agent: the best of the last generation, or the chosen one."""

    def test_the_best_agent_is_drawn_when_it_has_changed(self, show: TabHarness) -> None:
        """Its potentials, with large distances at the top, and its text; not again while it is the same agent."""
        report_generation(show, 0)
        streams = show.draw(1.0)
        best = GENES[(1 + 2 * 2) % 200]
        weights = best[4 + 5 : 4 + 5 + 16].reshape(4, 4)
        picture = streams.picture("/genes/potential/foraging")
        mind = Mind(CyberRodent(camera_range_m=1.5), Learning(), Heredity())
        values = potential(mind, weights, 61)
        assert np.array_equal(picture, heat_map_with_scale(values))
        numbers = "/genes/potential/foraging/numbers"
        labels, marks = streams.shown(numbers, "labels"), streams.shown(numbers, "positions")
        assert labels[:4] == ["-75", "0", "75", "bearing (degrees, right is +)"]
        assert labels[4:8] == ["0", "0.75", "1.5", "distance (m)"]
        assert labels[8:] == [
            f"{values.min():.2f}",
            f"{0.5 * (values.min() + values.max()):.2f}",
            f"{values.max():.2f}",
            "Φ",
        ]
        assert [x for x, _ in marks[:3]] == [0.0, 30.0, 60.0]
        assert streams.text("/genes/agent").startswith("**Agent 2 of #1**")
        assert "/genes/agent" not in show.draw(1.0).paths()
        report_generation(show, 1)
        assert show.draw(1.0).text("/genes/agent").startswith("**Agent 102 of #1**")

    def test_before_the_first_generation_has_ended_any_agent_is_drawn(
        self, show: TabHarness
    ) -> None:
        """One whose birth was received; it is not replaced before there is a best agent."""
        assert "/genes/agent" not in show.draw(1.0).paths()
        for robot in (0, 1):
            show.telemetry.events(robot, born(agent(robot, 5), 0, list(GENES[robot])))
            show.telemetry.state(robot, generation=0, agent=agent(robot, 5))
        assert show.draw(1.0).text("/genes/agent").startswith("**Agent 5 of #0**")
        show.telemetry.state(0, generation=0, agent=agent(0, 6))
        show.telemetry.events(0, born(agent(0, 6), 0, list(GENES[8])))
        assert "/genes/agent" not in show.draw(1.0).paths()

    def test_the_chosen_agent_is_drawn(self) -> None:
        """As soon as its birth was received, even if others mate more."""
        show = TabHarness(GenesTab(agent(0, 1)))
        show.telemetry.join(0, 1, generation=0)
        show.telemetry.robot_metadata(0, 1)
        report_generation(show, 0)
        assert show.draw(1.0).text("/genes/agent").startswith("**Agent 1 of #0**")
        report_generation(show, 1)
        assert "/genes/agent" not in show.draw(1.0).paths()

    def test_the_text_has_what_an_agent_inherited(self, show: TabHarness) -> None:
        """Meta-parameters of both modules, the range of its potentials, and its selector."""
        report_generation(show, 0)
        text = show.draw(1.0).text("/genes/agent")
        best = dict(zip((gene.name for gene in SCHEMA.genes), GENES[5], strict=True))
        assert f"| α | {best['foraging.alpha']:.3f} | {best['mating.alpha']:.3f} |" in text
        assert f"- {best['selector.mating.bias']:+.2f} bias" in text
        assert f"- {best['selector.mating.mating_target_visible']:+.2f} robot seen" in text
        assert "| lowest Φ |" in text

    @pytest.mark.parametrize("sense", ["camera_half_angle_rad", "camera_range_m"])
    def test_without_a_camera_there_are_no_potentials(self, sense: str) -> None:
        """And nothing is raised."""
        blind = json.loads(SETTINGS)
        blind["body"][sense] = 0.0 if sense == "camera_half_angle_rad" else 1e-320
        show = TabHarness(GenesTab())
        show.telemetry.join(0, generation=0)
        show.telemetry.robot_metadata(0, settings=json.dumps(blind))
        report_generation(show, 0, robots=(0,))
        assert show.draw(1.0).entities("/genes/potential/") == []

    def test_the_largest_genes_are_drawn(self, show: TabHarness) -> None:
        """Any peer can publish them."""
        show.telemetry.events(0, born(agent(0, 5), 0, [1e9, -1e9] * (len(SCHEMA) // 2)))
        show.telemetry.state(0, generation=0, agent=agent(0, 5))
        assert len(SCHEMA) % 2 == 0
        assert show.draw(1.0).picture("/genes/potential/mating").shape == (61, 70, 3)
