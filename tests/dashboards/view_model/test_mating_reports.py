"""Two robots report a mating, and it has one line."""

import pytest
from crcolony_dashboards.view_model.mating_reports import MatingReports

from crcolony.protocol.telemetry_messages import EventMessage, Exchanged
from tests.support.fake_telemetry import IDS, T, mated


def name_of(robot: bytes) -> str:
    return f"#{IDS.index(robot)}"


def add(reports: MatingReports, robot: int, event: Exchanged, at_s: float = T) -> str | None:
    message = EventMessage(IDS[robot], 3, 1, 7, event)
    line = reports.add(message, event, at_s, name_of)
    return line.text if line is not None else None


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize(
    ("conceived", "words"),
    [
        ((True, True), "both conceived"),
        ((True, False), "#0 conceived"),
        ((False, True), "#1 conceived"),
        ((False, False), "no offspring"),
    ],
)
def test_the_second_report_gives_the_line(
    order: tuple[int, int], conceived: tuple[bool, bool], words: str
) -> None:
    """Whichever robot reports first."""
    reports = MatingReports()
    first, second = order
    assert add(reports, first, mated(0, 1, conceived=conceived[first])) is None
    line = add(reports, second, mated(0, 1, conceived=conceived[second]))
    assert line == f"#0 and #1 mated; {words}"
    assert reports.pop_overdue(T + 100.0, name_of) == []


def test_a_repeated_report_is_no_second_robot() -> None:
    """It changes nothing."""
    reports = MatingReports()
    assert add(reports, 0, mated(0, 1)) is None
    assert add(reports, 0, mated(0, 1)) is None
    assert add(reports, 1, mated(0, 1)) == "#0 and #1 mated; no offspring"


def test_a_mating_of_which_one_robot_is_silent_is_written_all_the_same() -> None:
    """After a while, and not again when the other robot reports at last."""
    reports = MatingReports()
    add(reports, 1, mated(0, 1, too_late=True))
    assert reports.pop_overdue(T + 2.0, name_of) == []
    (line,) = reports.pop_overdue(T + 4.0, name_of)
    assert line.text == "#0 and #1 mated; too late for offspring (#0 has not reported)"
    assert line.tick == 70
    assert add(reports, 0, mated(0, 1), T + 5.0) is None
    assert reports.pop_overdue(T + 100.0, name_of) == []


def test_reports_that_wait_are_limited() -> None:
    """A flood of one-sided reports is written at once."""
    reports = MatingReports()
    for count in range(5_000):
        add(reports, 0, mated(0, 1, count))
    assert len(reports.pop_overdue(T, name_of)) == 1_000
