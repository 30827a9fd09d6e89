"""The log has one line for each event, with its severity, and a limited number of lines a second."""

import pytest
from crcolony_dashboards.tabs.log import LogTab

from crcolony.evolution.history import Died
from crcolony.protocol.telemetry_messages import Fault
from tests.support.drawn import RecordingStreams, TabHarness
from tests.support.fake_telemetry import agent, mated


@pytest.fixture
def show() -> TabHarness:
    show = TabHarness(LogTab())
    show.telemetry.join(0, 1)
    show.draw(1.0)
    return show


def written(streams: RecordingStreams) -> list[tuple[str, str, str]]:
    return [
        (d.path, *d.parts["text"].to_pylist(), *d.parts["level"].to_pylist())
        for d in streams.drawings
    ]


def test_events_are_logged_in_order(show: TabHarness) -> None:
    """Every line has a severity, and the colony's time if an arena says how long its ticks are."""
    show.telemetry.events(0, mated(0, 1, conceived=True), Died(7, 0, agent(0, 3)))
    show.telemetry.events(1, Fault(7, "no arena"))
    show.telemetry.events(1, mated(0, 1, tick=71))
    show.telemetry.offline(0)
    assert written(show.draw(1.0)) == [
        ("/log", "#0: agent 3 starved", "INFO"),
        ("/log", "#1: no arena", "ERROR"),
        ("/log", "#0 and #1 mated; #0 conceived", "INFO"),
        ("/log", "#0 is offline", "WARN"),
    ]
    show.telemetry.scene(period_s=0.5)
    show.telemetry.events(1, Fault(7, "no arena"))
    assert written(show.draw(1.0)) == [("/log", "0:00:03  #1: no arena", "ERROR")]


def test_no_line_is_written_twice(show: TabHarness) -> None:
    """And without events there are none."""
    show.telemetry.events(1, Fault(7, "no arena"))
    assert len(written(show.draw(1.0))) == 1
    assert written(show.draw(1.0)) == []


def test_lines_are_written_once_a_second(show: TabHarness) -> None:
    """Lines above the limit are counted."""
    for number in range(9):
        show.telemetry.events(1, Fault(7, str(number)))
        assert written(show.draw(0.05)) == []
    lines = written(show.draw(0.5))
    assert [text for _, text, _ in lines] == [
        *(f"#1: {number}" for number in range(8)),
        "… and 1 more (fault)",
    ]
    assert {path for path, _, _ in lines} == {"/log"}
