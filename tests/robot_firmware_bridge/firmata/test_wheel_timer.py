"""The time to live is kept by a thread that nobody has to help."""

import subprocess
import sys
import threading
import time

import pytest
from crcolony_bridge.firmata.wheel_timer import WheelTimer

from tests.support.command_line import ENVIRONMENT


class Stops:
    """A timer, and when it has stopped the wheels."""

    def __init__(self) -> None:
        self.mutex = threading.RLock()
        self.times_s: list[float] = []
        self.stopped = threading.Event()
        self.timer = WheelTimer(self.mutex, self._stop)

    def _stop(self) -> None:
        self.times_s.append(time.monotonic())
        self.stopped.set()


def test_wheels_stop_when_the_time_is_over() -> None:
    """Once, and no thread is left over."""
    stops, threads = Stops(), threading.active_count()
    started_s = time.monotonic()
    stops.timer.start(0.05)
    assert stops.timer.is_running
    assert stops.stopped.wait(5.0)
    assert stops.times_s[0] - started_s >= 0.05
    deadline_s = time.monotonic() + 5.0
    while threading.active_count() > threads:
        assert time.monotonic() < deadline_s
        time.sleep(0.001)
    assert not stops.timer.is_running
    assert len(stops.times_s) == 1


@pytest.mark.parametrize(("first_s", "second_s"), [(60.0, 0.05), (0.05, 0.2)])
def test_a_fresh_command_has_a_time_of_its_own(first_s: float, second_s: float) -> None:
    """Shorter or longer than what was left of the last one."""
    stops = Stops()
    stops.timer.start(first_s)
    started_s = time.monotonic()
    stops.timer.start(second_s)
    assert stops.stopped.wait(5.0)
    assert stops.times_s[0] - started_s >= second_s


def test_an_end_stops_at_once() -> None:
    """And the timer can be used again."""
    stops = Stops()
    stops.timer.start(60.0)
    stops.timer.end()
    assert stops.stopped.wait(5.0)
    stops.stopped.clear()
    stops.timer.start(0.01)
    assert stops.stopped.wait(5.0)


def test_no_stop_overtakes_a_fresh_command() -> None:
    """Who holds the mutex when the time is over, and commands afresh, is not stopped."""
    stops = Stops()
    with stops.mutex:
        stops.timer.start(0.01)
        time.sleep(0.05)
        stops.timer.start(0.3)
    assert not stops.stopped.wait(0.1)
    assert stops.stopped.wait(5.0)


def test_the_interpreter_does_not_end_before_the_wheels_stand() -> None:
    """A program that ends while they turn, by an error too, stops them first."""
    program = (
        "import threading; from crcolony_bridge.firmata.wheel_timer import WheelTimer;"
        "WheelTimer(threading.RLock(), lambda: print('stopped')).start(0.2); 1 / 0"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=ENVIRONMENT
    )
    assert ended.stdout == "stopped\n"
    assert "ZeroDivisionError" in ended.stderr
