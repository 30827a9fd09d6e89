"""Random mutations of valid messages, in their bytes and in their structure."""

import math
import random
from typing import Any

import msgspec


def mutate(rng: random.Random, corpus: list[bytes]) -> bytes:
    """Return a good message after one to three mutations."""
    data = rng.choice(corpus)
    for _ in range(rng.randint(1, 3)):
        data = rng.choice(MUTATIONS)(rng, data, rng.choice(corpus))
    return data


def flip_a_bit(rng: random.Random, data: bytes, _: bytes) -> bytes:
    """Change one bit anywhere."""
    if not data:
        return data
    place = rng.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]


def insert_a_header(rng: random.Random, data: bytes, _: bytes) -> bytes:
    """Insert the first byte of any MessagePack value, and a length, anywhere."""
    place = rng.randrange(len(data) + 1)
    header = bytes([rng.randrange(256)]) + rng.choice([b"", b"\x00", b"\x01", b"\xff" * 4])
    return data[:place] + header + data[place + rng.randint(0, len(header)) :]


def cut(rng: random.Random, data: bytes, _: bytes) -> bytes:
    """Leave out a part."""
    start, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:start] + data[end:]


def splice(rng: random.Random, data: bytes, other: bytes) -> bytes:
    """Append the rest of another message to the beginning of this one."""
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def change_a_value(rng: random.Random, data: bytes, _: bytes) -> bytes:
    """Unpack with msgspec, change one value anywhere within, and pack."""
    try:
        return msgspec.msgpack.encode(change_tree(rng, msgspec.msgpack.decode(data)))
    except (msgspec.MsgspecError, ValueError, OverflowError, RecursionError):
        return data


def change_tree(rng: random.Random, value: Any) -> Any:
    """Return a tree in which one value is another, there is one more, or one is gone."""
    if isinstance(value, list) and value and rng.random() < 0.9:
        place = rng.randrange(len(value))
        match rng.randrange(8):
            case 0:
                return value[:place] + value[place + 1 :]
            case 1:
                return [*value[:place], rng.choice(VALUES), *value[place:]]
            case _:
                inner = change_tree(rng, value[place])
                return [*value[:place], inner, *value[place + 1 :]]
    if isinstance(value, int) and rng.random() < 0.5:
        return rng.choice([value + 1, value - 1, -value, rng.getrandbits(rng.randrange(1, 64))])
    if isinstance(value, bytes) and rng.random() < 0.7:
        return rng.choice([value[:-1], value + b"\0", rng.randbytes(len(value)), value * 2])
    if isinstance(value, str) and rng.random() < 0.7:
        return rng.choice([value + "x", value[:-1], value.upper(), "ä\0\u2028", "x" * 64])
    return rng.choice(VALUES)


VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 2**31, 2**32, 2**48, 2**53, 2**62, 2**63, 2**64 - 1, -(2**63),
    0.0, -0.0, 0.2, math.nan, math.inf, -math.inf, 5e-324, "", "a", "busy", "commit", b"",
    bytes(8), bytes(16), bytes(32), bytes(64), [], [[]], {}, {"a": 1}, msgspec.msgpack.Ext(5, b"x"),
    msgspec.msgpack.Ext(-1, bytes(4)),
]  # fmt: skip
MUTATIONS = [
    flip_a_bit,
    insert_a_header,
    cut,
    splice,
    change_a_value,
    change_a_value,
    change_a_value,
]
