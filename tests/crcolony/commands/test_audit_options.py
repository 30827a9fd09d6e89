"""What commands record: who stopped and restored what, and that a stop never waits for the log."""

from pathlib import Path

import pytest
from crcolony_deploy.audit_verification import verify_audit_log

from crcolony.cli import main
from crcolony.commands.audit_options import AUDIT, AUDIT_KEY
from crcolony.errors import EXIT_NOT_CONFIRMED
from crcolony.protocol.identity import create_key
from crcolony.transport.zenoh_session import free_port
from tests.support.backed_up_robots import make_robot
from tests.support.command_line import refusal
from tests.support.process_colony import colony


@pytest.fixture
def backup(tmp_path: Path) -> list[str]:
    """The words that restore a backup; beside it is a key for the log."""
    make_robot(tmp_path / "robot")
    main(["backup", str(tmp_path / "robot"), "--to", str(tmp_path / "b.tar")])
    create_key(tmp_path / "key")
    return ["restore", str(tmp_path / "b.tar"), "--out", str(tmp_path / "restored")]


def test_a_restore_is_recorded(tmp_path: Path, backup: list[str]) -> None:
    """With the archive, the folder and the robots."""
    log = tmp_path / "audit.jsonl"
    assert main([*backup, "--audit", str(log), "--audit-key", str(tmp_path / "key")]) == 0
    (record,) = verify_audit_log(log).records
    assert record.action == "restore"
    assert record.details["folder"] == str(tmp_path / "restored")


def test_the_environment_says_where_to_record(
    tmp_path: Path, backup: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """For every command of an operator."""
    monkeypatch.setenv(AUDIT, str(tmp_path / "audit.jsonl"))
    monkeypatch.setenv(AUDIT_KEY, str(tmp_path / "key"))
    assert main(backup) == 0
    assert len(verify_audit_log(tmp_path / "audit.jsonl").records) == 1


def test_what_cannot_be_recorded_is_not_restored(
    tmp_path: Path, backup: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """A log without a key, a key without a log, a log that cannot be written, a key that cannot be read."""
    log, key = str(tmp_path / "audit.jsonl"), str(tmp_path / "key")
    for words, reason in (
        (["--audit", log], "needs --audit-key"),
        (["--audit-key", key], "--audit-key needs --audit"),
        (["--audit", "/proc/none/x", "--audit-key", key], "not in the audit log"),
        (["--audit", log, "--audit-key", "/proc/none"], "cannot be read"),
    ):
        assert reason in refusal(capsys, *backup, *words)
    assert not (tmp_path / "restored").exists()


def test_a_stop_and_its_release_are_recorded(tmp_path: Path) -> None:
    """Of a real arena: how many bodies confirmed it, and the number that releases them."""
    create_key(tmp_path / "key")
    log = tmp_path / "audit.jsonl"
    with colony(tmp_path) as made:
        made.arena(2)
        robot = made.robot()
        robot.wait_for("has body")
        words = [
            "--connect",
            made.endpoint,
            "--audit",
            str(log),
            "--audit-key",
            str(tmp_path / "key"),
        ]
        assert main(["estop", *words]) == 0
        (stop,) = verify_audit_log(log).records
        assert main(["estop", "--clear", stop.details["latch"], *words]) == 0
    _, release = verify_audit_log(log).records
    assert (stop.action, release.action) == ("stop", "release")
    assert stop.details["confirmed"] == stop.details["bodies"] == "1"
    assert release.details["latch"] == stop.details["latch"]


def test_trouble_with_the_log_keeps_nobody_from_stopping(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is said after the stop, and the exit code is that of the stop."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    words = ["estop", "--connect", endpoint, "--audit", "/proc/none/x", "--audit-key", "/proc/none"]
    assert main(words) == EXIT_NOT_CONFIRMED
    printed = capsys.readouterr()
    assert "nobody can be reached" in printed.out
    assert printed.err.count("\n") == 1
    assert "cannot be read" in printed.err
