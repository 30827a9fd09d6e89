"""A process that dies is restarted, a few times; one that exits for good is not, and its last line says why."""

import sys
import time
from pathlib import Path

import pytest

from crcolony.runtime.supervisor import ChildProcess, dashboard_address, last_line


def child(folder: Path, code: str, name: str = "robot 1") -> ChildProcess:
    return ChildProcess(name, [sys.executable, "-c", code], folder / "log")


def exit_of(process: ChildProcess, now_s: float) -> str | None:
    """Wait until a process has exited, and return what the supervisor reports."""
    assert process.process is not None
    process.process.wait(30.0)
    return process.restart_if_dead(now_s)


def test_a_process_that_is_done_is_not_restarted(tmp_path: Path) -> None:
    """Exit code 0 is not reported."""
    process = child(tmp_path, "")
    process.start(0.0)
    assert exit_of(process, 1.0) is None
    assert (process.is_over, process.ended) == (True, "done")


def test_a_process_with_wrong_input_is_not_restarted(tmp_path: Path) -> None:
    """Exit code 2: the reason is the last line of its log."""
    process = child(tmp_path, "print('crcolony: x: no such file'); raise SystemExit(2)")
    process.start(0.0)
    assert exit_of(process, 1.0) == "robot 1 cannot run: x: no such file"
    assert process.is_over


def test_a_process_that_is_killed_is_restarted_after_a_delay(tmp_path: Path) -> None:
    """The signal and the restart are reported."""
    process = child(tmp_path, "import time; time.sleep(60)")
    process.start(0.0)
    assert process.restart_if_dead(0.1) is None
    assert process.process is not None
    process.process.kill()
    assert exit_of(process, 1.0) == "robot 1: killed by SIGKILL"
    assert not process.is_over
    assert process.restart_if_dead(1.4) is None
    assert process.restart_if_dead(1.5) == "robot 1 is restarted"
    assert process.restarts == 1
    process.terminate()
    process.wait(time.monotonic() + 10.0)
    assert exit_of(process, 2.0) == "robot 1: killed by SIGTERM"


@pytest.mark.parametrize(("period_s", "is_over"), [(1.0, True), (20.0, False)])
def test_a_process_that_dies_five_times_in_a_minute_is_given_up(
    tmp_path: Path, period_s: float, is_over: bool
) -> None:
    """One that dies less often is restarted for ever."""
    process = child(tmp_path, "raise SystemExit(1)")
    process.start(0.0)
    for k in range(4):
        assert exit_of(process, period_s * k) == "robot 1: ended with 1"
        assert process.restart_if_dead(period_s * (k + 1)) == "robot 1 is restarted"
    report = exit_of(process, period_s * 4 + 0.1)
    assert process.is_over == is_over
    assert report is not None
    assert ("5 times in a minute" in report) == is_over


def test_a_process_that_ignores_sigterm_is_killed(tmp_path: Path) -> None:
    """When the time to exit is over."""
    code = "import signal, time; signal.signal(15, signal.SIG_IGN); print('up', flush=True); time.sleep(60)"
    process = child(tmp_path, code)
    process.start(0.0)
    while last_line(process.log) != "up":
        time.sleep(0.01)
    process.terminate()
    process.wait(time.monotonic() + 0.1)
    assert process.process is not None
    assert process.process.returncode == -9


def test_robots_and_observers_are_told_apart_by_name(tmp_path: Path) -> None:
    """The colony runs without an observer."""
    names = ("robot 3", "dashboard", "arena", "router")
    processes = [child(tmp_path, "", name) for name in names]
    assert [process.is_robot for process in processes] == [True, False, False, False]
    assert [process.is_observer for process in processes] == [False, True, False, False]


def test_the_address_of_a_dashboard_is_read_from_its_log(tmp_path: Path) -> None:
    """Once it is printed."""
    log = tmp_path / "log"
    assert dashboard_address(log) is None
    log.write_text("dashboard at rerun+http://127.0.0.1:1/proxy\n")
    assert dashboard_address(log) is None
    log.write_text("in a browser: http://127.0.0.1:9090/?url=x\n")
    assert dashboard_address(log) == "http://127.0.0.1:9090/?url=x"


def test_a_process_without_a_log_printed_nothing(tmp_path: Path) -> None:
    """Nor did one with an empty log."""
    assert last_line(tmp_path / "missing") == "it printed nothing"
    (tmp_path / "empty").touch()
    assert last_line(tmp_path / "empty") == "it printed nothing"
