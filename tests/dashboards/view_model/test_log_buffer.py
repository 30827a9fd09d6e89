"""The number of log lines is limited."""

import pytest

from crcolony.protocol.telemetry_messages import Fault
from tests.support.fake_telemetry import IDS, FakeTelemetry


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


def texts(telemetry: FakeTelemetry) -> list[str]:
    return [line.text for line in telemetry.view.pop_log_lines()]


class TestLogBuffer:
    """Up to a limit per kind, lines are kept in order."""

    def test_lines_above_the_limit_are_counted(self, telemetry: FakeTelemetry) -> None:
        """Other kinds are not affected."""
        for number in range(20):
            telemetry.events(0, Fault(7, f"fault {number}"))
        telemetry.online(1)
        lines = texts(telemetry)
        assert lines[:8] == [f"{IDS[0].hex()[:8]}: fault {number}" for number in range(8)]
        assert lines[8:] == [f"{IDS[1].hex()[:8]} is online", "… and 12 more (fault)"]

    def test_every_call_starts_from_zero(self, telemetry: FakeTelemetry) -> None:
        """No line is returned twice."""
        for _ in range(2):
            telemetry.events(0, *(Fault(7, str(number)) for number in range(9)))
            assert len(texts(telemetry)) == 9
        assert texts(telemetry) == []
