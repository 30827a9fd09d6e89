"""`crcolony simulate`: test colonies in virtual time."""

import pytest

from crcolony.cli import main
from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("simulate --seeds 0", "--seeds must be at least 1"),
        ("simulate --robots 1", "--robots 1: must be from 2 to 50"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_a_colony_without_violations_ends_with_exit_code_0(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """With --quiet only the totals are printed."""
    assert main(["simulate", "--seeds", "1", "--robots", "2", "--quiet"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "compiles" not in line]
    assert lines[0].startswith("1 colonies: ")
    assert lines[1:] == ["no violations"]
