"""Who waits for a generation is told for how long."""

import msgspec
import pytest
from crcolony_dashboards.view_model.expected_end import (
    ExpectedEnd,
    expected_end,
    format_wait,
    format_waiting,
)
from crcolony_dashboards.view_model.generation_history import GenerationHistory

from crcolony.protocol.telemetry_messages import RobotState
from crcolony.robot.settings import Life
from tests.dashboards.view_model.test_generation_history import row
from tests.support.fake_telemetry import IDS
from tests.vectors.make import TELEMETRY

LIFE = Life(agents=2, slices=5, slice_steps=100)


def state(robot: int, tick: int, generation: int = 0, period_ms: float = 100.0) -> RobotState:
    made = TELEMETRY["state"]
    assert isinstance(made, RobotState)
    return msgspec.structs.replace(
        made, robot=IDS[robot], tick=tick, generation=generation, period_ms=period_ms
    )


def test_a_generation_ends_with_its_slowest_robot() -> None:
    """Robots of a later generation do not count."""
    starts = {IDS[0]: (0, 0), IDS[1]: (0, 300), IDS[2]: (1, 0)}
    states = [state(0, 700), state(1, 700), state(2, 700, generation=1)]
    assert expected_end(states, starts, LIFE) == ExpectedEnd(60.0, 100.0)


def test_a_late_robot_may_end_at_any_moment() -> None:
    """Its remaining time is not negative."""
    end = expected_end([state(0, 5_000)], {IDS[0]: (0, 0)}, LIFE)
    assert end == ExpectedEnd(0.0, 100.0)


def test_the_end_is_unknown_without_settings_begins_or_periods() -> None:
    """Nothing is guessed."""
    starts = {IDS[0]: (0, 0)}
    assert expected_end([state(0, 700)], starts, None) is None
    assert expected_end([], starts, LIFE) is None
    assert expected_end([state(1, 700)], starts, LIFE) is None
    assert expected_end([state(0, 700, generation=1)], starts, LIFE) is None
    assert expected_end([state(0, 700, period_ms=0.0)], starts, LIFE) is None


@pytest.mark.parametrize(
    ("ended", "end", "text"),
    [
        (
            0,
            ExpectedEnd(40.0, 100.0),
            "The first generation ends in about 40 s;\na figure needs 5.",
        ),
        (0, None, "The first generation has not ended yet;\na figure needs 5."),
        (1, ExpectedEnd(40.0, 100.0), "1 generation has ended;\na figure needs 5: in about 6 min."),
        (
            4,
            ExpectedEnd(40.0, 100.0),
            "4 generations have ended;\na figure needs 5: in about 40 s.",
        ),
        (3, None, "3 generations have ended;\na figure needs 5."),
    ],
)
def test_the_text_says_when_a_figure_is_due(ended: int, end: ExpectedEnd | None, text: str) -> None:
    """Or how many generations there are, if that is unknown."""
    history = GenerationHistory()
    for number in range(ended):
        history.add(row(number))
    assert format_waiting(history, end) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "1 s"), (89.0, "89 s"), (90.0, "2 min"), (5_000.0, "83 min"), (7_000.0, "2 h")],
)
def test_a_wait_is_in_the_unit_of_its_size(seconds: float, text: str) -> None:
    """Seconds, minutes, hours."""
    assert format_wait(seconds) == text
