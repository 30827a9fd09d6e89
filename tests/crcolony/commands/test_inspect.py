"""`crcolony inspect`: print what is in a robot's file."""

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("inspect missing", "missing: not a crcolony robot file: there is no such file"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
