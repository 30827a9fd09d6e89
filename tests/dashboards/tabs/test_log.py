"""The log says what has happened: each thing once, the bad in other colours, and not too much at a time."""

import pytest
from crcolony_dashboards.tabs.log import LogTab

from crcolony.evolution.history import Died
from crcolony.protocol.telemetry_messages import Fault
from tests.support.drawn import RecordingStreams, TabHarness
from tests.support.fake_telemetry import agent, mated


@pytest.fixture
def show() -> TabHarness:
    show = TabHarness(LogTab())
    show.sample.join(0, 1)
    show.draw(1.0)
    return show


def written(streams: RecordingStreams) -> list[tuple[str, str, str]]:
    return [
        (d.path, *d.parts["text"].to_pylist(), *d.parts["level"].to_pylist())
        for d in streams.drawings
    ]


def test_the_log_says_what_happened(show: TabHarness) -> None:
    """In order, every kind in a place of its own, with how serious it is."""
    show.sample.tell(0, mated(0, 1, conceived=True), Died(7, 0, agent(0, 3)))
    show.sample.tell(1, Fault(7, "no arena"))
    show.sample.go(0)
    assert written(show.draw(1.0)) == [
        ("/log/mating", "#0 mated with #1 and conceived", "INFO"),
        ("/log/death", "#0: agent 3 starved", "INFO"),
        ("/log/fault", "#1: no arena", "ERROR"),
        ("/log/presence", "#0 is offline", "WARN"),
    ]


def test_nothing_is_said_twice(show: TabHarness) -> None:
    """And without news nothing."""
    show.sample.tell(1, Fault(7, "no arena"))
    assert len(written(show.draw(1.0))) == 1
    assert written(show.draw(1.0)) == []


def test_it_is_written_once_a_second(show: TabHarness) -> None:
    """With what has gathered; what is too much is counted."""
    for number in range(9):
        show.sample.tell(1, Fault(7, str(number)))
        assert written(show.draw(0.05)) == []
    lines = written(show.draw(0.5))
    assert [text for _, text, _ in lines] == [
        *(f"#1: {number}" for number in range(8)),
        "… and 1 more (fault)",
    ]
    assert {path for path, _, _ in lines} == {"/log/fault"}
