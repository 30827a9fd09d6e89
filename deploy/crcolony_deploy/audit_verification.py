"""Checks an audit log from its first record to its last: which records are missing, changed, or of another key."""

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from crcolony_deploy.audit_log import ROTATED, AuditError, read_lines
from crcolony_deploy.audit_record import AuditRecord, decode_record, digest_of_line


@dataclass
class AuditReport:
    """What a check has found."""

    records: list[AuditRecord] = field(default_factory=list)
    """Those that are whole, in order"""
    digests: list[str] = field(default_factory=list)
    """Of their lines"""
    findings: list[str] = field(default_factory=list)
    """One line for every place where the chain breaks; none: nothing was changed, but perhaps the end was cut off"""

    @property
    def signers(self) -> list[str]:
        """The ids of all keys that signed, sorted."""
        return sorted({record.signer for record in self.records})


def verify_audit_log(path: Path, trusted: Collection[str] | None = None) -> AuditReport:
    """Check every line of a log and of its earlier parts; raises AuditError if it is no audit log at all.

    `trusted` are the ids of the keys that may sign; None: any key, if only each record is signed by its own.
    """
    report, before, is_known = AuditReport(), b"", False
    for file, number, line in read_lines(path):
        record = decode_record(line)
        place = f"{file.name}, line {number}"
        if record is None:
            report.findings.append(f"{place}: no record: cut short by a power cut, or changed")
            before, is_known = line, True
            continue
        last = report.records[-1] if report.records else None
        what = _broken(record, last, digest_of_line(before) if is_known else None, trusted)
        report.findings += [f"{place}: record {record.seq}: {text}" for text in what]
        report.records.append(record)
        report.digests.append(digest_of_line(line))
        before, is_known = line, True
    if not report.records:
        raise AuditError(f"{path}: not an audit log: no record is in it")
    first = report.records[0].seq
    if first > 1 and not _is_deletion_recorded(report.records, first - 1):
        report.findings.insert(0, f"it begins with record {first}: the earlier ones are missing")
    return report


def _broken(
    record: AuditRecord,
    last: AuditRecord | None,
    digest: str | None,
    trusted: Collection[str] | None,
) -> list[str]:
    """Return what is wrong with a record after `last`, whose line or what stands after it has this digest."""
    found = []
    if not record.is_signed:
        found.append("its signature is wrong: it was changed")
    if trusted is not None and record.signer not in trusted:
        found.append(f"signed by {record.signer}, which is not trusted")
    if last is not None and record.seq != last.seq + 1:
        found.append(f"follows record {last.seq}: records between are missing, or out of order")
    if digest is not None and record.previous != digest:
        found.append("it does not refer to the line before: that was changed, removed or put in")
    if digest is None and record.seq == 1 and record.previous:
        found.append("it is the first and refers to one before")
    return found


def _is_deletion_recorded(records: list[AuditRecord], up_to: int) -> bool:
    return any(
        record.action == ROTATED and record.details.get("deleted_up_to") == str(up_to)
        for record in records
    )
