"""The charts of the evolution tab show every generation that has ended, and nothing before there are enough."""

import json

import numpy as np
import pytest
from crcolony_dashboards.tabs.evolution import EvolutionTab
from crcolony_dashboards.view_model.generation_history import MIN_DRAWN

from tests.support.drawn import RecordingStreams, TabHarness
from tests.support.fake_telemetry import SCHEMA, SETTINGS, agent, born
from tests.support.reported_generations import GENES, report_generation

CHARTS = ("measures", "selector", "foraging", "mating")


@pytest.fixture
def show() -> TabHarness:
    """Two robots that have published their settings."""
    show = TabHarness(EvolutionTab())
    show.telemetry.join(0, 1, generation=0)
    show.telemetry.robot_metadata(0, 1)
    return show


def names(streams: RecordingStreams, chart: str) -> list[str]:
    return streams.shown(f"/evolution/{chart}/names", "labels")


def test_no_figure_is_drawn_of_fewer_than_five_generations(show: TabHarness) -> None:
    """In its place stands how many have ended."""
    for number in range(MIN_DRAWN - 1):
        streams = show.draw(1.0)
        for chart in CHARTS:
            assert streams.shown(f"/evolution/{chart}/lines", "strips") == []
        report_generation(show, number)
    streams = show.draw(1.0)
    for chart in CHARTS:
        (message,) = streams.shown(f"/evolution/{chart}/message", "labels")
        assert message.startswith(f"{MIN_DRAWN - 1} generations have ended")
    report_generation(show, MIN_DRAWN - 1)
    streams = show.draw(1.0)
    for chart in CHARTS:
        assert len(streams.shown(f"/evolution/{chart}/lines", "strips")) >= 3
        assert streams.shown(f"/evolution/{chart}/message", "labels") == []


def test_every_line_has_a_name_and_its_last_value(show: TabHarness) -> None:
    """Means of what agents did, medians of meta-parameters, mean weights of the selector."""
    for number in range(MIN_DRAWN):
        report_generation(show, number)
    streams = show.draw(1.0)
    assert names(streams, "measures") == ["matings 1.5", "batteries 10", "offspring 0"]
    genes = np.array([GENES[robot + 2 * k] for robot in (0, 1) for k in range(3)])
    alpha = np.median(genes[:, SCHEMA.index("mating.alpha")])
    name, value = names(streams, "mating")[0].split()
    assert name == "α"
    assert float(value) == pytest.approx(alpha, abs=0.006)
    assert [text.split()[0] for text in names(streams, "foraging")] == ["α", "γ", "λ", "τ", "decay"]
    weight = float(names(streams, "selector")[1].removeprefix("energy "))
    assert weight == pytest.approx(genes[:, 1].mean(), abs=0.006)


def test_charts_are_drawn_again_when_a_generation_has_ended(show: TabHarness) -> None:
    """And from time to time, for viewers that connect late."""
    for number in range(MIN_DRAWN):
        report_generation(show, number)
    assert show.draw(1.0).times("/evolution/measures/lines") == 1
    assert sum(show.draw(1.0).times("/evolution/measures/lines") for _ in range(50)) == 0
    report_generation(show, MIN_DRAWN)
    streams = show.draw(1.0)
    assert streams.times("/evolution/measures/lines") == 1
    assert [len(strip) for strip in streams.shown("/evolution/measures/lines", "strips")] == [6] * 3
    assert sum(show.draw(1.0).times("/evolution/measures/lines") for _ in range(70)) == 1


def test_genes_are_not_drawn_without_the_settings_to_decode_them() -> None:
    """Only the measures are, until a robot with as many genes has published its settings."""
    other = json.loads(SETTINGS)
    other["learning"]["potential_distances"] = 3
    for settings in (None, json.dumps(other)):
        show = TabHarness(EvolutionTab())
        show.telemetry.join(0, generation=0)
        if settings is not None:
            show.telemetry.robot_metadata(0, settings=settings)
        for number in range(MIN_DRAWN):
            report_generation(show, number, robots=(0,))
        streams = show.draw(1.0)
        assert len(names(streams, "measures")) == 3
        assert names(streams, "mating") == names(streams, "selector") == []
        (message,) = streams.shown("/evolution/mating/message", "labels")
        assert message == "The robots have not reported how their genes are read."


def test_the_colony_with_most_robots_is_drawn(show: TabHarness) -> None:
    """Another one is as soon as it is larger."""
    for number in range(MIN_DRAWN):
        report_generation(show, number)
    assert len(names(show.draw(1.0), "measures")) == 3
    show.telemetry.join(2, 3, 4, colony="red")
    show.telemetry.events(2, born(agent(2, 0)), colony="red")
    streams = show.draw(1.0)
    assert streams.shown("/evolution/measures/lines", "strips") == []
    (message,) = streams.shown("/evolution/measures/message", "labels")
    assert message.startswith("The first generation has not ended yet")
