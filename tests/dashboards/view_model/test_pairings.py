"""Meetings and matings are kept once though both robots report them, and not for long."""

import pytest
from crcolony_dashboards.view_model import pairings as pairings_module
from crcolony_dashboards.view_model.pairings import MATING_S, MEETING_S, Pairing
from hypothesis import given
from hypothesis import strategies as st

from tests.support.fake_telemetry import IDS, FakeTelemetry, T, agent, lived, mated, met


@pytest.fixture
def telemetry() -> FakeTelemetry:
    return FakeTelemetry()


def pairings(telemetry: FakeTelemetry) -> list[Pairing]:
    return list(telemetry.view.pairings)


class TestPairings:
    """Two robots that met or mated are one pairing."""

    def test_a_mating_is_one_pairing_though_both_report_it(self, telemetry: FakeTelemetry) -> None:
        """With the number of robots that conceived, and the time of the first report."""
        telemetry.events(0, mated(0, 1, conceived=True))
        telemetry.at_s += 0.4
        telemetry.events(1, mated(0, 1, conceived=True))
        assert pairings(telemetry) == [Pairing((IDS[0], IDS[1]), T, mated=True, conceived=2)]

    def test_every_encounter_is_one_pairing(self, telemetry: FakeTelemetry) -> None:
        """Also of the same two robots; a meeting is separate from the mating."""
        telemetry.events(0, met(1), mated(0, 1, 1), mated(0, 1, 2), mated(0, 2, 3))
        telemetry.events(1, met(0), mated(0, 1, 2), mated(0, 1, 1))
        reports = [(p.robots, p.mated) for p in pairings(telemetry)]
        assert sorted(reports[0][0]) == sorted(IDS[:2])
        assert not reports[0][1]
        assert reports[1:] == [((IDS[0], IDS[k]), True) for k in (1, 1, 2)]

    def test_a_meeting_lasts_a_moment(self, telemetry: FakeTelemetry) -> None:
        """Reports of both robots and repeated contacts within that time are one meeting; a later one is another."""
        for _ in range(5):
            telemetry.events(0, met(1))
            telemetry.events(1, met(0))
            telemetry.at_s += MEETING_S / 6
        assert len(pairings(telemetry)) == 1
        telemetry.at_s += MEETING_S
        telemetry.events(1, met(0))
        assert [p.unix_s for p in pairings(telemetry)] == [T, pytest.approx(telemetry.at_s)]

    def test_pairings_are_dropped(self, telemetry: FakeTelemetry) -> None:
        """After they were drawn long enough; a late report of the partner does not bring one back."""
        telemetry.events(0, mated(0, 1), met(2))
        telemetry.advance_s(MATING_S)
        assert len(pairings(telemetry)) == 2
        telemetry.advance_s(0.1)
        assert pairings(telemetry) == []
        telemetry.events(1, mated(0, 1, conceived=True))
        assert pairings(telemetry) == []

    def test_events_of_long_ago_are_not_drawn(self, telemetry: FakeTelemetry) -> None:
        """They count all the same, whatever the robots' clocks say."""
        for count, clock_s in enumerate((-1e6, 0.0, 1e6), 2):
            telemetry.join(0, unix_ms=round(1000.0 * (telemetry.at_s + clock_s)))
            told_s = telemetry.at_s + clock_s
            telemetry.events(
                0, mated(0, 1, agent=agent(0, 0), conceived=True), told_s=told_s - 60.0
            )
            assert pairings(telemetry) == []
            telemetry.events(0, mated(0, 1, count), met(1), told_s=told_s - 1.0)
            assert len(pairings(telemetry)) == 2
            telemetry.advance_s(60.0)
        telemetry.events(0, lived(agent(0, 0)))
        telemetry.offline(0)
        telemetry.advance_s(60.0)
        telemetry.view.update_generations(telemetry.at_s)
        (generation,) = telemetry.view.colonies["blue"].history.rows
        assert generation.conceptions.mean == 3.0

    def test_they_are_dropped_when_the_clock_is_set_back_too(
        self, telemetry: FakeTelemetry
    ) -> None:
        """And the next meeting is drawn."""
        telemetry.events(0, mated(0, 1), met(1))
        telemetry.advance_s(-3600.0)
        assert pairings(telemetry) == []
        telemetry.events(0, met(1))
        assert [p.unix_s for p in pairings(telemetry)] == [telemetry.at_s]

    def test_memory_is_bounded(
        self, telemetry: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """However many there are."""
        monkeypatch.setattr(pairings_module, "_MAX_PAIRINGS", 20)
        telemetry = FakeTelemetry()
        for count in range(500):
            telemetry.events(0, mated(0, 1, count))
            telemetry.advance_s(0.5)
            assert len(telemetry.view.pairings) <= 20
            assert len(telemetry.view._pairings._by_key) <= 50

    @given(st.lists(st.tuples(st.integers(0, 9), st.booleans()), max_size=40))
    def test_order_and_number_of_reports_do_not_matter(
        self, reports: list[tuple[int, bool]]
    ) -> None:
        """There is one pairing for every reported encounter."""
        telemetry = FakeTelemetry()
        for count, is_initiators in reports:
            telemetry.events(0 if is_initiators else 1, mated(0, 1, count))
        assert len(pairings(telemetry)) == len({count for count, _ in reports})
