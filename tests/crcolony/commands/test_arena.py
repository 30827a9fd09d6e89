"""`crcolony arena`: run an arena that robots of any machine can join."""

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("arena --hz 0", "--hz 0: must be from 0.001 to 10000"),
        ("arena --speed nan", "--speed nan: must be"),
        ("arena --expect 9 --robots 4", "--expect 9: from 1 to 4, the slots of the arena"),
        ("arena --arena a/b", "--arena 'a/b': letters, digits"),
        ("arena --robots 0", "robots: expected"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
