"""In real time there is a step at every period, however many events arrive, and missed steps are skipped."""

import pytest

from crcolony.runtime import real_time_loop
from crcolony.runtime.real_time_loop import run_in_real_time
from crcolony.transport.inbox import Inbox
from crcolony.transport.interface import ArenaOnline, InboundEvent


class FakeClock:
    """A clock that is advanced by a test, and by waiting."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def monotonic(self) -> float:
        return self.now_s


class FakeInbox(Inbox):
    """An inbox that waits on a fake clock. Each event takes 0.03 s to arrive."""

    def __init__(self, clock: FakeClock, events: int) -> None:
        super().__init__()
        self._clock, self._events = clock, events

    def get(self, timeout_s: float) -> InboundEvent | None:
        if self._events > 0 and timeout_s > 0.03:
            self._events -= 1
            self._clock.now_s += 0.03
            return ArenaOnline(self._events)
        self._clock.now_s += timeout_s
        return None


class RecordingProcess:
    """A process that records when it is called; one of its steps may be slow."""

    def __init__(self, clock: FakeClock, slow_step: int = -1) -> None:
        self._clock, self._slow_step = clock, slow_step
        self.steps: list[float] = []
        self.events = self.timers = 0

    def handle_event(self, event: InboundEvent) -> None:
        self.events += 1

    def handle_timers(self, now_s: float) -> None:
        self.timers += 1

    def step(self) -> None:
        if len(self.steps) == self._slow_step:
            self._clock.now_s += 0.35
        self.steps.append(self._clock.now_s)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    """The clock of the loop."""
    fake = FakeClock()
    monkeypatch.setattr(real_time_loop, "time", fake)
    return fake


def test_there_is_a_step_at_every_period(clock: FakeClock) -> None:
    """All events are handled in between."""
    process = RecordingProcess(clock)
    run_in_real_time(process, FakeInbox(clock, 5), 0.1, lambda: len(process.steps) >= 4)
    assert process.steps == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert (process.events, process.timers) == (5, 4)


def test_steps_that_were_missed_are_skipped(clock: FakeClock) -> None:
    """After a step of 0.35 s two follow at once, and then every period one."""
    process = RecordingProcess(clock, slow_step=1)
    run_in_real_time(process, FakeInbox(clock, 0), 0.1, lambda: len(process.steps) >= 6)
    assert process.steps[:2] == pytest.approx([0.1, 0.55])
    gaps_s = [
        later - earlier
        for earlier, later in zip(process.steps[2:], process.steps[3:], strict=False)
    ]
    assert gaps_s == pytest.approx([0.1, 0.1, 0.1])


def test_a_stopped_process_makes_no_step(clock: FakeClock) -> None:
    """Nor does it wait."""
    process = RecordingProcess(clock)
    run_in_real_time(process, FakeInbox(clock, 0), 0.1, lambda: True)
    assert not process.steps
    assert clock.now_s == 0.0
