"""`crcolony estop`: stop all attached robots at once; with robots it is tested in tests/system/test_bridge.py."""

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("estop --arena a/b", "--arena 'a/b': letters, digits"),
        ("estop --clear -1", "--clear -1: expected the number that estop has printed"),
        ("estop --clear seven", "argument --clear: invalid int value"),
        ("estop --connect nowhere", "nowhere"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option, and the reason."""
    assert line in refused(words)
