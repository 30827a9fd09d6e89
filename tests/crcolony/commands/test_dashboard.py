"""`crcolony dashboard`: show colonies live."""

import pytest

from tests.support.command_line import Refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("dashboard --port 0", "--port 0: must be from 1 to 65535"),
        ("dashboard --web-port 65536", "--web-port 65536: must be from 1 to 65535"),
        ("dashboard --no-recording --out x", "--no-recording cannot be used with --out"),
        ("dashboard --keep-hours 0", "--keep-hours 0: must be above 0"),
        ("dashboard --minutes 0", "--minutes 0: must be above 0"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)
