"""`crcolony bridge`: attach physical robots."""

from pathlib import Path

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("bridge", "--robot is missing: which robot?"),
        ("bridge --robot /dev/ttyACM0", "--robot /dev/ttyACM0: expected DRIVER@ADDRESS"),
        ("bridge --robot firmwar@/dev/x", "no driver is called firmwar; did you mean firmware?"),
        ("bridge --robot firmware@tcp:here", "tcp:here: expected tcp:HOST:PORT"),
        ("bridge --robot firmware@/dev/null", "/dev/null: "),
        ("bridge --robot firmware@/etc/passwd", "/etc/passwd: not a serial device"),
        ("bridge --robot a@b --hz 0", "--hz 0: must be from 1 to 100"),
        ("bridge --robot a@b --hz nan", "--hz nan: must be"),
        ("bridge --robot a@b --energy-per-charge -1", "--energy-per-charge -1: from 0"),
        ("bridge" + " --robot a@b" * 33, "33 robots: a bridge has at most 32"),
        ("bridge --robot a@b --arena a/b", "--arena 'a/b': letters, digits"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or device, and the reason."""
    assert line in refused(words)


def test_a_folder_is_no_device(refused: Refused, tmp_path: Path) -> None:
    """Nor is any other file."""
    assert "not a serial device" in refused(f"bridge --robot firmware@{tmp_path}")


def test_without_its_packages_it_says_how_to_install_them(
    refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after a plain pip install of the core."""
    monkeypatch.setattr("crcolony.commands.bridge.find_spec", lambda name: None)
    assert "pip install 'crcolony[bridge]'" in refused("bridge list")
