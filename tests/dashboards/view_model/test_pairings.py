"""Two robots meet, or mate: it is drawn once though both report it, and not for long."""

import pytest
from crcolony_dashboards.view_model import pairings as pairings_module
from crcolony_dashboards.view_model.pairings import MATING_S, MEETING_S, Pairing
from hypothesis import given
from hypothesis import strategies as st

from tests.support.fake_telemetry import IDS, FakeTelemetry, T, agent, lived, mated, met


@pytest.fixture
def sample() -> FakeTelemetry:
    return FakeTelemetry()


def pairings(sample: FakeTelemetry) -> list[Pairing]:
    return list(sample.view.pairings)


class TestPairings:
    """Two robots meet, or mate: it is one thing, though both tell it."""

    def test_a_mating_is_one_pairing_though_both_tell_it(self, sample: FakeTelemetry) -> None:
        """With how many of the two have conceived, and when it was heard of first."""
        sample.tell(0, mated(0, 1, conceived=True))
        sample.at_s += 0.4
        sample.tell(1, mated(0, 1, conceived=True))
        assert pairings(sample) == [Pairing((IDS[0], IDS[1]), T, mated=True, conceived=2)]

    def test_every_encounter_is_a_pairing_of_its_own(self, sample: FakeTelemetry) -> None:
        """Of the same two robots too; and a meeting is another thing than the mating."""
        sample.tell(0, met(1), mated(0, 1, 1), mated(0, 1, 2), mated(0, 2, 3))
        sample.tell(1, met(0), mated(0, 1, 2), mated(0, 1, 1))
        message = [(p.robots, p.mated) for p in pairings(sample)]
        assert sorted(message[0][0]) == sorted(IDS[:2])
        assert not message[0][1]
        assert message[1:] == [((IDS[0], IDS[k]), True) for k in (1, 1, 2)]

    def test_a_meeting_lasts_a_moment(self, sample: FakeTelemetry) -> None:
        """Whoever meets again after it meets anew; both of its sides, and contact after contact, are one."""
        for _ in range(5):
            sample.tell(0, met(1))
            sample.tell(1, met(0))
            sample.at_s += MEETING_S / 6
        assert len(pairings(sample)) == 1
        sample.at_s += MEETING_S
        sample.tell(1, met(0))
        assert [p.unix_s for p in pairings(sample)] == [T, pytest.approx(sample.at_s)]

    def test_pairings_are_forgotten(self, sample: FakeTelemetry) -> None:
        """After they were shown long enough; a partner that tells of it late does not bring one back."""
        sample.tell(0, mated(0, 1), met(2))
        sample.pass_s(MATING_S)
        assert len(pairings(sample)) == 2
        sample.pass_s(0.1)
        assert pairings(sample) == []
        sample.tell(1, mated(0, 1, conceived=True))
        assert pairings(sample) == []

    def test_what_happened_long_ago_is_not_shown(self, sample: FakeTelemetry) -> None:
        """Whoever comes late hears of it all the same; robots' clocks need not be right for that."""
        for count, clock_s in enumerate((-1e6, 0.0, 1e6), 2):
            sample.join(0, unix_ms=round(1000.0 * (sample.at_s + clock_s)))
            told_s = sample.at_s + clock_s
            sample.tell(0, mated(0, 1, agent=agent(0, 0), conceived=True), told_s=told_s - 60.0)
            assert pairings(sample) == []
            sample.tell(0, mated(0, 1, count), met(1), told_s=told_s - 1.0)
            assert len(pairings(sample)) == 2
            sample.pass_s(60.0)
        sample.tell(0, lived(agent(0, 0)))
        sample.go(0)
        sample.pass_s(60.0)
        ((_, generation),) = sample.view.pop_ended_generations(sample.at_s)
        assert generation.conceptions.mean == 3.0

    def test_they_are_forgotten_when_the_clock_is_set_back_too(self, sample: FakeTelemetry) -> None:
        """And the next meeting is shown."""
        sample.tell(0, mated(0, 1), met(1))
        sample.pass_s(-3600.0)
        assert pairings(sample) == []
        sample.tell(0, met(1))
        assert [p.unix_s for p in pairings(sample)] == [sample.at_s]

    def test_many_take_a_limited_memory(
        self, sample: FakeTelemetry, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """However many there are, and however long it goes on."""
        monkeypatch.setattr(pairings_module, "_MAX_PAIRINGS", 20)
        sample = FakeTelemetry()
        for count in range(500):
            sample.tell(0, mated(0, 1, count))
            sample.pass_s(0.5)
            assert len(sample.view.pairings) <= 20
            assert len(sample.view._pairings._by_key) <= 50

    @given(st.lists(st.tuples(st.integers(0, 9), st.booleans()), max_size=40))
    def test_whoever_tells_first_and_how_often(self, message: list[tuple[int, bool]]) -> None:
        """There is one pairing for every encounter that anybody told of."""
        sample = FakeTelemetry()
        for count, is_initiators in message:
            sample.tell(0 if is_initiators else 1, mated(0, 1, count))
        assert len(pairings(sample)) == len({count for count, _ in message})
