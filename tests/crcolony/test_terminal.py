"""Output that cannot be written, or not in its encoding, breaks no run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from crcolony.errors import EXIT_OK, EXIT_UNREAD, EXIT_WRONG_INPUT
from crcolony.terminal import one_line, plain_console
from tests.support.command_line import ENVIRONMENT, FAST, command
from tests.support.run_folders import run as run_folder
from tests.support.small_colony import small

ODD = "L[/home]x :dog: $a$ ä\udcff"
"""The name of a folder that could be taken for markup, an emoji, mathematics, and that is no UTF-8."""

PRINTS = """
import sys
from crcolony.terminal import standard_streams
with standard_streams() as streams:
    print(sys.argv[1], flush=True)
    print("on standard error", file=sys.stderr)
print(f"{streams.error!r}", file=sys.stderr)
"""


def run(
    words: list[str], *, redirect: str = "", **variables: str
) -> subprocess.CompletedProcess[bytes]:
    """Run a command line of Python whose output a shell redirects."""
    return subprocess.run(
        ["sh", "-c", f'"$@" {redirect}', "sh", sys.executable, *words],
        capture_output=True,
        timeout=200,
        env={**ENVIRONMENT, **variables},
    )


@pytest.mark.parametrize(
    ("encoding", "expected"),
    [
        ("utf-8", "█░▁▇ → α".encode() + b" \xff"),
        ("latin-1", b"#._* -> \\u03b1 \xff"),
        ("ascii", b"#._* -> \\u03b1 \xff"),
        ("cp1252", b"#._* -> \\u03b1 \xff"),
    ],
)
def test_what_an_encoding_cannot_hold_is_printed_in_ascii(encoding: str, expected: bytes) -> None:
    """Bars and arrows as what looks like them, others by number, and names of files byte by byte."""
    done = run(["-c", PRINTS, "█░▁▇ → α \udcff"], PYTHONIOENCODING=encoding)
    assert done.stdout == expected + b"\n"


@pytest.mark.parametrize(
    ("redirect", "error"),
    [
        (">/dev/full", b"OSError(28, 'No space left on device')"),
        (">&-", b"None"),
        (">&- <&-", b"None"),
    ],
)
def test_output_that_cannot_be_written_is_noted_and_left_out(redirect: str, error: bytes) -> None:
    """A full disk, or no output at all; standard error is written all the same."""
    done = run(["-c", PRINTS, "text"], redirect=redirect)
    assert done.stderr.splitlines() == [b"on standard error", error]
    assert done.returncode == 0


@pytest.mark.parametrize("redirect", ["2>/dev/full", "2>&-", ">/dev/full 2>/dev/full"])
def test_errors_that_cannot_be_written_are_left_out(redirect: str) -> None:
    """The exit code says what there is to say."""
    assert run(["-m", "crcolony", "check", "missing"], redirect=redirect).returncode == 2


def test_closed_descriptors_are_given_to_no_file(tmp_path: Path) -> None:
    """Else what a library prints on them would be written into the files of a run."""
    program = """
import os, sys
from crcolony.terminal import standard_streams
with standard_streams():
    file = os.open(sys.argv[1], os.O_CREAT | os.O_WRONLY)
    os.write(file, str(file).encode())
"""
    run(["-c", program, str(tmp_path / "file")], redirect="<&- >&- 2>&-")
    assert int((tmp_path / "file").read_text()) > 2


def test_a_full_output_loses_nothing_of_a_run(tmp_path: Path) -> None:
    """The run goes on to its end, and then says with line and exit code that its output is not whole."""
    words = ["-m", "crcolony", "evolve", *FAST, "--out", str(tmp_path / "run")]
    done = run(words, redirect=">/dev/full")
    assert done.returncode == EXIT_WRONG_INPUT
    assert done.stderr == b"crcolony: standard output: No space left on device\n"
    assert json.loads((tmp_path / "run" / "run.json").read_text())["status"] == "done"


@pytest.mark.parametrize(
    "words",
    [
        "--help",
        "config",
        "completion zsh",
        "check configs/senses.toml",
        "keygen OUT/key",
        "inspect OUT/run",
        "export OUT/run",
        "status --seconds 0.3 --listen tcp/127.0.0.1:0",
        "top --seconds 0.3 --listen tcp/127.0.0.1:0",
    ],
)
@pytest.mark.parametrize(
    ("redirect", "error"),
    [(">/dev/full", b"crcolony: standard output: No space left on device\n"), ("| true", b"")],
)
def test_no_command_needs_an_output(
    words: str, redirect: str, error: bytes, tmp_path: Path
) -> None:
    """A full disk is said in one line, a reader that is gone is not."""
    run_folder(tmp_path / "run", small("generations=1"))
    line = ["-m", "crcolony", *words.replace("OUT", str(tmp_path)).split()]
    done = run(line, redirect=redirect, PYTHONIOENCODING="ascii")
    assert done.stderr == error
    assert done.returncode == (EXIT_WRONG_INPUT if error else EXIT_OK)


def test_an_unread_output_ends_a_run_with_all_saved(tmp_path: Path) -> None:
    """As in `crcolony evolve | head -1`: also one without end; it can be resumed from where it stopped."""
    line = " ".join(
        command("evolve", *FAST, "--generations", "0", "--out", tmp_path / "run", "| head -1")
    )
    done = subprocess.run(
        ["bash", "-c", f"{line}; exit ${{PIPESTATUS[0]}}"],
        capture_output=True,
        text=True,
        timeout=200,
        env=ENVIRONMENT,
    )
    assert (done.returncode, done.stderr) == (EXIT_UNREAD, "")
    described = json.loads((tmp_path / "run" / "run.json").read_text())
    assert described["status"] == "stopped"


def test_a_folder_is_shown_as_it_is_called(tmp_path: Path) -> None:
    """Whatever its name looks like, in every encoding."""
    folder = os.fsencode(tmp_path / ODD)
    for encoding in ("utf-8", "ascii"):
        words = ["-m", "crcolony", "evolve", *FAST, "--generations", "1", "--out"]
        done = run([*words, os.fsdecode(folder)], PYTHONIOENCODING=encoding)
        expected = folder if encoding == "utf-8" else folder.replace("ä".encode(), b"\\xe4")
        assert done.returncode == EXIT_OK, done.stderr
        assert b"into " + expected + b"\n" in done.stdout
        assert done.stderr == b""
        subprocess.run(["rm", "-r", folder], check=True)


def test_a_line_stays_one_line() -> None:
    """Whatever is in it."""
    assert one_line("a\nb\x1b[31m ä") == "a\\nb\\x1b[31m ä"


def test_a_console_prints_texts_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    """Neither markup nor emoji."""
    plain_console().print("[bold]runs/:dog:[/bold]")
    assert capsys.readouterr().out == "[bold]runs/:dog:[/bold]\n"
