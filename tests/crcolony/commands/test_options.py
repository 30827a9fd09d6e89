"""Options that several commands share become settings, folders and checks."""

import argparse

import pytest

from crcolony.commands.options import (
    UsageError,
    add_config,
    check_minutes,
    load_config,
    settings_of,
)


def test_options_become_settings_and_set_comes_last() -> None:
    """So that `--set robots=5` takes precedence over `--robots 4`."""
    parser = argparse.ArgumentParser()
    add_config(parser)
    parser.add_argument("--robots", type=int)
    options = parser.parse_args(["--set", "robots=5", "--seed", "3", "--robots", "4"])
    assert settings_of(options) == ["robots=4", "seed=3", "robots=5"]
    assert settings_of(parser.parse_args([])) == []


@pytest.mark.parametrize("minutes", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_a_duration_that_cannot_be_is_refused(minutes: float) -> None:
    """None means without end."""
    check_minutes(None)
    check_minutes(0.01)
    with pytest.raises(UsageError, match="--minutes"):
        check_minutes(minutes)


def test_what_is_possible_but_hardly_meant_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """By every command that reads a config; the config is used all the same."""
    assert load_config(None, ["learning.tilings=6"]).learning.tilings == 6
    assert capsys.readouterr().out.startswith("learning.tilings: 6 shares a factor with 3")
    load_config(None, ["learning.tilings=7"])
    assert capsys.readouterr().out == ""
