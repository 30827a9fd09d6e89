"""What is shown of a process that has changed its command line."""

import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from crcolony.runtime.process_title import show_command

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux shows another one")
SHOWS = """
import sys
from crcolony.runtime.process_title import show_command
show_command(["crcolony", "robot", *sys.argv[1].split()])
print(len(sys.argv[2]), flush=True)
sys.stdin.read()
"""


def shown(words: str, room: int) -> list[str]:
    """Return the command line that is shown of a process whose own one has so much room."""
    command = [sys.executable, "-c", SHOWS, words, "." * room]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert int(process.stdout.readline()) == room  # its own arguments are what they were
        line = psutil.Process(process.pid).cmdline()
        assert psutil.Process(process.pid).name() == "crcolony robot"
        process.communicate()
    return line


def test_its_words_are_shown() -> None:
    """Whether the former command line was longer or not."""
    assert shown("--number 3", 500) == ["crcolony", "robot", "--number", "3"]


def test_what_has_no_room_is_cut_off() -> None:
    """The environment behind it is not touched."""
    line = " ".join(shown("--out " + "x" * 5000, 0))
    assert line.startswith("crcolony robot --out xxx")
    assert len(line) < 5000


def test_where_nothing_can_be_shown_nothing_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on another system, which has no /proc."""
    monkeypatch.setattr("crcolony.runtime.process_title.Path", lambda _: Path("/proc/none/x"))
    show_command(["crcolony"])
