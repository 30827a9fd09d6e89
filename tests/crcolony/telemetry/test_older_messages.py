"""What an older recording contains is read."""

import msgpack  # type: ignore[import-untyped]
import pytest

from crcolony.protocol.codec import WireError
from crcolony.telemetry.older_messages import decode_metadata_of_any_age
from tests.support.wire_decoders import VECTORS


def test_metadata_without_a_schema_are_read() -> None:
    """All that they say is there, and the schema is empty."""
    name, *fields, _ = msgpack.unpackb(VECTORS["robot_metadata"])
    older = decode_metadata_of_any_age(msgpack.packb([name, *fields]))
    assert [older.robot, older.incarnation, older.settings, older.peers] == fields
    assert older.schema == ""


def test_metadata_with_a_schema_are_read() -> None:
    """As they are sent today."""
    metadata = decode_metadata_of_any_age(VECTORS["robot_metadata"])
    assert metadata.schema == msgpack.unpackb(VECTORS["robot_metadata"])[-1]


def test_malformed_metadata_are_refused() -> None:
    """A field is missing, or one is too many."""
    name, *fields = msgpack.unpackb(VECTORS["robot_metadata"])
    for malformed in ([name, *fields[:-2]], [name, *fields, ""]):
        with pytest.raises(WireError):
            decode_metadata_of_any_age(msgpack.packb(malformed))
