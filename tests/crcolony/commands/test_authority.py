"""`crcolony authority`: admit the members of a deployment, and revoke them."""

import json
from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.protocol.identity import create_key
from crcolony.transport.credentials import load_credentials
from tests.support.command_line import Refused


@pytest.fixture
def authority(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """The folder of an authority."""
    folder = tmp_path / "authority"
    assert main(["authority", "create", str(folder), "--colony", "lab"]) == 0
    capsys.readouterr()
    return folder


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("authority", "the following arguments are required: ACTION"),
        ("authority create authority --colony a/b", "--colony 'a/b'"),
        ("authority create authority --lifetime-h 0", "certificates are valid for at most"),
        ("authority members missing", "missing: No such file or directory"),
        ("authority invite authority king x", "invalid choice: 'king'"),
        ("authority invite authority robot a.b", "a member's name has"),
        ("authority invite authority robot x --minutes 0", "--minutes 0"),
        ("authority serve missing --at nowhere", "--at nowhere: expected HOST:PORT"),
        ("authority revoke missing x", "missing: No such file or directory"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_members_come_by_file_where_no_network_is(
    authority: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A request is carried there and a grant back; both contain no secret."""
    key = create_key(tmp_path / "key")
    out, request, grant = tmp_path / "kitchen", tmp_path / "request", tmp_path / "grant"
    asking = ["enroll", "robot", "kitchen", "--key", str(tmp_path / "key"), "--out", str(out)]
    assert main([*asking, "--request", str(request)]) == 0
    assert main(["authority", "issue", str(authority), str(request), str(grant)]) == 0
    assert main(["enroll", "--install", str(grant), "--out", str(out)]) == 0
    assert load_credentials(out).record.common_name == "robot.kitchen"
    assert "PRIVATE" not in request.read_text() + grant.read_text()
    capsys.readouterr()
    assert main(["authority", "members", str(authority)]) == 0
    printed = capsys.readouterr().out
    assert "colony lab, roster 2, 1 members" in printed
    assert f"robot.kitchen                    {key.id.hex()}" in printed


def test_a_revocation_that_is_not_published_says_so(
    authority: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It names what is needed, and is in force where the roster is brought."""
    request, grant = tmp_path / "request", tmp_path / "grant"
    asking = ["enroll", "observer", "wall", "--out", str(tmp_path / "wall")]
    assert main([*asking, "--request", str(request)]) == 0
    assert main(["authority", "issue", str(authority), str(request), str(grant)]) == 0
    capsys.readouterr()
    assert main(["authority", "revoke", str(authority), "wall"]) == 0
    printed = capsys.readouterr().out
    assert "observer.wall is revoked in roster 3" in printed
    assert "not published: name an operator's --credentials" in printed
    assert main(["authority", "members", str(authority)]) == 0
    assert "REVOKED" in capsys.readouterr().out
    assert main(["authority", "issue", str(authority), str(request), str(grant)]) == 2
    assert main(["authority", "reinstate", str(authority), "wall"]) == 0
    assert main(["authority", "issue", str(authority), str(request), str(grant)]) == 0


def test_an_invitation_prints_what_is_typed_on_the_robot(
    authority: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its PIN is shown once."""
    assert main(["authority", "invite", str(authority), "host", "big"]) == 0
    printed = capsys.readouterr().out
    assert "crcolony enroll host big --key FILE --arena NAME --out DIR --at HOST:PORT" in printed
    pin = printed.partition("--invitation ")[2].partition("-")[0]
    assert len(pin) == 8
    stored = json.loads((authority / "invitations.json").read_text())
    assert pin not in json.dumps(stored)
