"""`crcolony replay`: show a finished run in the dashboard."""

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("replay missing", "missing"),
        ("replay . --seconds -1", "--seconds -1: must be 0 or more"),
        ("replay . --generations 1,x", "--generations 1,x: expected numbers, as in 0,10,249"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
