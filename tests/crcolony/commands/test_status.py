"""`crcolony status`: print the robots that are online."""

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("status --seconds -1", "--seconds -1: must be above 0 and at most 600"),
        ("status --client --connect tcp/127.0.0.1:9", "no router answers at tcp/127.0.0.1:9"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
