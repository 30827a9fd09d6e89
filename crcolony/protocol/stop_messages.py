"""The messages of the emergency stop (PROTOCOL.md, "Emergency stop")."""

from typing import Annotated

import msgspec
from msgspec import Meta

from crcolony.protocol.codec import MAX_BODY_MESSAGE_BYTES, Message, Name, StrictDecoder

MAX_ATTACHED = 32
"""Robots that one bridge reports."""
MAX_OTHERS = 64
"""Arenas and bridges that a reply names."""
MAX_REPLY_BYTES = 32_768
"""Largest `stop_reply`."""
Latch = Annotated[int, Meta(ge=0, lt=2**62)]


class Stop(Message, frozen=True, tag="stop"):
    """Stop all bodies of an arena or a bridge, and hold them. Anybody may."""

    id: Annotated[bytes, Meta(min_length=16, max_length=16)]
    """Random: a stop that was released is not repeated by a replay"""


class Clear(Message, frozen=True, tag="clear"):
    """Release robots that were stopped. It quotes the latch of that stop, so that no old one releases them."""

    latch: Latch


class StoppedRobot(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A robot of a bridge, or the bodies of an arena, and whether they have confirmed what was asked."""

    name: Annotated[str, Meta(max_length=100)]
    count: Annotated[int, Meta(ge=0, lt=2**31)]
    """How many bodies this is"""
    confirmed: bool
    trouble: Annotated[str, Meta(max_length=200)]
    """Why it has not; "" if it has"""


class StopAddress(
    msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True, order=True
):
    """A process that answers stops: the name of an arena or a bridge, which others may have too, and its session."""

    arena: Name
    session: Name


class StopReply(Message, frozen=True, tag="stop_reply"):
    """Reply of an arena or a bridge: `latch` identifies the stop that holds its bodies, 0 for none.

    Who has been away for a moment, or hangs, cannot be found by who asks now, but those that were connected before know
    it: `others` are the arenas and bridges that the replying one sees.
    """

    address: StopAddress
    latch: Latch
    robots: Annotated[list[StoppedRobot], Meta(max_length=MAX_ATTACHED)]
    others: Annotated[list[StopAddress], Meta(max_length=MAX_OTHERS)]


decode_stop = StrictDecoder[Stop | Clear](Stop | Clear, MAX_BODY_MESSAGE_BYTES).decode
decode_stop_reply = StrictDecoder[StopReply](
    StopReply, MAX_REPLY_BYTES, max(MAX_ATTACHED, MAX_OTHERS)
).decode
