"""`crcolony config`: print the effective settings as TOML to start from."""

from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.config import Config, load
from tests.support.command_line import Refused


def test_what_is_printed_is_read_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the settings of a file and of the options."""
    path = tmp_path / "my.toml"
    path.write_text("[life]\nagents = 7\n")
    words = ["config", "--config", str(path), "-n", "6", "--seed", "9", "--set", "life.slices=2"]
    assert main(words) == 0
    path.write_text(capsys.readouterr().out)
    assert load(path) == load(None, ["life.agents=7", "robots=6", "seed=9", "life.slices=2"])
    assert load(path) != Config()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("config -n 0", "robots: expected"),
        ("config --config missing.toml", "missing.toml: cannot be read"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
