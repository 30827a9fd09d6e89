"""Options that several commands share become settings, folders and checks."""

import argparse
from pathlib import Path

import pytest

from crcolony.commands.options import UsageError, add_config, check_minutes, new_folder, settings_of


def test_options_become_settings_and_set_comes_last() -> None:
    """So that `--set robots=5` takes precedence over `--robots 4`."""
    parser = argparse.ArgumentParser()
    add_config(parser)
    parser.add_argument("--robots", type=int)
    options = parser.parse_args(["--set", "robots=5", "--seed", "3", "--robots", "4"])
    assert settings_of(options) == ["robots=4", "seed=3", "robots=5"]
    assert settings_of(parser.parse_args([])) == []


def test_a_new_folder_has_the_first_free_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is not made yet."""
    monkeypatch.chdir(tmp_path)
    for number in (1, 2, 4):
        (tmp_path / "runs" / str(number)).mkdir(parents=True)
    assert new_folder() == Path("runs/3")
    assert not new_folder().exists()


@pytest.mark.parametrize("minutes", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_a_duration_that_cannot_be_is_refused(minutes: float) -> None:
    """None means without end."""
    check_minutes(None)
    check_minutes(0.01)
    with pytest.raises(UsageError, match="--minutes"):
        check_minutes(minutes)
