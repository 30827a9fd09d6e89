"""`crcolony audit` prints what operators did, and says whether that is all of it."""

from pathlib import Path

import pytest
from crcolony_deploy.audit_log import AuditLog

from crcolony.cli import main
from crcolony.errors import EXIT_VIOLATED
from crcolony.protocol.identity import create_key
from tests.support.command_line import refusal


@pytest.fixture
def log(tmp_path: Path) -> AuditLog:
    """Three actions."""
    log = AuditLog(tmp_path / "audit.jsonl", create_key(tmp_path / "key"))
    for number in range(3):
        log.append("stop", {"arena": f"the lab {number}"})
    return log


def test_a_log_in_order_is_confirmed_and_its_end_is_to_be_noted(
    log: AuditLog, capsys: pytest.CaptureFixture[str]
) -> None:
    """With that digest a later check finds that the end was cut off."""
    assert main(["audit", "verify", str(log.path)]) == 0
    first, second, third = capsys.readouterr().out.splitlines()
    assert first.startswith("records 1 to 3 are in order")
    assert "any key was accepted" in second
    digest = third.split()[-1]
    assert main(["audit", "verify", str(log.path), "--contains", digest]) == 0
    log.path.write_bytes(b"".join(line + b"\n" for line in log.path.read_bytes().split(b"\n")[:2]))
    assert main(["audit", "verify", str(log.path)]) == 0, "a chain alone cannot show it"
    assert main(["audit", "verify", str(log.path), "--contains", digest]) == EXIT_VIOLATED
    assert "the end was cut off" in capsys.readouterr().out


def test_a_log_that_was_changed_has_another_exit_code(
    log: AuditLog, capsys: pytest.CaptureFixture[str]
) -> None:
    """And each place is a line."""
    log.path.write_bytes(log.path.read_bytes().replace(b"lab 1", b"lab 7"))
    assert main(["audit", "verify", str(log.path)]) == EXIT_VIOLATED
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("NOT IN ORDER: audit.jsonl, line 2: record 2: its signature")


def test_the_last_records_are_shown(log: AuditLog, capsys: pytest.CaptureFixture[str]) -> None:
    """A line each."""
    assert main(["audit", "show", str(log.path), "--last", "1"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("3 2")
    assert line.endswith(": stop arena='the lab 2'")


def test_wrong_options_are_refused(log: AuditLog, capsys: pytest.CaptureFixture[str]) -> None:
    """In one line."""
    path = str(log.path)
    for words, reason in (
        (("verify", path, "--by", "x"), "expected ids of 32 hex digits"),
        (("verify", path, "--contains", "x"), "expected 16 to 64 hex digits"),
        (("show", path, "--last", "0"), "must be at least 1"),
        (("verify", f"{path}.none"), "there is no such file"),
    ):
        assert reason in refusal(capsys, "audit", *words)
