"""The command as a user meets it: real processes, what they print, how they end, what they leave behind."""

import json
import os
import resource
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.paths import PYTHONPATH
from tests.support.small_colony import SMALL

FAST = ["--generations", "3", *(word for setting in SMALL for word in ("--set", setting))]


def command(*words: str | Path) -> list[str]:
    return [sys.executable, "-m", "crcolony", *map(str, words)]


def crcolony(*words: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": PYTHONPATH}
    return subprocess.run(
        command(*words), capture_output=True, text=True, timeout=200, cwd=cwd, env=environment
    )


def start(*words: str | Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_for_line(process: subprocess.Popen[str], word: str) -> None:
    assert process.stdout is not None
    for line in process.stdout:
        if word in line:
            return
    raise AssertionError(f"the process ended without saying {word}: {process.communicate()[1]}")


def hash_of(output: str) -> str:
    return output.strip().splitlines()[-1].removeprefix("history hash: ")


def test_evolve_ends_with_the_history_hash_and_leaves_a_results_folder(tmp_path: Path) -> None:
    """Plain lines without a terminal, exit code 0, and config, history, table, plots and checkpoint in the folder."""
    done = crcolony("evolve", *FAST, "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[-1].startswith("history hash: ")
    assert any(line.startswith("generation 3: matings ") for line in lines)
    assert "\x1b" not in done.stdout
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == [
        "checkpoint.npz",
        "config.toml",
        "generations.csv",
        "history.sqlite",
        "plots",
        "run.json",
    ]
    plots = ["generations.png", "meta_parameters.png", "potentials.png"]
    assert sorted(path.name for path in (tmp_path / "run" / "plots").iterdir()) == plots


def test_two_processes_live_the_same_history(tmp_path: Path) -> None:
    """The same seed gives the same hash in every process, another seed another."""
    hashes = [
        hash_of(crcolony("evolve", *FAST, "--seed", seed, "--out", tmp_path / name).stdout)
        for name, seed in (("a", "3"), ("b", "3"), ("c", "4"))
    ]
    assert hashes[0] == hashes[1] != hashes[2]


def test_without_out_runs_are_numbered(tmp_path: Path) -> None:
    """The first goes into runs/1, the next into runs/2."""
    for number in ("1", "2"):
        done = crcolony("evolve", *FAST, "--generations", "1", cwd=tmp_path)
        assert f"into runs/{number}" in done.stdout
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["1", "2"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_told_to_stop_writes_everything_and_can_go_on(
    tmp_path: Path, number: signal.Signals
) -> None:
    """Ctrl-C or SIGTERM: exit code 0, the hash is said, and the resumed run ends like an undisturbed one."""
    words = ("evolve", *FAST, "--set", "life.agents=60", "--generations", "40", "--out")
    process = start(*words, tmp_path / "run")
    wait_for_line(process, "generation 1:")
    process.send_signal(number)
    output, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "")
    assert "resume with: python -m crcolony evolve --resume --out" in output
    message = json.loads((tmp_path / "run" / "run.json").read_text())
    assert message["status"] == "stopped"
    assert message["history_hash"] == hash_of(output)
    resumed = crcolony("evolve", "--resume", "--out", tmp_path / "run")
    whole = crcolony(*words, tmp_path / "whole")
    assert hash_of(resumed.stdout) == hash_of(whole.stdout)
    assert json.loads((tmp_path / "run" / "run.json").read_text())["status"] == "done"


def test_a_killed_run_goes_on_from_its_last_checkpoint(tmp_path: Path) -> None:
    """After kill -9 the resumed run ends like an undisturbed one."""
    words = ("evolve", *FAST, "--set", "life.agents=60", "--generations", "6", "--out")
    process = start(*words, tmp_path / "run")
    wait_for_line(process, "generation 1:")
    process.kill()
    process.communicate(timeout=60)
    resumed = crcolony("evolve", "--resume", "--out", tmp_path / "run")
    whole = crcolony(*words, tmp_path / "whole")
    assert hash_of(resumed.stdout) == hash_of(whole.stdout)


def test_minutes_end_an_endless_run(tmp_path: Path) -> None:
    """--generations 0 has no last generation, --minutes ends it."""
    done = crcolony(
        "evolve", *FAST, "--generations", "0", "--minutes", "0.01", "--out", tmp_path / "run"
    )
    assert done.returncode == 0, done.stderr
    assert "until Ctrl-C" in done.stdout
    assert "stopped in generation" in done.stdout


def test_a_terminal_sees_a_live_display(tmp_path: Path) -> None:
    """On a real pseudo-terminal generation, matings, batteries, energy and speed are drawn, and Ctrl-C ends it."""
    leader, follower = os.openpty()
    process = subprocess.Popen(
        command("evolve", *FAST, "--generations", "0", "--out", tmp_path / "run"),
        stdin=follower,
        stdout=follower,
        stderr=follower,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100", "LINES": "30"},
    )
    os.close(follower)
    seen = b""
    deadline_s = time.monotonic() + 120.0
    asked = False
    while time.monotonic() < deadline_s:
        if not select.select([leader], [], [], 1.0)[0]:
            continue
        try:
            piece = os.read(leader, 65536)
        except OSError:  # the other end is closed
            break
        seen += piece
        if b"starved" in seen and not asked:
            asked = True
            process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 0
    os.close(leader)
    for word in (b"generation", b"matings", b"batteries", b"energy", b"robot-steps/s", b"hash"):
        assert word in seen
    assert b"Traceback" not in seen


WRONG = [
    ("evolve", "--robots", "x"),
    ("evolve", "--robots", "0"),
    ("evolve", "--generations", "-1"),
    ("evolve", "--selection", "fair"),
    ("evolve", "--minutes", "0"),
    ("evolve", "--minutes", "nan"),
    ("evolve", "--seeds", "0"),
    ("evolve", "--compare"),
    ("evolve", "--resume"),
    ("evolve", "--resume", "--out", "nowhere"),
    ("evolve", "--resume", "--out", "nowhere", "--seed", "3"),
    ("evolve", "--seeds", "2", "--minutes", "3"),
    ("evolve", "--seeds", "2", "--generations", "0"),
    ("evolve", "--seeds", "2", "--resume"),
    ("evolve", "--config", "missing.toml"),
    ("evolve", "--set", "lambda=2"),
    ("evolve", "--set", "heredity.highest_lambda=1.5"),
    ("evolve", "--set", "arena.packs=100000"),
    ("evolve", "--robots", "9999", "--set", "life.agents=1000"),
    ("evolve", "--out", "/dev/null/run"),
    ("evolve", "--bogus"),
    ("check", "missing.toml"),
    ("plot", "nowhere"),
    ("bogus",),
    (),
]


@pytest.mark.parametrize("words", WRONG, ids=" ".join)
def test_wrong_input_is_one_line_exit_code_2_and_leaves_nothing(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    """No traceback, nothing on standard output but perhaps a word on compiling, nothing written."""
    done = crcolony(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("crcolony")
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_check_says_whether_a_config_is_good(tmp_path: Path) -> None:
    """A good file, and one with a slip in it."""
    path = tmp_path / "my.toml"
    path.write_text("robots = 6\n")
    assert crcolony("check", path).stdout == f"{path}: valid\n"
    path.write_text("robotts = 6\n")
    done = crcolony("check", path)
    assert done.returncode == 2
    assert done.stderr == f"crcolony: {path}: robotts: there is no such setting\n"


def test_a_full_disk_stops_a_run_with_a_word_and_loses_nothing(tmp_path: Path) -> None:
    """With no room for the history to grow (a limit on the size of files, as a full disk) the run can go on later."""
    limit = 3_000_000
    words = [*FAST, "--set", "learning.tilings=2", "--generations", "0", "--out", "run"]
    environment = {**os.environ, "PYTHONPATH": PYTHONPATH}
    full = subprocess.run(
        command("evolve", *words),
        capture_output=True,
        text=True,
        timeout=200,
        cwd=tmp_path,
        env=environment,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert full.returncode == 2
    assert full.stderr.startswith("crcolony: run: cannot be written: ")
    assert len(full.stderr.strip().splitlines()) == 1
    resumed = crcolony("evolve", "--resume", "--out", "run", "--minutes", "0.01", cwd=tmp_path)
    assert resumed.returncode == 0, resumed.stderr


def test_help_answers_without_loading_the_heavy_parts() -> None:
    """numpy, numba and pymunk are imported only when a command needs them."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "crcolony", "--help"],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert "evolve" in done.stdout
    for heavy in ("numpy", "numba", "pymunk", "rich", "msgspec"):
        assert f" {heavy}\n" not in done.stderr


def test_an_unread_output_ends_the_run_quietly(tmp_path: Path) -> None:
    """As in `crcolony evolve | head -1`: no traceback."""
    done = subprocess.run(
        " ".join([*command("evolve", *FAST, "--out", tmp_path / "run"), "| head -1"]),
        shell=True,
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert done.stderr == ""
