"""`crcolony keygen`: generate a robot's key."""

from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.protocol.identity import load_key
from tests.support.command_line import Refused, refusal


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("keygen /proc/none/key", "/proc/none/key: cannot be written"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_a_key_is_generated_once(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The id of its robot is printed; a file that exists is never overwritten."""
    assert main(["keygen", str(tmp_path / "key")]) == 0
    identity = load_key(tmp_path / "key")
    printed = capsys.readouterr().out
    assert printed == f"{tmp_path / 'key'}: the secret key of robot {identity.id.hex()}\n"
    refusal(capsys, "keygen", tmp_path / "key")
    assert load_key(tmp_path / "key").id == identity.id
