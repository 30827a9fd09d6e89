"""`crcolony host`: run an arena and many robots in one process."""

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("host -n 3 --robots 2", "-n 3: the arena has 2 slots"),
        ("host -n 0", "-n 0: must be at least 1"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
