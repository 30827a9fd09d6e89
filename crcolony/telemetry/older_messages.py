"""Messages in the form that older recordings contain."""

from typing import Annotated

from msgspec import Meta

from crcolony.protocol.codec import (
    MAX_ENVELOPE_BYTES,
    Id,
    Message,
    Ordinal,
    StrictDecoder,
    WireError,
)
from crcolony.protocol.telemetry_messages import (
    MAX_REPORTED_PEERS,
    MAX_ROBOT_SETTINGS,
    RobotMetadata,
    decode_robot_metadata,
)


class _MetadataWithoutSchema(Message, frozen=True, tag="robot_metadata"):
    """Robots said their settings and peers before they said the schema of their genes."""

    robot: Id
    incarnation: Ordinal
    settings: Annotated[str, Meta(max_length=MAX_ROBOT_SETTINGS)]
    peers: Annotated[list[Id], Meta(max_length=MAX_REPORTED_PEERS)]


_decode_without_schema = StrictDecoder[_MetadataWithoutSchema](
    _MetadataWithoutSchema, MAX_ENVELOPE_BYTES, MAX_REPORTED_PEERS
).decode


def decode_metadata_of_any_age(data: bytes) -> RobotMetadata:
    """Return a robot's metadata, with an empty schema if they say none; raise WireError if they are malformed."""
    try:
        return decode_robot_metadata(data)
    except WireError as error:
        try:
            older = _decode_without_schema(data)
        except WireError:
            raise error from None
    return RobotMetadata(older.robot, older.incarnation, older.settings, older.peers, "")
