"""Frames of the serial link: COBS(version and flags, type, sequence number, payload, CRC-16), each ended by 0x00.

The firmware codes the same frames in C (`firmware/core/frame.c`); `tests/vectors/firmware_frames.json` holds both to
the same bytes. CRC-16/CCITT-FALSE lets pass one in 65,536 damaged frames: what a frame can do is limited by its time to
live, and what must not be wrong (a genotype) has a digest of its own.
"""

import binascii
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from cobs import cobs  # type: ignore[import-untyped]

VERSION = 1
MAX_PAYLOAD_BYTES = 240
_HEADER = struct.Struct("<BBH")
_CRC = struct.Struct("<H")
_MAX_ENCODED_BYTES = _HEADER.size + MAX_PAYLOAD_BYTES + _CRC.size + 1
"""Without the delimiter; COBS adds one byte to less than 254."""


class FrameError(ValueError):
    """Bytes that are no frame, or a payload that no frame holds."""


@dataclass(frozen=True)
class Frame:
    """One frame of the link, in either direction."""

    type: int
    seq: int
    payload: bytes
    version: int = VERSION
    flags: int = 0


def encode_frame(frame: Frame) -> bytes:
    """Return a frame's bytes with the delimiter; raises FrameError if its payload is too long."""
    if len(frame.payload) > MAX_PAYLOAD_BYTES:
        raise FrameError(f"a payload of {len(frame.payload)} bytes: at most {MAX_PAYLOAD_BYTES}")
    body = _HEADER.pack(frame.version << 4 | frame.flags, frame.type, frame.seq) + frame.payload
    return bytes(cobs.encode(body + _CRC.pack(binascii.crc_hqx(body, 0xFFFF)))) + b"\0"


def decode_frame(encoded: bytes) -> Frame:
    """Return the frame of these bytes, which are without the delimiter; raises FrameError if they are none."""
    if len(encoded) > _MAX_ENCODED_BYTES:
        raise FrameError("too long")
    try:
        body = bytes(cobs.decode(encoded))
    except cobs.DecodeError as error:
        raise FrameError(f"not COBS: {error}") from None
    if not _HEADER.size + _CRC.size <= len(body) <= _HEADER.size + MAX_PAYLOAD_BYTES + _CRC.size:
        raise FrameError(f"{len(body)} bytes are no frame")
    content, (crc,) = body[: -_CRC.size], _CRC.unpack(body[-_CRC.size :])
    if binascii.crc_hqx(content, 0xFFFF) != crc:
        raise FrameError("the CRC is wrong")
    first, type_, seq = _HEADER.unpack_from(content)
    return Frame(type_, seq, content[_HEADER.size :], first >> 4, first & 0x0F)


class FrameReader:
    """Splits a stream of bytes into frames. What is no frame is counted in `bad_frames`, and reading continues."""

    def __init__(self) -> None:
        self.bad_frames = 0
        self._rest = bytearray()
        self._is_overlong = False

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Yield the frames that these bytes complete."""
        *ended, rest = data.split(b"\0")
        for part in ended:
            self._append(part)
            if self._rest or self._is_overlong:
                yield from self._take()
        self._append(rest)

    def _append(self, part: bytes) -> None:
        """Collect bytes, but no more than a frame has: a sender without delimiters takes no memory."""
        room = _MAX_ENCODED_BYTES - len(self._rest)
        self._is_overlong = self._is_overlong or len(part) > room
        self._rest += part[:room]

    def _take(self) -> Iterator[Frame]:
        encoded, is_overlong = bytes(self._rest), self._is_overlong
        self._rest.clear()
        self._is_overlong = False
        try:
            if is_overlong:
                raise FrameError("too long")
            yield decode_frame(encoded)
        except FrameError:
            self.bad_frames += 1
