"""A process that dies is restarted, a few times; one that exits for good is not, and its last line says why."""

import signal
import subprocess
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import psutil
import pytest

from crcolony.runtime import supervisor
from crcolony.runtime.supervisor import ChildProcess, dashboard_address, end_all, last_line
from tests.support.process import wait_until


def child(folder: Path, code: str, name: str = "robot 1") -> ChildProcess:
    return ChildProcess(name, [sys.executable, "-c", code], folder / "log")


def running(process: ChildProcess) -> subprocess.Popen[bytes]:
    """Return the program that runs."""
    assert isinstance(process.process, subprocess.Popen)
    return process.process


def exit_of(process: ChildProcess, now_s: float) -> str | None:
    """Wait until a process has exited, and return what the supervisor reports."""
    running(process).wait(30.0)
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
    running(process).kill()
    assert exit_of(process, 1.0) == "robot 1: killed by SIGKILL"
    assert not process.is_over
    assert process.restart_if_dead(1.4) is None
    assert process.restart_if_dead(1.5) == "robot 1 is restarted"
    assert process.restarts == 1
    process.terminate()
    assert exit_of(process, 2.0) == "robot 1: killed by SIGTERM"


def _is_longer(log: Path, size: int) -> bool:
    return log.stat().st_size > size


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


SAVES_AT = (
    "import signal, sys, time; signal.signal(15, lambda *_: (time.sleep({s}), sys.exit(0))); "
)
RUNS = "print('up', flush=True); time.sleep(60)"


def started(*processes: ChildProcess) -> Sequence[subprocess.Popen[bytes]]:
    """Start processes, and return them when all have printed that they are up."""
    for process in processes:
        process.log.parent.mkdir(exist_ok=True)
        process.start(0.0)
    logs = [process.log for process in processes]
    wait_until(lambda: all(last_line(log) == "up" for log in logs), "they are up")
    return [running(process) for process in processes]


def test_robots_end_before_the_others_and_all_have_time_to_save(tmp_path: Path) -> None:
    """The arena is terminated when no robot runs any more; one that was stopped is continued."""
    robot = child(tmp_path / "robot", SAVES_AT.format(s=0.2) + RUNS)
    arena = child(tmp_path / "arena", SAVES_AT.format(s=0.0) + RUNS, "arena")
    one, two = started(arena, robot)
    two.send_signal(signal.SIGSTOP)
    order: list[str] = []

    def note_order() -> bool:
        order.append(f"{one.poll()} {two.poll()}")
        return False

    end_all([arena, robot], note_order)
    assert "0 None" not in order, "the arena ended before the robot"
    assert (one.returncode, two.returncode) == (0, 0)


def test_after_a_second_signal_all_are_terminated_at_once_and_still_save(tmp_path: Path) -> None:
    """None is killed that saves within some seconds."""
    robot = child(tmp_path / "robot", SAVES_AT.format(s=1.0) + RUNS)
    arena = child(tmp_path / "arena", SAVES_AT.format(s=0.0) + RUNS, "arena")
    one, two = started(arena, robot)
    order: list[str] = []

    def is_urgent() -> bool:
        order.append(f"{one.poll()} {two.poll()}")
        return True

    end_all([arena, robot], is_urgent)
    assert "0 None" in order, "the arena waited for the robot"
    assert (one.returncode, two.returncode) == (0, 0)


def test_a_process_that_ignores_sigterm_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the time to exit is over."""
    monkeypatch.setattr(supervisor, "_URGENT_TIMEOUT_S", 0.1)
    process = child(tmp_path, "import signal, time; signal.signal(15, signal.SIG_IGN); " + RUNS)
    (one,) = started(process)
    end_all([process], lambda: True)
    assert one.returncode == -signal.SIGKILL


STARTS_ONE = """
import sys, time
from pathlib import Path
from crcolony.runtime.supervisor import ChildProcess
child = ChildProcess("robot 1", [sys.executable, "-c", sys.argv[1]], Path(sys.argv[2]))
child.start(0.0)
print(child.process.pid, flush=True)
time.sleep(float(sys.argv[3]))
"""
"""A process that starts another one as a launch does."""
ENDS_WITH_PARENT = """
import time
time.sleep(0.5)  # when the parent of the second test is gone already
from crcolony.shutdown import ShutdownSignal, end_with_parent
is_stopped = ShutdownSignal()
end_with_parent()
print("up", flush=True)
while not is_stopped():
    time.sleep(0.01)
print("saved", flush=True)
"""


@pytest.mark.parametrize("lifetime_s", [60.0, 0.0], ids=["killed", "gone before"])
def test_a_process_saves_and_ends_when_what_started_it_is_gone(
    tmp_path: Path, lifetime_s: float
) -> None:
    """Whether that is killed with -9, or is gone before its child can watch it."""
    log = tmp_path / "log"
    words = [sys.executable, "-c", STARTS_ONE, ENDS_WITH_PARENT, str(log), str(lifetime_s)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        started = psutil.Process(int(parent.stdout.readline()))
        if lifetime_s:
            wait_until(lambda: last_line(log) == "up", "the child is up")
            parent.kill()
    wait_until(lambda: last_line(log) == "saved", "the child has saved")
    started.wait(30.0)


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


def test_a_long_log_goes_on_in_an_empty_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One earlier part is kept, and the process, which has the file open, writes on at its new end."""
    monkeypatch.setattr(supervisor, "MAX_LOG_BYTES", 1000)
    code = "import sys\nfor _ in range(400):\n print('x' * 9, flush=True); sys.stdin.read(1)"
    process = child(tmp_path, code)
    process.start(0.0)
    typed = running(process).stdin
    assert typed is not None
    for _ in range(399):
        process.shorten_log()
        size = process.log.stat().st_size
        typed.write(b".")
        typed.flush()
        wait_until(partial(_is_longer, process.log, size), "a line is written")
    typed.close()
    running(process).wait(30.0)
    lines = [(tmp_path / name).read_bytes() for name in ("log", "log.1")]
    assert all(len(each) <= 2000 for each in lines)
    assert all(set(each.split(b"\n")) <= {b"x" * 9, b""} for each in lines), "no holes"
    assert len(lines[1]) > 1000
