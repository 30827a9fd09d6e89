"""A process shuts down on a signal or after a given time."""

import contextlib
import ctypes
import os
import random
import signal
import threading
import time
from collections.abc import Callable

import pytest

from crcolony.shutdown import ShutdownSignal, interrupted_once


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_requests_a_shutdown_and_wakes_the_process(number: signal.Signals) -> None:
    """At once; those that follow interrupt nothing, and make it urgent."""
    wakes: list[int] = []
    before = signal.getsignal(number)
    with ShutdownSignal(wake=lambda: wakes.append(1)) as is_stopped:
        assert not is_stopped()
        os.kill(os.getpid(), number)
        assert is_stopped()
        assert not is_stopped.is_urgent
        assert wakes == [1]
        os.kill(os.getpid(), number)
        assert is_stopped.is_urgent
    assert signal.getsignal(number) == before


def test_hangup_that_was_ignored_stays_ignored() -> None:
    """As under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ShutdownSignal() as is_stopped:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not is_stopped()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_what_may_be_left_undone_ends_at_a_signal() -> None:
    """What follows is not interrupted."""
    done = []
    with ShutdownSignal() as is_stopped:
        with is_stopped.interruptible():
            done.append("begun")
            os.kill(os.getpid(), signal.SIGINT)
            done.append("ended")
        os.kill(os.getpid(), signal.SIGINT)
        assert done == ["begun"]
        assert is_stopped()


def compile_with_callbacks(call: Callable[[], None]) -> None:
    """Do as a compiler does: an exception in its callback is lost, and then it fails."""
    ctypes.CFUNCTYPE(None)(call)()
    raise RuntimeError("nothing was compiled")


def test_an_interrupt_that_is_lost_on_its_way_is_no_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As in a compiler; without a signal its error is raised."""
    with ShutdownSignal() as is_stopped:
        with is_stopped.interruptible():
            compile_with_callbacks(lambda: os.kill(os.getpid(), signal.SIGTERM))
        assert is_stopped()
        assert capsys.readouterr().err == ""
        with pytest.raises(RuntimeError), is_stopped.interruptible():
            compile_with_callbacks(lambda: None)


def test_an_interrupt_that_is_lost_is_repeated() -> None:
    """A compiler that goes on after a lost interrupt is interrupted all the same."""
    with ShutdownSignal() as is_stopped:
        with is_stopped.interruptible():
            for _ in range(2):
                with contextlib.suppress(KeyboardInterrupt):
                    os.kill(os.getpid(), signal.SIGTERM)
            threading.Event().wait(60.0)
            pytest.fail("it was not interrupted again")
        assert is_stopped()


def test_a_signal_interrupts_only_what_may_be_left_undone_whenever_it_comes() -> None:
    """Also while such a context opens or closes."""
    signals, generator = 300, random.Random(1)
    with ShutdownSignal() as is_stopped:

        def send() -> None:
            for _ in range(signals):
                time.sleep(generator.uniform(0.0, 0.002))
                os.kill(os.getpid(), signal.SIGTERM)

        sender = threading.Thread(target=send)
        sender.start()
        while sender.is_alive():
            with is_stopped.interruptible():
                sum(range(100))
        sender.join()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_what_closes_itself_and_nothing_interrupts_that(
    number: signal.Signals,
) -> None:
    """However often it comes; afterwards signals have the effect again that they had."""
    before = signal.getsignal(number)
    steps: list[str] = []

    def work() -> None:
        try:
            os.kill(os.getpid(), number)
            steps.append("goes on")
        finally:
            os.kill(os.getpid(), number)
            steps.append("closed")

    with pytest.raises(KeyboardInterrupt), interrupted_once():
        work()
    assert steps == ["closed"]
    assert signal.getsignal(number) is before


def test_a_shutdown_follows_after_the_given_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a signal."""
    now_s = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    with ShutdownSignal(minutes=2.0) as is_stopped:
        now_s = 220.0
        assert not is_stopped()
        now_s = 220.1
        assert is_stopped()
