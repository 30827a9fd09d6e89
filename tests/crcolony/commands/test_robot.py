"""`crcolony robot`: run one robot."""

import sqlite3
from pathlib import Path

import pytest

from crcolony.protocol.identity import create_key
from tests.support.command_line import Refused, refusal


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("robot --out x --colony 'a b'", "--colony"),
        ("robot --out x --repeatable", "--repeatable needs --number"),
        ("robot --out x --snapshot 0", "--snapshot 0: must be from 0.1 to 86400 seconds"),
        ("robot --out x --connect nowhere", "nowhere: not an endpoint"),
        ("robot --out x --connect tcp/127.0.0.1:99999", "not an endpoint"),
        ("robot --out x --connect tcp/127.0.0.1:²", "not an endpoint"),
        ("robot --out x --interface lo", "interface lo: it has no multicast"),
        (
            "robot --out x --client --listen tcp/127.0.0.1:1",
            "--client cannot be used with --listen or --interface",
        ),
        ("robot --out x --key missing", "missing: cannot be read: No such file"),
        ("robot --out x --allow missing", "missing: cannot be read"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


ENDPOINT = "tcp/127.0.0.1:17447"


def test_a_key_that_others_may_read_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """The line names the file, and how to correct it."""
    create_key(tmp_path / "key")
    (tmp_path / "key").chmod(0o644)
    line = refusal(capsys, "robot", "--out", tmp_path, "--connect", ENDPOINT)
    assert f"{tmp_path / 'key'}: others may read this key; chmod 600" in line


def test_a_file_of_a_newer_version_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """It is not changed."""
    refused = tmp_path / "robot.sqlite"
    with sqlite3.connect(refused) as database:
        database.execute("PRAGMA application_id = 0x43524D59")
        database.execute("PRAGMA user_version = 99")
    database.close()
    line = refusal(capsys, "robot", "--out", tmp_path, "--connect", ENDPOINT)
    assert f"{refused}: " in line
    assert "newer" in line


def test_a_file_of_another_kind_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """It is left as it is."""
    content = "not a database, but long enough to be looked at" * 99
    (tmp_path / "robot.sqlite").write_text(content)
    line = refusal(capsys, "robot", "--out", tmp_path, "--connect", ENDPOINT)
    assert "robot.sqlite: not a crcolony robot file" in line
    assert (tmp_path / "robot.sqlite").read_text() == content
