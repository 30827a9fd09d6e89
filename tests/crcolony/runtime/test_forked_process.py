"""A process that was forked is as good as a new interpreter, whatever becomes of the process that forked it."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from crcolony.errors import EXIT_WRONG_INPUT
from crcolony.protocol.identity import load_key
from crcolony.runtime import forked_process
from crcolony.runtime.forked_process import ForkedProcess, ForkServer
from crcolony.runtime.started_process import StartedProcess
from tests.support.process import wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="nothing is forked here")
NOBODY = "tcp/127.0.0.1:1"
"""Where no process listens, so that a robot waits."""


@pytest.fixture
def server() -> Iterator[ForkServer]:
    with ForkServer() as server:
        yield server


def start(server: ForkServer, log: Path, *words: str) -> StartedProcess:
    """Start a command of crcolony."""
    with log.open("ab") as output:
        return server.start(words, output)


def exit_code(process: StartedProcess) -> int | None:
    """Wait until a process has exited."""
    wait_until(lambda: process.poll() is not None, "it has exited")
    return process.poll()


def waiting_robot(server: ForkServer, folder: Path) -> StartedProcess:
    """Start a robot that waits for its network, and return it when it does."""
    folder.mkdir()
    log = folder / "log"
    words = ("robot", "--out", str(folder / "robot"), "--client", "--connect", NOBODY)
    process = start(server, log, *words)
    wait_until(lambda: "waiting for the network" in log.read_text(), "it waits")
    return process


def end(process: StartedProcess) -> None:
    """End a process, and wait for it."""
    process.send_signal(signal.SIGKILL)
    with process:
        pass


def test_a_command_is_run_and_its_exit_code_is_known(server: ForkServer, tmp_path: Path) -> None:
    """Its output goes where it is meant to go; wrong input is one line and a code of its own."""
    log = tmp_path / "log"
    assert exit_code(start(server, log, "--version")) == 0
    wrong = start(server, log, "check", "missing.toml")
    assert isinstance(wrong, ForkedProcess)
    assert exit_code(wrong) == EXIT_WRONG_INPUT
    version, reason = log.read_text().splitlines()
    assert version.startswith("crcolony ")
    assert "missing.toml" in reason


def test_it_is_a_child_of_this_process_in_a_session_of_its_own(
    server: ForkServer, tmp_path: Path
) -> None:
    """So nobody but this process learns how it ended, and Ctrl-C here does not reach it; `ps` shows its command."""
    process = waiting_robot(server, tmp_path / "one")
    running = psutil.Process(process.pid)
    assert running.ppid() == os.getpid()
    assert os.getsid(process.pid) == process.pid
    assert running.cmdline()[:3] == ["crcolony", "robot", "--out"]
    assert running.name() == "crcolony robot"
    process.send_signal(signal.SIGKILL)
    assert exit_code(process) == -signal.SIGKILL
    end(process)  # of which nothing comes


def test_every_process_has_random_numbers_of_its_own(server: ForkServer, tmp_path: Path) -> None:
    """Two robots that are forked one after the other have different keys."""
    keys = [tmp_path / "one", tmp_path / "two"]
    for key in keys:
        assert exit_code(start(server, tmp_path / "log", "keygen", str(key))) == 0
    assert load_key(keys[0]).id != load_key(keys[1]).id


def test_it_saves_and_ends_on_sigterm_as_any_process_does(
    server: ForkServer, tmp_path: Path
) -> None:
    """Signals have the effect that they have in a new interpreter."""
    process = waiting_robot(server, tmp_path / "one")
    process.send_signal(signal.SIGTERM)
    assert exit_code(process) == 0


def test_the_prepared_process_has_one_thread_and_nothing_open(server: ForkServer) -> None:
    """But its socket: no thread is lost and no connection is shared when it forks."""
    assert server.pid is not None
    prepared = psutil.Process(server.pid)
    wait_until(lambda: prepared.cmdline() == ["crcolony", "fork", "server"], "it is prepared")
    assert prepared.num_threads() == 1
    assert not prepared.open_files()
    assert not prepared.net_connections("inet")


def test_if_it_is_killed_nobody_is_hurt_and_another_one_takes_over(
    server: ForkServer, tmp_path: Path
) -> None:
    """What it has forked lives on, and ends with a code that is known."""
    one = waiting_robot(server, tmp_path / "one")
    former = server.pid
    assert former is not None
    os.kill(former, signal.SIGKILL)
    two = waiting_robot(server, tmp_path / "two")
    assert isinstance(two, ForkedProcess)
    assert server.pid not in (None, former)
    assert one.poll() is None
    for process in (one, two):
        process.send_signal(signal.SIGTERM)
        assert exit_code(process) == 0


@pytest.mark.parametrize("program", ["raise SystemExit(1)", "import time; time.sleep(60)"])
def test_where_it_cannot_fork_processes_are_new_interpreters(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It has ended because a library has started a thread, or does not answer; it is not tried again."""
    monkeypatch.setattr(forked_process, "_TIMEOUT_S", 0.1)
    with monkeypatch.context() as patched, ForkServer() as server:
        patched.setattr(forked_process, "python_command", lambda _: [sys.executable, "-c", program])
        server._end()
        for _ in range(2):
            process = start(server, tmp_path / "log", "--version")
            assert isinstance(process, subprocess.Popen)
            with process:
                assert process.wait(60.0) == 0
            assert server.pid is None


def test_on_other_systems_processes_are_new_interpreters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is prepared there."""
    monkeypatch.setattr(sys, "platform", "darwin")
    with ForkServer() as server:
        assert server.pid is None
        with start(server, tmp_path / "log", "--version") as process:
            assert isinstance(process, subprocess.Popen)


LAUNCHES = """
import sys, time
from pathlib import Path
from crcolony.runtime.forked_process import ForkServer
with ForkServer() as server, Path(sys.argv[1]).open("ab") as output:
    process = server.start(sys.argv[2:], output)
    print(server.pid, process.pid, flush=True)
    time.sleep(60)
"""
"""A process that starts a robot as a launch does."""


def test_all_end_when_what_started_them_is_killed(tmp_path: Path) -> None:
    """The prepared process, too."""
    log = tmp_path / "log"
    robot = ["robot", "--out", str(tmp_path / "robot"), "--client", "--connect", NOBODY]
    command = [sys.executable, "-c", LAUNCHES, str(log), *robot]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as launch:
        assert launch.stdout is not None
        started = [psutil.Process(int(pid)) for pid in launch.stdout.readline().split()]
        wait_until(lambda: "waiting for the network" in log.read_text(), "the robot waits")
        launch.kill()
    gone, _ = psutil.wait_procs(started, 30.0)
    assert set(gone) == set(started)
