"""Beside the arena stands what is now, what happened last, and what has evolved."""

import json

import pytest
from crcolony_dashboards.tabs.colony import ColonyTab
from crcolony_dashboards.tabs.colony_story import EVENTS, EVOLVED, STATUS
from crcolony_dashboards.view_model.generation_history import MIN_DRAWN

from crcolony.robot.settings import Life
from tests.support.drawn import TabHarness
from tests.support.fake_telemetry import SETTINGS, born, mated
from tests.support.reported_generations import report_generation


@pytest.fixture
def show() -> TabHarness:
    """Two robots in an arena."""
    show = TabHarness(ColonyTab())
    show.telemetry.join(0, 1, generation=0)
    show.telemetry.robot_metadata(0, 1)
    show.telemetry.scene((0, -0.5, 0.0), (1, 0.5, 0.0))
    return show


def test_the_present_state_is_drawn_at_most_once_a_second(show: TabHarness) -> None:
    """When it has changed."""
    drawn = 0
    for k in range(40):
        show.telemetry.state(0, matings=k)
        drawn += show.draw(0.1).times(STATUS)
    assert drawn == pytest.approx(4, abs=1)
    assert "2 robots online" in show.streams.text(STATUS)


def test_a_mating_stands_once_among_the_last_events(show: TabHarness) -> None:
    """Though two robots report it."""
    show.telemetry.events(0, mated(0, 1, conceived=True))
    show.telemetry.events(1, mated(0, 1))
    text = show.draw(1.0).text(EVENTS)
    assert text.count("mated") == 1
    assert r"\#0 and \#1 mated; \#0 conceived" in text


def test_what_is_waited_for_is_said_with_its_time(show: TabHarness) -> None:
    """By the robots' lifetimes, in the charts and in place of the comparison."""
    settings = json.loads(SETTINGS)
    settings["life"] = {"agents": 2, "slices": 2, "slice_steps": 100}
    assert Life(agents=2, slices=2, slice_steps=100).slice_steps == 100
    show.telemetry.robot_metadata(0, 1, settings=json.dumps(settings))
    for robot in (0, 1):
        show.telemetry.events(robot, born(f"x/{robot}", 0))
        show.telemetry.state(robot, generation=0, tick=200, period_ms=200.0)
    show.telemetry.advance_s(0.5)
    streams = show.draw(1.0)
    expected = f"The first generation ends in about 40 s;\na figure needs {MIN_DRAWN}."
    assert streams.shown("/colony/matings/message", "labels") == [expected]
    assert streams.shown("/colony/energy/message", "labels") == [expected]
    assert streams.text(EVOLVED) == expected


def test_matings_energy_and_the_evolved_are_drawn_by_generation(show: TabHarness) -> None:
    """With the mean and the middle 80 % of agents; the founders beside the last generation."""
    for number in range(MIN_DRAWN):
        report_generation(show, number)
    streams = show.draw(1.0)
    assert streams.shown("/colony/matings/names", "labels") == ["matings 1.5"]
    assert len(streams.shown("/colony/matings/lines", "strips")) == 3
    assert streams.shown("/colony/energy/names", "labels") == ["energy 0.5"]
    text = streams.text(EVOLVED)
    assert "| | founders (generation 0) | evolved (generation 4) |" in text
    assert "| matings of an agent | 1.50 | 1.50 |" in text


def test_every_colony_has_a_line_with_its_name(show: TabHarness) -> None:
    """If there are several."""
    for number in range(MIN_DRAWN):
        report_generation(show, number)
    show.draw(1.0)
    show.telemetry.join(2, colony="red")
    assert show.draw(1.0).shown("/colony/matings/names", "labels") == ["blue 1.5"]
