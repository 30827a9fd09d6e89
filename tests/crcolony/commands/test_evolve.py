"""`crcolony evolve` as a user meets it: what it prints, how it ends, what it leaves behind."""

import json
import resource
import signal
import subprocess
from pathlib import Path

import pytest

from tests.support.command_line import (
    ENVIRONMENT,
    FAST,
    Refused,
    command,
    hash_of,
    run_command,
    start_command,
    wait_for_line,
)


def test_evolve_ends_with_the_history_hash_and_leaves_a_results_folder(tmp_path: Path) -> None:
    """Plain lines without a terminal, exit code 0, and config, history, table, plots and checkpoint in the folder."""
    words = [word for word in FAST if word != "--no-plots"]
    done = run_command("evolve", *words, "--out", tmp_path / "run")
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
        "made_by.toml",
        "plots",
        "run.json",
    ]
    plots = ["generations.png", "meta_parameters.png", "potentials.png"]
    assert sorted(path.name for path in (tmp_path / "run" / "plots").iterdir()) == plots


def test_two_processes_have_the_same_history(tmp_path: Path) -> None:
    """The same seed gives the same hash in every process, another seed another."""
    hashes = [
        hash_of(run_command("evolve", *FAST, "--seed", seed, "--out", tmp_path / name).stdout)
        for name, seed in (("a", "3"), ("b", "3"), ("c", "4"))
    ]
    assert hashes[0] == hashes[1] != hashes[2]


def test_without_out_runs_are_numbered(tmp_path: Path) -> None:
    """The first goes into runs/1, the next into runs/2."""
    for number in ("1", "2"):
        done = run_command("evolve", *FAST, "--generations", "1", cwd=tmp_path)
        assert f"into runs/{number}" in done.stdout
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["1", "2"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_stopped_writes_everything_and_can_be_resumed(
    tmp_path: Path, number: signal.Signals
) -> None:
    """Ctrl-C or SIGTERM: exit code 0, the hash is printed, and the resumed run ends like one that was not stopped."""
    words = ("evolve", *FAST, "--set", "life.agents=60", "--generations", "12", "--out")
    process = start_command(*words, tmp_path / "run")
    wait_for_line(process, "generation 1:")
    process.send_signal(number)
    output, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "")
    assert "resume with: python -m crcolony evolve --resume --out" in output
    described = json.loads((tmp_path / "run" / "run.json").read_text())
    assert described["status"] == "stopped"
    assert described["history_hash"] == hash_of(output)
    resumed = run_command("evolve", "--resume", "--no-plots", "--out", tmp_path / "run")
    whole = run_command(*words, tmp_path / "whole")
    assert hash_of(resumed.stdout) == hash_of(whole.stdout)
    assert json.loads((tmp_path / "run" / "run.json").read_text())["status"] == "done"


def test_a_killed_run_is_resumed_from_its_last_checkpoint(tmp_path: Path) -> None:
    """After kill -9 the resumed run ends like one that was not killed."""
    words = ("evolve", *FAST, "--set", "life.agents=60", "--generations", "6", "--out")
    process = start_command(*words, tmp_path / "run")
    wait_for_line(process, "generation 1:")
    process.kill()
    process.communicate(timeout=60)
    resumed = run_command("evolve", "--resume", "--no-plots", "--out", tmp_path / "run")
    whole = run_command(*words, tmp_path / "whole")
    assert hash_of(resumed.stdout) == hash_of(whole.stdout)


def test_a_finished_run_goes_on(tmp_path: Path) -> None:
    """With more generations it ends like one that had them from the beginning; with fewer it is refused."""
    run = tmp_path / "L[/home]x"
    run_command("evolve", *FAST, "--out", run)
    again = run_command("evolve", "--resume", "--no-plots", "--out", run)
    assert "it is finished; a larger --generations goes on with it" in again.stdout
    more = run_command("evolve", "--resume", "--no-plots", "--generations", "5", "--out", run)
    assert more.returncode == 0, more.stderr
    whole = run_command(
        "evolve", *FAST, "--generations", "5", "-n", "4", "--out", tmp_path / "whole"
    )
    assert hash_of(more.stdout) == hash_of(whole.stdout) != hash_of(again.stdout)
    assert (run / "config.toml").read_text() == (tmp_path / "whole" / "config.toml").read_text()
    fewer = run_command("evolve", "--resume", "--no-plots", "--generations", "4", "--out", run)
    assert fewer.stderr == f"crcolony: {run}: has ended 5 generations already\n"
    assert "generations = 5" in (run / "config.toml").read_text()


def test_minutes_end_an_endless_run(tmp_path: Path) -> None:
    """--generations 0 has no last generation, --minutes ends it."""
    done = run_command(
        "evolve", *FAST, "--generations", "0", "--minutes", "0.01", "--out", tmp_path / "run"
    )
    assert done.returncode == 0, done.stderr
    assert "until Ctrl-C" in done.stdout
    assert "stopped in generation" in done.stdout


def test_a_full_disk_ends_a_run_with_one_line_and_loses_nothing(tmp_path: Path) -> None:
    """With no room for the history (a limit on the size of files, as a full disk) the run can be resumed later."""
    limit = 3_000_000
    words = [*FAST, "--set", "learning.tilings=2", "--generations", "0", "--out", "run"]
    full = subprocess.run(
        command("evolve", *words),
        capture_output=True,
        text=True,
        timeout=200,
        cwd=tmp_path,
        env=ENVIRONMENT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert full.returncode == 2
    assert full.stderr.startswith("crcolony: run: cannot be written: ")
    assert len(full.stderr.strip().splitlines()) == 1
    resumed = run_command(
        "evolve", "--resume", "--no-plots", "--out", "run", "--minutes", "0.01", cwd=tmp_path
    )
    assert resumed.returncode == 0, resumed.stderr


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("evolve --seeds 0", "--seeds 0: must be at least 1"),
        ("evolve --compare", "--compare needs --seeds"),
        ("evolve --sweep life.agents=3,4", "--sweep needs --seeds"),
        (
            "evolve --seeds 2 --compare --sweep life.agents=3,4",
            "--compare cannot be used with --sweep",
        ),
        ("evolve --seeds 2 --sweep life.agents", "--sweep 'life.agents': expected key=value,value"),
        ("evolve --seeds 2 --sweep life.agent=3,4", "life.agent: there is no such setting"),
        ("evolve --seeds 2 --sweep generations=0,3", "--generations 0 cannot be used with --seeds"),
        ("evolve --resume", "--resume needs --out"),
        ("evolve --resume --out x --seed 3", "--resume uses the config of the folder"),
        ("evolve --seeds 2 --minutes 3", "--minutes cannot be used with --seeds"),
        ("evolve --seeds 2 --generations 0", "--generations 0 cannot be used with --seeds"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
