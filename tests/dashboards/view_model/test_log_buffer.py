"""The number of log lines is limited."""

import pytest

from crcolony.protocol.telemetry_messages import Fault
from tests.support.fake_telemetry import IDS, FakeTelemetry


@pytest.fixture
def sample() -> FakeTelemetry:
    return FakeTelemetry()


def texts(sample: FakeTelemetry) -> list[str]:
    return [line.text for line in sample.view.pop_log_lines()]


class TestLog:
    """What was said, in moderation."""

    def test_lines_of_one_kind_are_thinned(self, sample: FakeTelemetry) -> None:
        """The first are there, the others are counted; other kinds are not touched by it."""
        for number in range(20):
            sample.tell(0, Fault(7, f"fault {number}"))
        sample.come(1)
        lines = texts(sample)
        assert lines[:8] == [f"{IDS[0].hex()[:8]}: fault {number}" for number in range(8)]
        assert lines[8:] == [f"{IDS[1].hex()[:8]} is online", "… and 12 more (fault)"]

    def test_every_time_begins_anew(self, sample: FakeTelemetry) -> None:
        """Nothing is said twice."""
        for _ in range(2):
            sample.tell(0, *(Fault(7, str(number)) for number in range(9)))
            assert len(texts(sample)) == 9
        assert texts(sample) == []
