"""The command line ends with the exit code that fits, and never with a traceback for wrong input."""

import argparse
import shlex
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from crcolony.cli import main, make_parser
from crcolony.errors import (
    EXIT_FATAL,
    EXIT_INTERRUPTED,
    EXIT_WRONG_INPUT,
    CrcolonyError,
    FatalStorageError,
)
from tests.support.command_line import (
    FAST,
    command,
    parsers_of_commands,
    refusal,
    run_command,
)

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
    """No traceback, nothing on standard output but perhaps a notice on compiling, nothing written."""
    done = run_command(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("crcolony")
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_help_imports_no_heavy_module() -> None:
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


def test_a_run_imports_what_draws_figures_at_its_end_alone(tmp_path: Path) -> None:
    """A run without figures never imports matplotlib, which takes longer than a generation."""
    words = ("evolve", *FAST, "--no-plots", "--out", str(tmp_path / "run"))
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "crcolony", *words],
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert "history hash" in done.stdout
    assert "matplotlib" not in done.stderr


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


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (CrcolonyError("a file is wrong"), EXIT_WRONG_INPUT, "crcolony: a file is wrong"),
        (ImportError("a package is missing"), EXIT_WRONG_INPUT, "crcolony: a package is missing"),
        (FatalStorageError("a disk failed"), EXIT_FATAL, "crcolony: a disk failed"),
        (KeyboardInterrupt(), EXIT_INTERRUPTED, "crcolony: interrupted"),
    ],
)
def test_every_family_of_errors_has_its_exit_code(
    error: BaseException,
    code: int,
    line: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is printed in one line; any other error is a bug, and is raised."""

    def fail(_: argparse.Namespace) -> int:
        raise error

    monkeypatch.setattr("crcolony.commands.check._check", fail)
    assert main(["check", "file"]) == code
    assert capsys.readouterr().err == f"{line}\n"


def test_a_bug_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends with a traceback."""

    def fail(_: argparse.Namespace) -> int:
        raise RuntimeError("a bug")

    monkeypatch.setattr("crcolony.commands.check._check", fail)
    with pytest.raises(RuntimeError, match="a bug"):
        main(["check", "file"])


def test_every_command_has_a_help(capsys: pytest.CaptureFixture[str]) -> None:
    """It says what the command does, every option has a text, and the examples are ones that it accepts."""
    for name, parser in parsers_of_commands().items():
        assert main([*name.split(), "--help"]) == 0
        printed = capsys.readouterr().out
        assert str(parser.description) in " ".join(printed.split())
        assert all(action.help for action in parser._actions), name
        _, examples = printed.split("\nexamples:\n")
        lines = [line.strip() for line in examples.splitlines() if line.startswith("  crcolony")]
        assert lines, name
        for line in lines:
            words = shlex.split(line.partition(">")[0])
            assert words[: 1 + len(name.split())] == ["crcolony", *name.split()]
            make_parser().parse_args(words[1:])


def test_the_version_is_that_of_the_installed_package(capsys: pytest.CaptureFixture[str]) -> None:
    """On standard output."""
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"crcolony {version('crcolony')}\n"


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("evolv", "there is no command 'evolv'; did you mean evolve?"),
        ("luanch -n 4", "did you mean launch?"),
        ("evolve --robts 5", "unrecognized arguments: --robts 5; did you mean --robots?"),
        ("status --secnds=5", "did you mean --seconds?"),
        ("evolve --selection centrl", "did you mean central?"),
        ("config --set life.agent=5", "did you mean life.agents?"),
        ("config --set agents=5", "did you mean life.agents?"),
        ("config --set lambda=5", "did you mean heredity.highest_lambda?"),
        ("config --set lief.agents=5", "did you mean life?"),
        ("config --set selection=fair", "choose one of implicit, central"),
        ("launch --set selection=pgta", "robots as processes know implicit or medea"),
        ("host --set selection=central", "robots as processes know implicit or medea"),
        ("robot --set selection=pega --out r", "robots as processes know implicit or medea"),
        ("demo --set selection=ompac", "robots as processes know implicit or medea"),
    ],
)
def test_a_wrong_word_comes_with_the_right_one(
    words: str, hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Commands, options, their values, and keys of settings."""
    assert hint in refusal(capsys, *words.split())


def test_a_word_like_no_other_has_no_hint(capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is proposed at random."""
    for words in ("xyzzy", "evolve --xyzzy", "config --set xyzzy=5"):
        assert "did you mean" not in refusal(capsys, *words.split())
