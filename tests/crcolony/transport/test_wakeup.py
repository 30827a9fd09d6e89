"""A loop sleeps until it is rung, on every system, and on Linux also until a file is ready."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable

import pytest

from crcolony.transport.wakeup import LinuxWakeup, QueueWakeup

linux = pytest.mark.skipif(sys.platform != "linux", reason="there is no epoll here")
KINDS = [pytest.param(LinuxWakeup, marks=linux), QueueWakeup]
Wakeup = LinuxWakeup | QueueWakeup
LONG_S = 30.0
"""Nobody waits so long, or a ring was lost"""


def waits(wakeup: Wakeup, timeout_s: float = LONG_S) -> float:
    """Return how long it waits (s)."""
    started_s = time.monotonic()
    wakeup.wait(timeout_s)
    return time.monotonic() - started_s


@pytest.mark.parametrize("kind", KINDS)
def test_a_ring_before_the_wait_ends_it(kind: Callable[[], Wakeup]) -> None:
    """Once, however often it was rung."""
    wakeup = kind()
    for _ in range(3):
        wakeup.ring()
    assert waits(wakeup) < LONG_S / 2
    assert waits(wakeup, 0.02) >= 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_a_ring_during_the_wait_ends_it(kind: Callable[[], Wakeup]) -> None:
    """From another thread."""
    wakeup = kind()
    ringing = threading.Timer(0.05, wakeup.ring)
    ringing.start()
    assert waits(wakeup) < LONG_S / 2
    ringing.join()


@pytest.mark.parametrize("kind", KINDS)
def test_a_ring_in_a_signal_handler_ends_the_wait(kind: Callable[[], Wakeup]) -> None:
    """As when a process is told to stop while it sleeps."""
    wakeup = kind()
    before = signal.signal(signal.SIGUSR1, lambda *_: wakeup.ring())
    main = threading.get_ident()
    sending = threading.Timer(0.05, lambda: signal.pthread_kill(main, signal.SIGUSR1))
    try:
        sending.start()
        assert waits(wakeup) < LONG_S / 2
        sending.join()
    finally:
        signal.signal(signal.SIGUSR1, before)


@pytest.mark.parametrize("kind", KINDS)
def test_without_a_ring_the_wait_ends_in_time(kind: Callable[[], Wakeup]) -> None:
    """Or at once."""
    wakeup = kind()
    assert wakeup.wait(0.0) == []
    assert 0.01 <= waits(wakeup, 0.02) < LONG_S / 2


@linux
def test_a_file_that_is_ready_is_named() -> None:
    """Again and again as long as it has something to read; a bell once for each time it is rung."""
    wakeup = LinuxWakeup()
    out, into = os.pipe()
    bell = os.eventfd(0, os.EFD_NONBLOCK)
    wakeup.watch(out, is_bell=False)
    wakeup.watch(bell, is_bell=True)
    assert wakeup.wait(0.0)[1:] == [], "but its own bell, nothing"
    os.write(into, b"x")
    os.eventfd_write(bell, 1)
    assert set(wakeup.wait(LONG_S)) == {out, bell}
    assert wakeup.wait(LONG_S) == [out]
    os.eventfd_write(bell, 1)
    assert set(wakeup.wait(LONG_S)) == {out, bell}
    wakeup.forget(out)
    assert wakeup.wait(0.0) == []
    for descriptor in (out, into, bell):
        os.close(descriptor)


@linux
def test_many_files_are_all_named() -> None:
    """More than one wait returns: the others follow, none is left out."""
    wakeup = LinuxWakeup()
    bells = [os.eventfd(1, os.EFD_NONBLOCK) for _ in range(200)]
    for bell in bells:
        wakeup.watch(bell, is_bell=True)
    named: list[int] = []
    while ready := wakeup.wait(0.0):
        named += ready
    assert sorted(set(named) & set(bells)) == bells
    assert len(named) <= len(bells) + 1
    for bell in bells:
        os.close(bell)


@linux
def test_nothing_is_left_open() -> None:
    """A process may make many."""
    LinuxWakeup()
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        LinuxWakeup().ring()
    assert len(os.listdir("/proc/self/fd")) == before


def test_without_epoll_files_are_refused() -> None:
    """So that no link on one machine is opened there."""
    wakeup = QueueWakeup()
    with pytest.raises(OSError, match="epoll"):
        wakeup.watch(0, is_bell=True)
    with pytest.raises(OSError, match="epoll"):
        wakeup.forget(0)
