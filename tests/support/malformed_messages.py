"""Inputs that decoders refuse, each of which breaks one rule of PROTOCOL.md, and inputs just within the limits."""

import math
import struct
from base64 import b64encode
from typing import Any

import msgspec

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.protocol.identity import seeded
from tests.support.wire_decoders import VECTORS
from tests.vectors.make import COLONY, INITIATOR, RESPONDER, SCHEMA

IDS = [INITIATOR.id, RESPONDER.id]
WHO = [*IDS, 1, 1]
AGENT, GENES = "agent", bytes(16)
ROW, ACTION_ROW = bytes(8 * OBSERVATION_WIDTH), bytes(8 * ACTION_WIDTH)
KEY, SIGNATURE = INITIATOR.public_key, bytes(64)


def pack(*values: Any) -> bytes:
    """Return an array of values as msgspec packs it, which is not the library that robots pack with."""
    return msgspec.msgpack.encode(values)


COMMIT = pack("commit", WHO)
REQUEST = (0, 1, 1, bytes(32))
"""The rest of a join: run, incarnation, count and key"""
GRANTED = ("body_granted", bytes(16), bytes(32), 0, 0, 0)

MALFORMED: dict[str, tuple[str, bytes]] = {
    "nothing": ("mating", b""),
    "nil": ("mating", b"\xc0"),
    "never_used_byte": ("mating", b"\xc1"),
    "map_for_array": ("mating", msgspec.msgpack.encode({"commit": WHO})),
    "map_with_a_key_twice": ("mating", b"\x82\xa1a\x01\xa1a\x02"),
    "extension_type": ("mating", b"\xc7\x01\x05\x00"),
    "map_empty": ("mating", b"\x80"),
    "extension_without_content": ("mating", b"\xc7\x00\x05"),
    "timestamp_without_content": ("mating", b"\xc7\x00\xff"),
    "extension_in_a_field": ("mating", b"\x92\xa6commit\xd4\x05\x00"),
    "timestamp": ("mating", b"\xd6\xff\x00\x00\x00\x00"),
    "trailing_byte": ("mating", COMMIT + b"\x00"),
    "two_messages": ("mating", COMMIT * 2),
    "truncated": ("mating", COMMIT[:-1]),
    "empty_array": ("mating", b"\x90"),
    "unknown_name": ("mating", pack("comit", WHO)),
    "name_in_capitals": ("mating", pack("Commit", WHO)),
    "name_as_bytes": ("mating", pack(b"commit", WHO)),
    "name_of_another_decoder": ("mating", pack("leave", INITIATOR.id, 0, 1, 1)),
    "field_missing": ("mating", pack("commit")),
    "field_too_many": ("mating", pack("commit", WHO, 0)),
    "field_too_many_inside": ("mating", pack("commit", [*WHO, 0])),
    "field_missing_inside": ("mating", pack("commit", WHO[:3])),
    "nested_1000_deep": ("mating", b"\x91" * 1000 + b"\xc0"),
    "nested_60000_deep": ("mating", b"\x91" * 60_000),
    "nested_deep_in_a_field": ("mating", b"\x92\xa6commit" + b"\x91" * 60_000),
    "maps_nested_deep": ("mating", b"\x81\xa1a" * 20_000),
    "array_header_of_4_billion": ("mating", b"\xdd\xff\xff\xff\xff"),
    "array_of_33_items": ("mating", pack("commit", [0] * 33)),
    "map_header_of_4_billion": ("mating", b"\xdf\xff\xff\xff\xff"),
    "bytes_header_of_4_billion": ("mating", b"\x92\xa6commit\x94\xc6\xff\xff\xff\xff"),
    "text_header_of_4_billion": ("mating", b"\x92\xdb\xff\xff\xff\xffcommit"),
    "oversize": ("mating", pack("propose", WHO, 1, SCHEMA, AGENT, bytes(65_536))),
    "count_in_two_bytes_too_many": ("mating", COMMIT[:-1] + b"\xcd\x00\x01"),
    "count_in_eight_bytes": ("mating", COMMIT[:-1] + b"\xcf" + bytes(7) + b"\x01"),
    "count_as_signed": ("mating", COMMIT[:-1] + b"\xd0\x01"),
    "count_as_float": ("mating", pack("commit", [*IDS, 1, 1.0])),
    "count_as_text": ("mating", pack("commit", [*IDS, 1, "1"])),
    "count_as_boolean": ("mating", pack("commit", [*IDS, 1, True])),
    "count_negative": ("mating", pack("commit", [*IDS, 1, -1])),
    "count_of_33_bits": ("mating", pack("commit", [*IDS, 1, 2**32])),
    "incarnation_of_33_bits": ("mating", pack("commit", [*IDS, 2**32, 1])),
    "incarnation_of_64_bits": ("mating", pack("commit", [*IDS, 2**64 - 1, 1])),
    "array_header_too_wide": ("mating", b"\xdc\x00\x02" + COMMIT[1:]),
    "text_header_too_wide": ("mating", b"\x92\xd9\x06commit" + COMMIT[8:]),
    "id_of_15_bytes": ("mating", pack("commit", [IDS[0][:15], IDS[1], 1, 1])),
    "id_of_17_bytes": ("mating", pack("commit", [IDS[0] + b"\0", IDS[1], 1, 1])),
    "id_as_base64": ("mating", pack("commit", [b64encode(IDS[0]).decode(), IDS[1], 1, 1])),
    "id_as_text": ("mating", pack("commit", ["a" * 16, IDS[1], 1, 1])),
    "nonce_of_49_bits": ("mating", pack("propose", WHO, 2**48, SCHEMA, AGENT, GENES)),
    "schema_of_15_bytes": ("mating", pack("propose", WHO, 1, SCHEMA[:15], AGENT, GENES)),
    "agent_without_name": ("mating", pack("propose", WHO, 1, SCHEMA, "", GENES)),
    "agent_of_65_letters": ("mating", pack("propose", WHO, 1, SCHEMA, "a" * 65, GENES)),
    "agent_as_bytes": ("mating", pack("propose", WHO, 1, SCHEMA, b"agent", GENES)),
    "agent_in_bad_utf8": (
        "mating",
        pack("propose", WHO, 1, SCHEMA, "agent", GENES).replace(b"agent", b"ag\xff\xfet"),
    ),
    "agent_in_overlong_utf8": (
        "mating",
        pack("propose", WHO, 1, SCHEMA, "agent", GENES).replace(b"agent", b"age\xc0\x80"),
    ),
    "agent_with_a_surrogate": (
        "mating",
        pack("propose", WHO, 1, SCHEMA, "agent", GENES).replace(b"agent", b"ag\xed\xa0\x80"),
    ),
    "genes_of_7_bytes": ("mating", pack("propose", WHO, 1, SCHEMA, AGENT, bytes(7))),
    "genes_of_4097_numbers": ("mating", pack("propose", WHO, 1, SCHEMA, AGENT, bytes(8 * 4097))),
    "genes_as_numbers": ("mating", pack("propose", WHO, 1, SCHEMA, AGENT, [0.0, 1.0])),
    "unknown_reason": ("mating", pack("refuse", WHO, "tired")),
    "envelope_oversize": ("envelope", pack(bytes(65_536), KEY, SIGNATURE)),
    "envelope_of_gigabytes": ("envelope", b"\x93\xc6\xff\xff\xff\xff"),
    "envelope_without_signature": ("envelope", pack(COMMIT, KEY)),
    "envelope_with_two_signatures": ("envelope", pack(COMMIT, KEY, SIGNATURE, SIGNATURE)),
    "envelope_as_map": ("envelope", msgspec.msgpack.encode({"content": COMMIT})),
    "content_as_text": ("envelope", pack("commit", KEY, SIGNATURE)),
    "content_empty": ("envelope", pack(b"", KEY, SIGNATURE)),
    "content_garbage": ("envelope", pack(b"\xff" * 40, KEY, SIGNATURE)),
    "content_not_canonical": ("envelope", pack(COMMIT[:-1] + b"\xcc\x01", KEY, SIGNATURE)),
    "content_of_another_decoder": (
        "envelope",
        pack(pack("leave", IDS[0], 0, 1, 1), KEY, SIGNATURE),
    ),
    "content_header_too_wide": ("envelope", b"\x93\xc5\x00" + pack(COMMIT, KEY, SIGNATURE)[2:]),
    "key_of_31_bytes": ("envelope", pack(COMMIT, KEY[:31], SIGNATURE)),
    "signature_of_63_bytes": ("envelope", pack(COMMIT, KEY, SIGNATURE[:63])),
    "key_of_the_receiver": ("envelope", pack(COMMIT, RESPONDER.public_key, SIGNATURE)),
    "key_of_another_robot": ("envelope", pack(COMMIT, seeded(COLONY, 2, 0).public_key, SIGNATURE)),
    "done_from_the_initiator": ("envelope", pack(pack("done", WHO), KEY, SIGNATURE)),
    "join_oversize": ("join", pack("join", IDS[0], "a" * 5000, 0, *REQUEST)),
    "join_slot_below": ("join", pack("join", IDS[0], COLONY, -2, *REQUEST)),
    "join_slot_above": ("join", pack("join", IDS[0], COLONY, 2**31, *REQUEST)),
    "colony_empty": ("join", pack("join", IDS[0], "", 0, *REQUEST)),
    "colony_of_65_letters": ("join", pack("join", IDS[0], "a" * 65, 0, *REQUEST)),
    "colony_with_a_slash": ("join", pack("join", IDS[0], "a/b", 0, *REQUEST)),
    "colony_with_a_star": ("join", pack("join", IDS[0], "a*", 0, *REQUEST)),
    "colony_not_ascii": ("join", pack("join", IDS[0], "ä", 0, *REQUEST)),
    "colony_with_a_line_end": ("join", pack("join", IDS[0], "a\n", 0, *REQUEST)),
    "exchange_key_short": ("join", pack("join", IDS[0], COLONY, 0, 0, 1, 1, bytes(31))),
    "exchange_key_as_text": ("join", pack("join", IDS[0], COLONY, 0, 0, 1, 1, "a" * 32)),
    "request_short": ("join_reply", pack("body_denied", bytes(15), "")),
    "leave_with_nothing": ("join", pack("leave")),
    "period_zero": ("join_reply", pack(*GRANTED, 0.0, True, "")),
    "period_negative": ("join_reply", pack(*GRANTED, -0.2, True, "")),
    "period_nan": ("join_reply", pack(*GRANTED, math.nan, True, "")),
    "period_infinite": ("join_reply", pack(*GRANTED, math.inf, True, "")),
    "period_of_hours": ("join_reply", pack(*GRANTED, 10_000.5, True, "")),
    "period_as_boolean": ("join_reply", pack(*GRANTED, True, True, "")),
    "period_as_integer": ("join_reply", pack(*GRANTED, 1, True, "")),
    "period_in_single_precision": (
        "join_reply",
        pack(*GRANTED, 0.5, True, "").replace(
            struct.pack(">Bd", 0xCB, 0.5), struct.pack(">Bf", 0xCA, 0.5)
        ),
    ),
    "lockstep_as_number": ("join_reply", pack(*GRANTED, 0.2, 1, "")),
    "slot_negative": (
        "join_reply",
        pack("body_granted", bytes(16), bytes(32), -1, 0, 0, 0.2, True, ""),
    ),
    "arena_run_of_63_bits": (
        "join_reply",
        pack("body_granted", bytes(16), bytes(32), 0, 2**62, 0, 0.2, True, ""),
    ),
    "body_oversize": ("join_reply", pack(*GRANTED, 0.2, True, "a" * 4097)),
    "reason_of_201_letters": ("join_reply", pack("body_denied", bytes(16), "a" * 201)),
    "row_too_short": ("observation", pack("observation", 0, 0, ROW[8:], None)),
    "row_too_long": ("observation", pack("observation", 0, 0, ROW + bytes(8), None)),
    "tick_of_54_bits": ("observation", pack("observation", 0, 2**53, ROW, None)),
    "tick_negative": ("observation", pack("observation", 0, -1, ROW, None)),
    "contact_half": ("observation", pack("observation", 0, 0, ROW, [IDS[0]])),
    "contact_missing": ("observation", pack("observation", 0, 0, ROW)),
    "contact_nonce_negative": ("observation", pack("observation", 0, 0, ROW, [IDS[0], -1])),
    "observation_for_action": ("action", VECTORS["observation"]),
    "action_too_short": ("action", pack("action", 0, ACTION_ROW[8:])),
    "action_of_an_observation_s_width": ("action", pack("action", 0, ROW)),
}
"""By name the decoder and the bytes: each input breaks one rule of PROTOCOL.md."""

EDGES: dict[str, tuple[str, bytes]] = {
    "largest_numbers": (
        "mating",
        pack("propose", [*IDS, 2**32 - 1, 2**32 - 1], 2**48 - 1, SCHEMA, "ä" * 64, bytes(8 * 4096)),
    ),
    "smallest_numbers": ("mating", pack("propose", [*IDS, 0, 0], 0, SCHEMA, "a", bytes(8))),
    "longest_colony": ("join", pack("join", IDS[0], "A_z.9-" * 10 + "abcd", 2**31 - 1, *REQUEST)),
    "longest_period": ("join_reply", pack(*GRANTED, 1e4, True, "")),
    "longest_reason": ("join_reply", pack("body_denied", bytes(16), "ä" * 200)),
    "last_tick": ("observation", pack("observation", 2**62 - 1, 2**53 - 1, ROW, [IDS[1], 0])),
}
"""By name the decoder and the bytes: each message is just within the limits."""
