"""A record is one line of one form, signed by whoever wrote it, and no other text is it."""

import msgspec
import pytest
from crcolony_deploy.audit_record import (
    MAX_CHARACTERS,
    AuditRecord,
    decode_record,
    encode_record,
    make_record,
)

from crcolony.protocol.identity import Identity

KEY = Identity(bytes(range(32)))


def a_record(**details: str) -> AuditRecord:
    return make_record(KEY, 1, "2026-01-02T03:04:05Z", "ann@lab", "stop", details, "")


def test_a_record_is_read_as_it_was_written() -> None:
    """With its signature; details are in the order of their names."""
    record = a_record(latch="7", arena="lab\n\x1b[31m")
    line = encode_record(record)
    assert b"\n" not in line
    assert decode_record(line) == record
    assert record.is_signed
    assert record.signer == KEY.id.hex()


@pytest.mark.parametrize(
    "change", [{"seq": 2}, {"who": "eve@lab"}, {"action": "go"}, {"details": {}}, {"time": ""}]
)
def test_a_changed_record_is_not_signed(change: dict[str, object]) -> None:
    """Whichever field was changed."""
    assert not msgspec.structs.replace(a_record(latch="7"), **change).is_signed


def test_a_signature_of_another_purpose_is_none() -> None:
    """The bytes alone, signed by the same key as a message of a robot could be, are no record."""
    record = msgspec.structs.replace(a_record(), signature="")
    forged = KEY.sign(encode_record(record)).hex()
    assert not msgspec.structs.replace(record, signature=forged).is_signed


def test_a_record_has_one_form() -> None:
    """Another text for the same record would have another digest."""
    line = encode_record(a_record())
    for other in (line + b" ", line.replace(b":1,", b": 1,", 1), b"{}", b"", b"\xff", line[:-1]):
        assert decode_record(other) is None


def test_a_long_text_is_cut() -> None:
    """So that no caller fills the log."""
    assert len(a_record(what="x" * 10_000).details["what"]) == MAX_CHARACTERS
