"""`crcolony check` validates a config file."""

from pathlib import Path

import pytest

from tests.support.command_line import Refused, run_command


def test_a_config_is_valid_or_its_error_is_printed(tmp_path: Path) -> None:
    """A valid file, and one with a misspelt key."""
    path = tmp_path / "my.toml"
    path.write_text("robots = 6\n")
    assert run_command("check", path).stdout == f"{path}: valid\n"
    path.write_text("robotts = 6\n")
    done = run_command("check", path)
    assert done.returncode == 2
    assert (
        done.stderr
        == f"crcolony: {path}: robotts: there is no such setting; did you mean robots?\n"
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("check missing.toml", "missing.toml: cannot be read"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
