"""Whatever is changed, removed, put in, moved or signed by another is found, at its place."""

from collections.abc import Callable
from pathlib import Path

import pytest
from crcolony_deploy.audit_log import AuditError, AuditLog
from crcolony_deploy.audit_record import encode_record, make_record
from crcolony_deploy.audit_verification import verify_audit_log

from crcolony.protocol.identity import Identity

KEY, EVE = Identity(bytes(range(32))), Identity(bytes(32))
Lines = list[bytes]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A log of six records."""
    log = AuditLog(tmp_path / "audit.jsonl", KEY)
    for number in range(6):
        log.append("stop", {"number": str(number)})
    return log.path


def remove(lines: Lines) -> Lines:
    return lines[:2] + lines[3:]


def swap(lines: Lines) -> Lines:
    return [*lines[:2], lines[3], lines[2], *lines[4:]]


def double(lines: Lines) -> Lines:
    return [*lines[:3], lines[2], *lines[3:]]


def change(lines: Lines) -> Lines:
    return [*lines[:2], lines[2].replace(b'"2"', b'"7"'), *lines[3:]]


def put_in(lines: Lines) -> Lines:
    own = make_record(EVE, 3, "", "eve@lab", "stop", {}, "")
    return [*lines[:2], encode_record(own), *lines[2:]]


def begin_later(lines: Lines) -> Lines:
    return lines[2:]


def rewrite(lines: Lines) -> Lines:
    return [*lines[:2], b"nothing to see", *lines[3:]]


@pytest.mark.parametrize(
    ("sabotage", "finding"),
    [
        (remove, "line 3: record 4: follows record 2"),
        (swap, "line 3: record 4: follows record 2"),
        (double, "line 4: record 3: follows record 3"),
        (change, "line 3: record 3: its signature is wrong"),
        (put_in, "line 3: record 3: it does not refer to the line before"),
        (begin_later, "it begins with record 3"),
        (rewrite, "line 3: no record"),
    ],
)
def test_what_was_done_to_a_log_is_found(
    path: Path, sabotage: Callable[[Lines], Lines], finding: str
) -> None:
    """The line, the record, and what is wrong with it."""
    path.write_bytes(b"\n".join(sabotage(path.read_bytes().split(b"\n"))))
    findings = verify_audit_log(path).findings
    assert finding in findings[0], findings


def test_a_chain_that_another_has_written_anew_is_of_another_key(
    tmp_path: Path, path: Path
) -> None:
    """Whoever holds another key can write a whole log, but not in the name of this one."""
    forged = AuditLog(tmp_path / "forged.jsonl", EVE)
    for number in range(6):
        forged.append("stop", {"number": str(number)})
    assert verify_audit_log(forged.path).findings == []
    findings = verify_audit_log(forged.path, [KEY.id.hex()]).findings
    assert len(findings) == 6
    assert "which is not trusted" in findings[0]
    assert verify_audit_log(path, [KEY.id.hex(), EVE.id.hex()]).findings == []


@pytest.mark.parametrize("content", [b"", b"\n", b"no log\n", b"\0\xff" * 100])
def test_what_is_no_log_is_refused(tmp_path: Path, content: bytes) -> None:
    """In one line."""
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(AuditError, match="not an audit log"):
        verify_audit_log(tmp_path / "file")
