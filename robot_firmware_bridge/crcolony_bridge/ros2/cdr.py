"""CDR, the encoding of ROS 2 messages: plain, little-endian, every number aligned to its own size.

A message is a frozen dataclass whose fields are annotated with the types below, with `str`, or with another such class.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, TypeVar, get_type_hints

_T = TypeVar("_T")
_HEADER = bytes((0, 1, 0, 0))
"""Plain CDR, little-endian, without options."""


class CdrError(Exception):
    """Bytes are no message of the expected type."""


@dataclass(frozen=True)
class Numbers:
    """Numbers of one format of `struct`: `count` of them, or as many as a length before them says."""

    format: str
    count: int | None = None


Bool = Annotated[bool, "?"]
UInt8 = Annotated[int, "B"]
Int32 = Annotated[int, "i"]
UInt32 = Annotated[int, "I"]
Float32 = Annotated[float, "f"]
Float64 = Annotated[float, "d"]
Float32Sequence = Annotated[tuple[float, ...], Numbers("f")]
Covariance = Annotated[tuple[float, ...], Numbers("d", 36)]


def encode(message: object) -> bytes:
    """Return the bytes of a message."""
    body = bytearray()
    _write(body, type(message), message)
    return _HEADER + bytes(body)


def decode(message_class: type[_T], data: bytes) -> _T:
    """Return the message; raises CdrError for anything else than exactly one message of this class."""
    if data[:2] != _HEADER[:2]:
        raise CdrError("not plain CDR, little-endian")
    reader = _Reader(data[len(_HEADER) :])
    message = _read(reader, message_class)
    if reader.unread_bytes > 3:  # up to three are padding, which some add
        raise CdrError(f"{reader.unread_bytes} bytes too many")
    assert isinstance(message, message_class)
    return message


class _Reader:
    """Takes values from the bytes after the header, to which their alignment is relative."""

    def __init__(self, body: bytes) -> None:
        self._body, self._offset = body, 0

    @property
    def unread_bytes(self) -> int:
        return len(self._body) - self._offset

    def numbers(self, number_format: str, count: int) -> tuple[Any, ...]:
        """Return numbers of one format, as the next ones in the bytes."""
        size = struct.calcsize(number_format)
        start = self._offset + -self._offset % size if count else self._offset
        end = start + size * count
        if end > len(self._body):  # before anything is allocated for what is not there
            raise CdrError("cut short")
        self._offset = end
        return struct.unpack_from(f"<{count}{number_format}", self._body, start)

    def text(self) -> str:
        """Return the next string, whose length counts the zero byte at its end."""
        (size,) = self.numbers("I", 1)
        raw = bytes(self.numbers("B", size))
        if raw and raw[-1]:
            raise CdrError("a string without an end")
        try:
            return raw[:-1].decode()
        except UnicodeDecodeError:
            raise CdrError("a string that is not UTF-8") from None


@cache
def _fields(message_class: type) -> tuple[tuple[str, Any, Any], ...]:
    """Return name, class and format of every field; the format is None for strings and messages."""
    hints = get_type_hints(message_class, include_extras=True)
    return tuple(
        (name, getattr(hint, "__origin__", hint), getattr(hint, "__metadata__", (None,))[0])
        for name, hint in hints.items()
    )


def _read(reader: _Reader, message_class: Callable[..., Any]) -> Any:
    values: list[Any] = []
    for _, field_class, number_format in _fields(message_class):
        if isinstance(number_format, Numbers):
            count = number_format.count
            count = reader.numbers("I", 1)[0] if count is None else count
            values.append(reader.numbers(number_format.format, count))
        elif number_format is not None:
            values += reader.numbers(number_format, 1)
        elif field_class is str:
            values.append(reader.text())
        else:
            values.append(_read(reader, field_class))
    return message_class(*values)


def _write(body: bytearray, message_class: type, message: object) -> None:
    for name, field_class, number_format in _fields(message_class):
        value = getattr(message, name)
        if isinstance(number_format, Numbers):
            if number_format.count is None:
                _write_numbers(body, "I", len(value))
            _write_numbers(body, number_format.format, *value)
        elif number_format is not None:
            _write_numbers(body, number_format, value)
        elif field_class is str:
            raw = value.encode() + b"\0"
            _write_numbers(body, "I", len(raw))
            body += raw
        else:
            _write(body, field_class, value)


def _write_numbers(body: bytearray, number_format: str, *values: Any) -> None:
    if values:
        body += bytes(-len(body) % struct.calcsize(number_format))
        body += struct.pack(f"<{len(values)}{number_format}", *values)
