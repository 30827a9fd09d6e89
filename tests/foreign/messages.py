"""The messages (PROTOCOL.md, "Messages"): arrays in MessagePack, written in one form only, every field checked."""

import math
import re
import struct
from collections.abc import Callable
from typing import Any, Final

import msgpack  # type: ignore[import-untyped]

Message = list[Any]
Check = Callable[[Any], bool]

OBSERVATION_COLUMNS: Final = 39
ACTION_COLUMNS: Final = 9
BODY_BYTES: Final = 4096
ENVELOPE_BYTES: Final = 65_536
HISTORY_EVENTS: Final = 64


class RefusedError(ValueError):
    """Bytes that are no valid message: they are dropped, and counted."""


def integer(low: int, high: int) -> Check:
    return lambda value: type(value) is int and low <= value <= high


def number(low: float, high: float) -> Check:
    return lambda value: type(value) is float and low <= value <= high


def text(shortest: int, longest: int) -> Check:
    return lambda value: type(value) is str and shortest <= len(value) <= longest


def data(shortest: int, longest: int) -> Check:
    return lambda value: type(value) is bytes and shortest <= len(value) <= longest


def boolean(value: Any) -> bool:
    return type(value) is bool


def row(columns: int) -> Check:
    """Numbers of eight bytes each, none of them infinite or without a value."""

    def check(value: Any) -> bool:
        return data(8 * columns, 8 * columns)(value) and all(map(math.isfinite, numbers(value)))

    return check


def name(value: Any) -> bool:
    return type(value) is str and re.fullmatch(r"[A-Za-z0-9_.-]{1,64}", value) is not None


def genes(value: Any) -> bool:
    return data(8, 32_768)(value) and len(value) % 8 == 0


def encounter(value: Any) -> bool:
    match value:
        case [initiator, responder, incarnation, count]:
            ids = robot_id(initiator) and robot_id(responder) and initiator != responder
            return ids and ordinal(incarnation) and ordinal(count)
        case _:
            return False


def contact(value: Any) -> bool:
    match value:
        case None:
            return True
        case [robot, nonce_]:
            return robot_id(robot) and nonce(nonce_)
        case _:
            return False


def ids(value: Any) -> bool:
    return type(value) is list and len(value) <= 1000 and all(map(robot_id, value))


robot_id: Final = data(16, 16)
digest: Final = data(16, 16)
public_key: Final = data(32, 32)
ordinal: Final = integer(0, 2**32 - 1)
count_: Final = integer(0, 2**53 - 1)
nonce: Final = integer(0, 2**48 - 1)
arena_run: Final = integer(0, 2**62 - 1)
agent: Final = text(1, 64)

FIELDS: Final[dict[str, tuple[Check, ...]]] = {
    "propose": (encounter, nonce, digest, agent, genes),
    "accept": (encounter, nonce, digest, agent, genes),
    "refuse": (encounter, lambda value: value in ("busy", "schema", "stale", "storage")),
    "commit": (encounter,),
    "abort": (encounter,),
    "done": (encounter,),
    "join": (robot_id, name, integer(-1, 2**31 - 1), arena_run, ordinal, count_, public_key),
    "leave": (robot_id, arena_run, ordinal, count_),
    "body_granted": (
        digest,
        public_key,
        integer(0, 2**31 - 1),
        arena_run,
        count_,
        lambda value: number(0.0, 10_000.0)(value) and value > 0.0,
        boolean,
        text(0, 4096),
    ),
    "body_denied": (digest, text(0, 200)),
    "observation": (arena_run, count_, row(OBSERVATION_COLUMNS), contact),
    "action": (count_, row(ACTION_COLUMNS)),
    "history_request": (ordinal, count_),
    "robot_metadata": (robot_id, ordinal, text(0, 8192), ids, text(0, 32_768)),
}
MATING: Final = ("propose", "accept", "refuse", "commit", "abort", "done")


def encode(message: Any) -> bytes:
    """The one canonical form."""
    packed: bytes = msgpack.packb(message, use_bin_type=True)
    return packed


def unpack(payload: bytes, most_bytes: int) -> Any:
    """What the bytes say, if they say it in the canonical form."""
    if len(payload) > most_bytes:
        raise RefusedError("too long")
    try:
        value = msgpack.unpackb(payload, raw=False)
    except (ValueError, msgpack.UnpackException) as error:
        raise RefusedError(f"no MessagePack: {error}") from None
    except (RecursionError, TypeError):  # arrays in arrays without end, a map with a list as a key
        raise RefusedError("no MessagePack of a message") from None
    if encode(value) != payload:
        raise RefusedError("not in its canonical form")
    return value


def decode(payload: bytes, most_bytes: int, *names: str) -> Message:
    """The message, which must be one of these names."""
    value = unpack(payload, most_bytes)
    if type(value) is not list or not value or type(value[0]) is not str or value[0] not in names:
        raise RefusedError("no message that is expected here")
    checks = FIELDS[value[0]]
    if len(value) - 1 != len(checks) or not all(
        c(field) for c, field in zip(checks, value[1:], strict=True)
    ):
        raise RefusedError(f"a field of {value[0]}")
    return value


def numbers(packed: bytes) -> tuple[float, ...]:
    """The numbers of a row, or of genes."""
    return struct.unpack(f"<{len(packed) // 8}d", packed)


def packed(values: tuple[float, ...]) -> bytes:
    return struct.pack(f"<{len(values)}d", *values)
