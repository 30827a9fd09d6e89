"""However a colony is ended, and whenever, no process of it stays, and what was saved is there."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from random import Random

import psutil
import pytest

from crcolony.transport.zenoh_session import free_port, is_taken
from tests.support.paths import PYTHONPATH, ROOT
from tests.support.process import Process, wait_until
from tests.support.process_colony import colony, crcolony, settings

ENDINGS = {
    "SIGTERM": [signal.SIGTERM],
    "a closed window": [signal.SIGHUP, signal.SIGHUP],
    "Ctrl-C three times": [signal.SIGINT] * 3,
    "kill -9": [signal.SIGKILL],
}
TAKES_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.argv[1], sys.argv[1:])
"""
"""Makes standard input the terminal of this session, and becomes another program."""


def words_of_launch(endpoint: str, run: Path) -> list[str]:
    """Return the command line that launches an arena and two robots, with everything in the folder `run`."""
    network = ("--listen", endpoint, "--out", str(run))
    return ["launch", "-n", "2", "--hz", "30", "--no-plots", *settings(), *network]


def launch(folder: Path, is_started: bool = True) -> Process:
    """Launch an arena and two robots on a port of their own; everything is in the folder `run`."""
    words = words_of_launch(f"tcp/127.0.0.1:{free_port()}", folder / "run")
    launched = Process(crcolony(*words), folder / "log")
    return launched.start() if is_started else launched


def processes_of(run: Path) -> list[psutil.Process]:
    """Return the processes with a run's folder in their command line."""
    found = []
    for process in psutil.process_iter(["cmdline", "status"]):
        is_alive = process.info["status"] != psutil.STATUS_ZOMBIE
        if is_alive and any(str(run) in word for word in process.info["cmdline"] or ()):
            found.append(process)
    return found


def wait_until_gone(launched: Process, run: Path) -> None:
    """Wait until no process of a launch is left; its port is free then."""
    launched.wait(60.0)
    wait_until(lambda: not processes_of(run), "no process is left")
    endpoint = launched.command[launched.command.index("--listen") + 1]
    assert not is_taken(endpoint)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_launch_that_is_ended_while_it_starts_leaves_no_process(
    tmp_path: Path, ending: str
) -> None:
    """At any moment from the first process on; without kill -9 there is a history if there is a robot."""
    chance = Random(ending)
    for number in range(2):
        folder = tmp_path / str(number)
        folder.mkdir()
        run = folder / "run"
        launched = launch(folder)
        wait_until((run / "logs" / "arena.log").exists, "the first process is started")
        time.sleep(chance.uniform(0.0, 3.0))
        for one in ENDINGS[ending]:
            launched.signal(one)
            time.sleep(chance.uniform(0.0, 0.1))
        wait_until_gone(launched, run)
        assert "Traceback" not in launched.output
        if ending != "kill -9":
            assert launched.wait() == 0, launched.output
            has_robot = any(run.glob("robots/*/robot.sqlite"))
            assert (run / "history.sqlite").exists() or not has_robot


@pytest.mark.parametrize("ending", ENDINGS)
def test_robots_are_saved_however_their_launch_ends(tmp_path: Path, ending: str) -> None:
    """Even by kill -9 each robot saves; otherwise the report is there as well."""
    run = tmp_path / "run"
    launched = launch(tmp_path)
    logs = [run / "logs" / f"robot-{number}.log" for number in range(2)]
    launched.wait_for("2 robots are connected", within_s=200.0)
    wait_until(lambda: all("mated" in log.read_text() for log in logs), "both robots mate")
    for one in ENDINGS[ending]:
        launched.signal(one)
        time.sleep(0.05)
    wait_until_gone(launched, run)
    for log in logs:
        assert "saved in generation" in log.read_text()
    assert "stopped at tick" in (run / "logs" / "arena.log").read_text()
    if ending != "kill -9":
        assert "history hash: " in launched.output
        assert (run / "history.sqlite").exists()


def test_a_terminal_that_is_closed_ends_the_colony_and_its_history_is_written(
    tmp_path: Path,
) -> None:
    """The kernel sends SIGHUP, and nothing can be printed any more."""
    leader, follower = os.openpty()
    run = tmp_path / "run"
    words = crcolony(*words_of_launch(f"tcp/127.0.0.1:{free_port()}", run))
    window = subprocess.Popen(
        [sys.executable, "-c", TAKES_TERMINAL, *words],
        stdin=follower,
        stdout=follower,
        stderr=follower,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": PYTHONPATH, "TERM": "xterm"},
        start_new_session=True,
    )
    os.close(follower)
    log = run / "logs" / "robot-1.log"

    def has_mated() -> bool:
        os.read(leader, 65536)  # as a terminal does
        return log.exists() and "mated" in log.read_text()

    wait_until(has_mated, "a mating")
    os.close(leader)
    window.wait(60.0)
    wait_until(lambda: not processes_of(run), "no process is left")
    assert "saved in generation" in log.read_text()
    assert (run / "history.sqlite").exists()


def test_a_colony_under_nohup_lives_on_when_the_terminal_is_closed(tmp_path: Path) -> None:
    """SIGHUP is ignored by the launch and by all that it starts."""
    with colony(tmp_path) as made:
        run = tmp_path / "run"
        words = words_of_launch(made.endpoint, run)
        launched = made.start("launch", *words, before=("nohup",))
        launched.wait_for("2 robots are connected", within_s=200.0)
        everyone = [psutil.Process(launched.pid), *psutil.Process(launched.pid).children()]
        assert len(everyone) == 5  # with the fork server
        for process in everyone:
            process.send_signal(signal.SIGHUP)
        launched.wait_for("2 robots alive", launched.output.count("2 robots alive") + 2)
        assert all(process.is_running() for process in everyone)
        assert "restarted" not in launched.output
        launched.stop()
        assert "history hash: " in launched.output


USERS_FILES = ("zenoh", "msgspec", "queue", "socket", "rich", "numpy", "signal", "sqlite3")


@pytest.mark.parametrize("is_installed", [True, False], ids=["crcolony", "python -m crcolony"])
def test_files_of_the_working_folder_are_no_modules(tmp_path: Path, is_installed: bool) -> None:
    """Neither to the command nor to what it starts, even if Python itself would import them before our code runs."""
    for name in (*USERS_FILES, "types") if is_installed else USERS_FILES:
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a file of the user was imported')")
    script = tmp_path / "bin" / "crcolony"
    script.parent.mkdir()
    script.write_text("import sys\nfrom crcolony.cli import main\nsys.exit(main())\n")
    launched = launch(tmp_path, is_started=False)
    if is_installed:
        launched.command[1:3] = [str(script)]
    launched.cwd = tmp_path
    launched.start()
    launched.wait_for("2 robots are connected", within_s=200.0)
    launched.stop()
    for log in (tmp_path / "run" / "logs").iterdir():
        assert "a file of the user" not in log.read_text()


NOT_LEFT = """
import sys, threading
import crcolony.transport.close_session as module
module._TIMEOUT_S = 0.5

class Hanging:
    def __init__(self, session): self.session = session
    def close(self): threading.Event().wait()

close = module.close_session
module.close_session = lambda session: close(Hanging(session))
import crcolony.transport.zenoh_robots
crcolony.transport.zenoh_robots.close_session = module.close_session
from crcolony.cli import main
sys.exit(main())
"""
"""The command, with a Zenoh that never manages to close a session."""


@pytest.mark.parametrize("command", ["arena", "robot", "router", "top"])
def test_a_network_that_cannot_be_left_is_one_line(tmp_path: Path, command: str) -> None:
    """The process ends all the same, with the exit code of success, after all was saved."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    out = ("--out", str(tmp_path / "out")) if command in ("arena", "robot") else ()
    words = [command, *out, "--connect" if command in ("robot", "top") else "--listen", endpoint]
    if command in ("arena", "robot"):
        words += settings()
    process = Process([sys.executable, "-c", NOT_LEFT, *words], tmp_path / "log").start()
    first = {"arena": "arena arena with", "robot": "robot ", "router": "router at", "top": "robots"}
    process.wait_for(first[command], within_s=200.0)
    process.stop()
    assert process.output.count("the network was not left in time") == 1
    assert "Traceback" not in process.output
    if out:
        assert any((tmp_path / "out").rglob("*.sqlite" if command == "robot" else "*.npz"))


def test_zenoh_logs_nothing_unless_it_is_asked_to(tmp_path: Path) -> None:
    """Not even when it cannot reach what it should, or is cut; RUST_LOG still works."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    words = ("top", "--seconds", "3", "--connect", endpoint)
    quiet = Process(crcolony(*words), tmp_path / "quiet").start()
    loud = Process(["env", "RUST_LOG=debug", *crcolony(*words)], tmp_path / "loud").start()
    quiet.wait()
    loud.wait()
    assert "zenoh" not in quiet.output.replace("crcolony", "")
    assert "DEBUG" in loud.output
