"""What a starting process does is published twice a second, while the main thread is busy, and printed."""

import time

from crcolony.protocol.telemetry_messages import Activity, decode_activity
from crcolony.runtime.startup_report import Progress, StartupReport
from tests.support.process import wait_until


def test_it_is_published_while_the_main_thread_compiles() -> None:
    """With what is done so far."""
    published, lines = list[bytes](), list[str]()
    with StartupReport(published.append, lines.append) as report:
        report.counting("compiling")(3, 12)
        wait_until(lambda: len(published) >= 2, "it is published again")
        report.follow(lambda: Progress("waiting"))
        wait_until(lambda: len(lines) == 2, "the other activity is printed")
    first, last = decode_activity(published[0]), decode_activity(published[-1])
    assert (first.doing, first.done, first.total) == ("compiling", 3, 12)
    assert abs(first.unix_ms / 1000.0 - time.time()) < 60.0
    assert last == Activity(last.unix_ms, "waiting", 0, 0)
    assert lines == ["compiling, 25 %", "waiting"]


def test_a_process_that_starts_at_once_says_nothing() -> None:
    """Nothing is to be waited for."""
    published, lines = list[bytes](), list[str]()
    with StartupReport(published.append, lines.append):
        pass
    assert not published
    assert not lines
