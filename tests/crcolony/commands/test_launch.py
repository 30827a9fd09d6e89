"""`crcolony launch`: start an arena and robots, each its own process."""

from pathlib import Path

import pytest

from crcolony.config import Config
from crcolony.results.colony_folder import open_colony_folder
from tests.support.command_line import Refused, refusal


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("launch -n 0", "-n 0: must be at least 1"),
        ("launch -n 3 --robots 2", "-n 3: the arena has 2 slots"),
        ("launch --robots-only --lockstep", "--robots-only: the arena determines the clock"),
        ("launch --minutes 0", "--minutes 0: must be above 0"),
        ("launch --set life.agents=0", "life.agents: expected"),
        ("launch --hz 5 --speed 2", "not allowed with argument --hz"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_a_folder_of_another_colony_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """A colony is continued only with its own settings, and never in a folder of something else."""
    open_colony_folder(tmp_path / "seven", "launch", Config(robots=7), None).__exit__()
    line = refusal(capsys, "launch", "--seed", "3", "--out", tmp_path / "seven")
    assert "seven: holds a colony of other settings: seed is 1 there, 3 here" in line
    line = refusal(capsys, "launch", "-n", "8", "--out", tmp_path / "seven")
    assert "-n 8: the arena has 7 slots" in line
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").touch()
    line = refusal(capsys, "launch", "--out", tmp_path / "other")
    assert "not empty; choose another --out" in line
