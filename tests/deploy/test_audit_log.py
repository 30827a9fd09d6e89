"""The log takes every action of several processes, goes on after damage, and never grows beyond its bound."""

import subprocess
import sys
from pathlib import Path

import pytest
from crcolony_deploy import audit_log
from crcolony_deploy.audit_log import (
    MAX_PARTS,
    AuditError,
    AuditLog,
    parts,
    read_lines,
    record_action,
)
from crcolony_deploy.audit_verification import verify_audit_log

from crcolony.protocol.identity import Identity, create_key
from tests.support.command_line import ENVIRONMENT
from tests.support.robot_stores import room_for

KEY = Identity(bytes(range(32)))

APPENDER = """
import sys
from pathlib import Path
from crcolony.protocol.identity import load_key
from crcolony_deploy.audit_log import AuditLog
log = AuditLog(Path(sys.argv[1]), load_key(Path(sys.argv[2])))
for number in range(50):
    log.append("stop", {"number": str(number), "by": sys.argv[3]})
"""


@pytest.fixture
def log(tmp_path: Path) -> AuditLog:
    return AuditLog(tmp_path / "audit.jsonl", KEY)


def fill(log: AuditLog, count: int) -> None:
    for number in range(count):
        log.append("stop", {"number": str(number)})


def test_records_are_numbered_and_in_order(log: AuditLog) -> None:
    """With the time, the action, what it was about, and who did it."""
    AuditLog(log.path, KEY, lambda: 1_790_000_000.0).append("stop", {"arena": "lab"})
    record_action(log, "release", latch=7)
    report = verify_audit_log(log.path)
    assert report.findings == []
    first, second = report.records
    assert (first.seq, first.time, first.action) == (1, "2026-09-21T14:13:20Z", "stop")
    assert (second.seq, second.details) == (2, {"latch": "7"})
    assert "@" in first.who
    assert log.path.stat().st_mode & 0o007 == 0


def test_without_a_log_nothing_is_recorded() -> None:
    """A command need not ask whether there is one."""
    assert record_action(None, "stop") is None


def test_who_became_root_is_recorded(log: AuditLog, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root alone says little."""
    monkeypatch.setenv("SUDO_USER", "ann")
    assert "(sudo by ann)@" in log.append("stop", {}).who


def test_several_processes_append_to_one_chain(tmp_path: Path) -> None:
    """All records are there, in one order."""
    create_key(tmp_path / "key")
    path = tmp_path / "audit.jsonl"
    running = [
        subprocess.Popen(
            [sys.executable, "-c", APPENDER, path, tmp_path / "key", name], env=ENVIRONMENT
        )
        for name in "abc"
    ]
    assert [process.wait(60.0) for process in running] == [0, 0, 0]
    report = verify_audit_log(path)
    assert report.findings == []
    assert [record.seq for record in report.records] == list(range(1, 151))


def test_a_line_that_was_cut_short_keeps_nobody_from_recording(log: AuditLog) -> None:
    """The next record follows on a line of its own; the damage is shown, and what comes later is in order."""
    fill(log, 2)
    log.path.write_bytes(log.path.read_bytes()[:-40])
    fill(log, 2)
    report = verify_audit_log(log.path)
    assert [record.seq for record in report.records] == [1, 2, 3]
    (finding,) = report.findings
    assert finding.startswith("audit.jsonl, line 2: no record")


def test_a_full_disk_leaves_no_half_of_a_record(log: AuditLog) -> None:
    """It is said in one line; afterwards the log is in order."""
    fill(log, 3)
    size = log.path.stat().st_size
    for room in (size, size + 100):
        with room_for(room), pytest.raises(AuditError, match="not in the audit log: "):
            log.append("stop", {})
        assert log.path.stat().st_size == size
    fill(log, 1)
    assert verify_audit_log(log.path).findings == []


def test_it_is_bounded_and_the_chain_goes_on_through_its_parts(
    log: AuditLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A part that is deleted is recorded, so that a part that somebody deletes is found."""
    monkeypatch.setattr(audit_log, "MAX_BYTES", 2000)
    fill(log, 200)
    files = parts(log.path)
    assert len(files) == MAX_PARTS + 1
    assert sum(file.stat().st_size for file in files) < (MAX_PARTS + 1) * 3000
    report = verify_audit_log(log.path)
    assert report.findings == []
    assert report.records[0].seq > 1
    files[0].unlink()
    (finding,) = verify_audit_log(log.path).findings
    assert "the earlier ones are missing" in finding
    files[5].unlink()
    assert any("missing, or out of order" in f for f in verify_audit_log(log.path).findings)


def test_where_nothing_can_be_written_that_is_said(tmp_path: Path) -> None:
    """Before an action that must not happen without a record."""
    log = AuditLog(tmp_path / "missing/audit.jsonl", KEY)
    with pytest.raises(AuditError, match=r"audit\.jsonl: not in the audit log: No such file"):
        log.check_writable()
    with pytest.raises(AuditError, match="there is no such file"):
        list(read_lines(log.path))
