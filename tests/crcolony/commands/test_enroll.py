"""`crcolony enroll`: get the credentials of a member of a deployment, or its next certificate."""

import io
from pathlib import Path

import pytest

from crcolony.cli import main
from crcolony.protocol.identity import create_key
from crcolony.transport.zenoh_session import free_port
from tests.support.command_line import Refused, start_command, wait_for_line


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("enroll robot kitchen --out c", "one of the arguments --invitation --renew"),
        (
            "enroll robot kitchen --out c --invitation x --at 10.0.0.5:1",
            "an invitation is 8 digits",
        ),
        ("enroll --out c --invitation x", "which member?"),
        ("enroll robot kitchen --out c --invitation x --at here", "--at here: expected HOST:PORT"),
        ("enroll robot kitchen --out c --invitation x", "--at HOST:PORT: where is the authority"),
        ("enroll robot a.b --out c --invitation x", "a member's name has"),
        ("enroll robot x --key none --out c --request r", "none: cannot be read"),
        ("enroll --renew --out none", "none/enrollment.json: No such file"),
        ("enroll --renew --if-due --out none", "none/identity.pem: No such file"),
        ("enroll --install none --out c", "none: No such file"),
    ],
)
def test_wrong_options_are_refused_in_one_line(words: str, line: str, refused: Refused) -> None:
    """The line names the option or file, and the reason."""
    assert line in refused(words)


def test_a_robot_enrolls_with_what_an_invitation_prints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The two machines of a person: the authority is served on one, and the line is typed on the other."""
    authority, out = tmp_path / "authority", tmp_path / "credentials"
    create_key(tmp_path / "key")
    assert main(["authority", "create", str(authority)]) == 0
    address = f"127.0.0.1:{free_port()}"
    service = start_command("authority", "serve", authority, "--at", address)
    try:
        wait_for_line(service, f"authority of colony colony at {address}")
        capsys.readouterr()
        assert main(["authority", "invite", str(authority), "robot", "kitchen"]) == 0
        line = capsys.readouterr().out.splitlines()[-1].split()
        assert line[0] == "crcolony"
        monkeypatch.setattr("sys.stdin", io.StringIO(line[-1] + "\n"))
        line[-1] = "-"  # piped in: typed on the command line, a list of processes would have it
        filled = {"FILE": str(tmp_path / "key"), "DIR": str(out), "HOST:PORT": address}
        assert main([filled.get(word, word) for word in line[1:]]) == 0
        assert main(["enroll", "--renew", "--if-due", "--out", str(out)]) == 0
        assert "not due" in capsys.readouterr().out
        assert main(["enroll", "--renew", "--out", str(out)]) == 0
        assert "another certificate of robot.kitchen" in capsys.readouterr().out
    finally:
        service.terminate()
        output, _ = service.communicate(timeout=10)
    assert service.returncode == 0
    assert output.splitlines() == [
        "robot.kitchen is enrolled",
        "robot.kitchen has another certificate",
    ]
