"""A process shuts down on a signal or after a given time."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from crcolony.shutdown import ShutdownSignal


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Restore the signal handlers of the test's process."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


def test_a_signal_requests_a_shutdown_and_wakes_the_process() -> None:
    """At once; a second Ctrl-C interrupts."""
    wakes: list[int] = []
    is_stopped = ShutdownSignal(wake=lambda: wakes.append(1))
    assert not is_stopped()
    os.kill(os.getpid(), signal.SIGINT)
    assert is_stopped()
    assert wakes == [1]
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_a_shutdown_follows_after_the_given_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a signal."""
    now_s = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    is_stopped = ShutdownSignal(minutes=2.0)
    now_s = 220.0
    assert not is_stopped()
    now_s = 220.1
    assert is_stopped()
