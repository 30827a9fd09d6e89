"""What comes from outside is a message in its one form, or a WireError; and strangers read and write the same bytes."""

import math
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgpack  # type: ignore[import-untyped]
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body.contract import ACTION, ACTION_WIDTH, OBSERVATION, OBSERVATION_WIDTH
from crcolony.evolution.genotype import Gene, Schema
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    Leave,
    Observation,
    decode_action,
    decode_join,
    decode_join_reply,
    decode_observation,
    pack_row,
    unpack_row,
)
from crcolony.protocol.codec import (
    MAX_BODY_MESSAGE_BYTES,
    MAX_ENVELOPE_BYTES,
    Message,
    WireError,
    encode,
)
from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.envelope import (
    SignedEnvelope,
    has_valid_signature,
    open_envelope,
    sign_message,
)
from crcolony.protocol.identity import seeded
from crcolony.protocol.mating_messages import (
    BY_INITIATOR,
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    MatingMessage,
    Propose,
    Refuse,
    decode_mating_message,
    pack_genes,
    receiver_of,
    sender_of,
    unpack_genes,
)
from tests.support.paths import ROOT
from tests.vectors.make import (
    BODIES,
    COLONY,
    ENCOUNTER,
    FOLDER,
    INITIATOR,
    LETTERS,
    NONCE,
    RESPONDER,
    SCHEMA,
    make,
    plain,
)

DOORS: dict[str, Callable[[bytes], Any]] = {
    "letter": lambda data: open_envelope(data)[0],
    "mating": decode_mating_message,
    "join": decode_join,
    "join_reply": decode_join_reply,
    "observation": decode_observation,
    "action": decode_action,
}
"""Every way in for bytes from outside."""

DOOR_OF = {
    **dict.fromkeys(LETTERS, "letter"),
    "join": "join",
    "leave": "join",
    "body_granted": "join_reply",
    "body_denied": "join_reply",
    "observation": "observation",
    "observation_alone": "observation",
    "action": "action",
}
VECTORS = {name: (FOLDER / f"{name}.msgpack").read_bytes() for name in DOOR_OF}


MESSAGE_MODULES = (
    "crcolony.protocol.mating_messages",
    "crcolony.protocol.body_messages",
)


class TestVectors:
    """The golden vectors, which a stranger tests an implementation with."""

    def test_generating_them_gives_the_files_byte_for_byte(self) -> None:
        """Whoever changes a message by accident learns it here."""
        files = {path.name: path.read_bytes() for path in FOLDER.glob("*.msgpack")}
        assert files == make()

    def test_there_is_one_for_every_kind_of_message(self) -> None:
        """No message is without an example."""
        kinds = {type(message) for message in (*LETTERS.values(), *BODIES.values())}
        wire = [k for k in Message.__subclasses__() if k.__module__ in MESSAGE_MODULES]
        assert kinds == set(wire)

    @pytest.mark.parametrize("name", VECTORS)
    def test_both_libraries_decode_the_same_values(self, name: str) -> None:
        """msgspec, which robots use, and the independent msgpack."""
        message = DOORS[DOOR_OF[name]](VECTORS[name])
        assert plain(message) == msgpack.unpackb(VECTORS[name])
        if name in LETTERS:
            content = decode_mating_message(message.content)
            assert content == LETTERS[name]
            assert plain(content) == msgpack.unpackb(message.content)
        else:
            assert message == BODIES[name]

    @pytest.mark.parametrize("name", VECTORS)
    def test_both_libraries_encode_the_same_bytes(self, name: str) -> None:
        """MessagePack's shortest form of every value is the canonical one."""
        message = DOORS[DOOR_OF[name]](VECTORS[name])
        assert encode(message) == VECTORS[name]
        assert msgpack.packb(plain(message)) == VECTORS[name]
        if name in LETTERS:
            assert msgpack.packb(plain(LETTERS[name])) == message.content

    @pytest.mark.parametrize("name", LETTERS)
    def test_letters_are_genuine(self, name: str) -> None:
        """Signed by the robot that must have said it."""
        envelope, message = open_envelope(VECTORS[name])
        sender = INITIATOR if name in ("propose", "commit", "abort") else RESPONDER
        receiver = RESPONDER if sender is INITIATOR else INITIATOR
        assert has_valid_signature(envelope, COLONY)
        assert envelope.key == sender.public_key
        assert sender_of(message) == sender.id
        assert receiver_of(message) == receiver.id

    def test_their_description_names_the_keys_that_sign_them(self) -> None:
        """A stranger can check the seeds, keys and ids of README.md."""
        text = (FOLDER / "README.md").read_text()
        compact = "".join(text.split())
        for key in (INITIATOR, RESPONDER):
            assert key.id.hex() in text
            assert key.public_key.hex() in text
        assert VECTORS["commit"].hex() in compact


class TestDescription:
    """PROTOCOL.md, from which a stranger writes a robot."""

    TEXT = (ROOT / "PROTOCOL.md").read_text()

    def test_it_names_every_message_and_field(self) -> None:
        """And every column of an observation and an action, with its place."""
        for message in (
            *LETTERS.values(),
            *BODIES.values(),
            ENCOUNTER,
            SignedEnvelope(b"", b"", b""),
        ):
            for name in message.__struct_fields__:
                assert f"`{name}`" in self.TEXT, f"{type(message).__name__}.{name}"
            if isinstance(message, Message):
                assert f"`{type(message).__name__.lower()}`" in self.TEXT
        for table in (OBSERVATION, ACTION):
            for column, quantity in enumerate(table):
                assert f"| {column} | `{quantity.name}` |" in self.TEXT, quantity.name

    def test_it_names_every_deadline_and_its_default(self) -> None:
        """In seconds, or a plain number."""
        for name, value in msgspec.structs.asdict(MatingLimits()).items():
            unit = " s" if name.endswith("_s") else ""
            assert f"| `{name}` | {value:,g}{unit} |" in self.TEXT, name

    def test_its_example_of_a_schema_is_right(self) -> None:
        """So that a stranger can check a digest."""
        assert f"`{TestGenes.SCHEMA.digest}`" in self.TEXT
        for gene in TestGenes.SCHEMA.genes:
            assert f"`{gene.name} {gene.low!r} {gene.high!r}`" in self.TEXT

    def test_every_test_it_names_exists(self) -> None:
        """A promise without its test would be an empty one."""
        sources = "".join(path.read_text() for path in Path(__file__).parent.glob("test_*.py"))
        for name in re.findall(r"\b(test_[a-z_]+|Test[A-Z]\w+)\b(?!\.py)", self.TEXT):
            assert f"def {name}(" in sources or f"class {name}:" in sources, name


# Malformed inputs ------------------------------------------------------------------------------------------------

IDS = [INITIATOR.id, RESPONDER.id]
WHO = [*IDS, 1, 1]
AGENT, GENES = "agent", bytes(16)
ROW, ACTED = bytes(8 * OBSERVATION_WIDTH), bytes(8 * ACTION_WIDTH)
KEY, SIGNATURE = INITIATOR.public_key, bytes(64)


def pack(*values: Any) -> bytes:
    """Return an array of values as an independent library writes it."""
    packed: bytes = msgpack.packb(list(values))
    return packed


COMMIT = pack("commit", WHO)
EMBODIED = ("body_granted", 0, 0, 0)

MALFORMED: dict[str, tuple[str, bytes]] = {
    "nothing": ("mating", b""),
    "nil": ("mating", b"\xc0"),
    "never_used_byte": ("mating", b"\xc1"),
    "map_for_array": ("mating", msgpack.packb({"commit": WHO})),
    "map_with_a_key_twice": ("mating", b"\x82\xa1a\x01\xa1a\x02"),
    "extension_type": ("mating", b"\xc7\x01\x05\x00"),
    "timestamp": ("mating", b"\xd6\xff\x00\x00\x00\x00"),
    "trailing_byte": ("mating", COMMIT + b"\x00"),
    "two_messages": ("mating", COMMIT * 2),
    "truncated": ("mating", COMMIT[:-1]),
    "empty_array": ("mating", b"\x90"),
    "unknown_name": ("mating", pack("comit", WHO)),
    "name_in_capitals": ("mating", pack("Commit", WHO)),
    "name_as_bytes": ("mating", pack(b"commit", WHO)),
    "name_of_another_door": ("mating", pack("leave", INITIATOR.id)),
    "field_missing": ("mating", pack("commit")),
    "field_too_many": ("mating", pack("commit", WHO, 0)),
    "field_too_many_inside": ("mating", pack("commit", [*WHO, 0])),
    "field_missing_inside": ("mating", pack("commit", WHO[:3])),
    "nested_1000_deep": ("mating", b"\x91" * 1000 + b"\xc0"),
    "nested_60000_deep": ("mating", b"\x91" * 60_000),
    "nested_deep_in_a_field": ("mating", b"\x92\xa6commit" + b"\x91" * 60_000),
    "maps_nested_deep": ("mating", b"\x81\xa1a" * 20_000),
    "array_header_of_4_billion": ("mating", b"\xdd\xff\xff\xff\xff"),
    "map_header_of_4_billion": ("mating", b"\xdf\xff\xff\xff\xff"),
    "bytes_header_of_4_billion": ("mating", b"\x92\xa6commit\x94\xc6\xff\xff\xff\xff"),
    "text_header_of_4_billion": ("mating", b"\x92\xdb\xff\xff\xff\xffcommit"),
    "oversize": ("mating", pack("propose", WHO, 1, SCHEMA, AGENT, bytes(65_536))),
    "count_in_two_bytes_too_many": ("mating", COMMIT[:-1] + b"\xcd\x00\x01"),
    "count_in_eight_bytes": ("mating", COMMIT[:-1] + b"\xcf" + bytes(7) + b"\x01"),
    "count_as_signed": ("mating", COMMIT[:-1] + b"\xd0\x01"),
    "count_as_float": ("mating", pack("commit", [*IDS, 1, 1.0])),
    "count_as_text": ("mating", pack("commit", [*IDS, 1, "1"])),
    "count_as_truth": ("mating", pack("commit", [*IDS, 1, True])),
    "count_negative": ("mating", pack("commit", [*IDS, 1, -1])),
    "count_of_33_bits": ("mating", pack("commit", [*IDS, 1, 2**32])),
    "life_of_33_bits": ("mating", pack("commit", [*IDS, 2**32, 1])),
    "life_of_64_bits": ("mating", pack("commit", [*IDS, 2**64 - 1, 1])),
    "array_header_too_wide": ("mating", b"\xdc\x00\x02" + COMMIT[1:]),
    "text_header_too_wide": ("mating", b"\x92\xd9\x06commit" + COMMIT[8:]),
    "id_of_15_bytes": ("mating", pack("commit", [IDS[0][:15], IDS[1], 1, 1])),
    "id_of_17_bytes": ("mating", pack("commit", [IDS[0] + b"\0", IDS[1], 1, 1])),
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
    "letter_oversize": ("letter", pack(bytes(65_536), KEY, SIGNATURE)),
    "letter_of_gigabytes": ("letter", b"\x93\xc6\xff\xff\xff\xff"),
    "letter_without_signature": ("letter", pack(COMMIT, KEY)),
    "letter_with_two_signatures": ("letter", pack(COMMIT, KEY, SIGNATURE, SIGNATURE)),
    "letter_as_map": ("letter", msgpack.packb({"content": COMMIT})),
    "content_as_text": ("letter", pack("commit", KEY, SIGNATURE)),
    "content_empty": ("letter", pack(b"", KEY, SIGNATURE)),
    "content_garbage": ("letter", pack(b"\xff" * 40, KEY, SIGNATURE)),
    "content_not_canonical": ("letter", pack(COMMIT[:-1] + b"\xcc\x01", KEY, SIGNATURE)),
    "content_of_another_door": ("letter", pack(pack("leave", IDS[0]), KEY, SIGNATURE)),
    "content_header_too_wide": ("letter", b"\x93\xc5\x00" + pack(COMMIT, KEY, SIGNATURE)[2:]),
    "key_of_31_bytes": ("letter", pack(COMMIT, KEY[:31], SIGNATURE)),
    "signature_of_63_bytes": ("letter", pack(COMMIT, KEY, SIGNATURE[:63])),
    "key_of_the_receiver": ("letter", pack(COMMIT, RESPONDER.public_key, SIGNATURE)),
    "key_of_a_stranger": ("letter", pack(COMMIT, seeded(COLONY, 2, 0).public_key, SIGNATURE)),
    "initiator_says_done": ("letter", pack(pack("done", WHO), KEY, SIGNATURE)),
    "join_oversize": ("join", pack("join", IDS[0], "a" * 5000, 0)),
    "join_place_below": ("join", pack("join", IDS[0], COLONY, -2)),
    "join_place_above": ("join", pack("join", IDS[0], COLONY, 2**31)),
    "colony_empty": ("join", pack("join", IDS[0], "", 0)),
    "colony_of_65_letters": ("join", pack("join", IDS[0], "a" * 65, 0)),
    "colony_with_a_slash": ("join", pack("join", IDS[0], "a/b", 0)),
    "colony_with_a_star": ("join", pack("join", IDS[0], "a*", 0)),
    "colony_not_ascii": ("join", pack("join", IDS[0], "ä", 0)),
    "colony_with_a_line_end": ("join", pack("join", IDS[0], "a\n", 0)),
    "leave_with_nothing": ("join", pack("leave")),
    "period_zero": ("join_reply", pack(*EMBODIED, 0.0, True, "")),
    "period_negative": ("join_reply", pack(*EMBODIED, -0.2, True, "")),
    "period_nan": ("join_reply", pack(*EMBODIED, math.nan, True, "")),
    "period_infinite": ("join_reply", pack(*EMBODIED, math.inf, True, "")),
    "period_of_hours": ("join_reply", pack(*EMBODIED, 10_000.5, True, "")),
    "period_as_integer": ("join_reply", pack(*EMBODIED, 1, True, "")),
    "period_in_single_precision": (
        "join_reply",
        msgpack.packb([*EMBODIED, 0.5, True, ""], use_single_float=True),
    ),
    "lockstep_as_number": ("join_reply", pack(*EMBODIED, 0.2, 1, "")),
    "slot_negative": ("join_reply", pack("body_granted", -1, 0, 0, 0.2, True, "")),
    "world_of_63_bits": ("join_reply", pack("body_granted", 0, 2**62, 0, 0.2, True, "")),
    "body_oversize": ("join_reply", pack(*EMBODIED, 0.2, True, "a" * 4097)),
    "reason_of_201_letters": ("join_reply", pack("body_denied", "a" * 201)),
    "row_too_short": ("observation", pack("observation", 0, 0, ROW[8:], None)),
    "row_too_long": ("observation", pack("observation", 0, 0, ROW + bytes(8), None)),
    "tick_of_54_bits": ("observation", pack("observation", 0, 2**53, ROW, None)),
    "tick_negative": ("observation", pack("observation", 0, -1, ROW, None)),
    "contact_half": ("observation", pack("observation", 0, 0, ROW, [IDS[0]])),
    "contact_missing": ("observation", pack("observation", 0, 0, ROW)),
    "contact_nonce_negative": ("observation", pack("observation", 0, 0, ROW, [IDS[0], -1])),
    "observation_for_action": ("action", VECTORS["observation"]),
    "action_too_short": ("action", pack("action", 0, ACTED[8:])),
    "action_of_an_observation_s_width": ("action", pack("action", 0, ROW)),
}
"""Name -> the door it knocks at, and the bytes: each breaks one rule."""

EDGES: dict[str, tuple[str, bytes]] = {
    "largest_numbers": (
        "mating",
        pack("propose", [*IDS, 2**32 - 1, 2**32 - 1], 2**48 - 1, SCHEMA, "ä" * 64, bytes(8 * 4096)),
    ),
    "smallest_numbers": ("mating", pack("propose", [*IDS, 0, 0], 0, SCHEMA, "a", bytes(8))),
    "longest_colony": ("join", pack("join", IDS[0], "A_z.9-" * 10 + "abcd", 2**31 - 1)),
    "longest_period": ("join_reply", pack(*EMBODIED, 1e4, True, "")),
    "longest_reason": ("join_reply", pack("body_denied", "ä" * 200)),
    "last_tick": ("observation", pack("observation", 2**62 - 1, 2**53 - 1, ROW, [IDS[1], 0])),
}
"""The same, for what is only just allowed."""


class TestDoors:
    """Whatever comes in, a decoder returns a message or raises WireError."""

    @pytest.mark.parametrize(
        "name",
        MALFORMED,
    )
    def test_malformed_bytes_are_refused(self, name: str) -> None:
        """Each input of the table breaks one rule of PROTOCOL.md."""
        door, data = MALFORMED[name]
        with pytest.raises(WireError):
            DOORS[door](data)

    @pytest.mark.parametrize("name", EDGES)
    def test_what_is_only_just_allowed_is_read(self, name: str) -> None:
        """A limit is the last value that passes."""
        door, data = EDGES[name]
        assert encode(DOORS[door](data)) == data

    def test_no_door_takes_a_byte_more_than_its_limit(self) -> None:
        """The length is looked at before anything is decoded."""
        for name, door in DOORS.items():
            most = MAX_ENVELOPE_BYTES if name in ("letter", "mating") else MAX_BODY_MESSAGE_BYTES
            with pytest.raises(WireError, match="are allowed"):
                door(bytes(most + 1))

    def test_the_longest_letter_fits(self) -> None:
        """4,096 genes and the longest name, sealed, are within the limit."""
        message = decode_mating_message(EDGES["largest_numbers"][1])
        assert open_envelope(sign_message(message, COLONY, INITIATOR))[1] == message

    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize("door", DOORS)
    def test_no_mutation_is_anything_but_a_message_or_refused(self, door: str, seed: int) -> None:
        """Thousands of mutations of good messages, in bytes and in structure; what is read is canonical."""
        rng = random.Random(f"{door} {seed}")
        corpus = [data for name, data in VECTORS.items() if DOOR_OF[name] == door]
        corpus += [encode(message) for message in LETTERS.values()] * (door == "mating")
        read = 0
        for number in range(1_500):
            data = mutated(rng, corpus)
            try:
                message = DOORS[door](data)
            except WireError:
                continue
            except BaseException as error:
                pytest.fail(f"{door}, seed {seed}, mutation {number}: {data!r} raised {error!r}")
            assert encode(message) == data, f"{door}, seed {seed}, mutation {number}"
            read += 1
        assert read > 0, (
            "no mutation was mild enough: the fuzz tests nothing behind the first check"
        )


def mutated(rng: random.Random, corpus: list[bytes]) -> bytes:
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


def put_a_header(rng: random.Random, data: bytes, _: bytes) -> bytes:
    """Put the first byte of any MessagePack value, and a length, somewhere."""
    place = rng.randrange(len(data) + 1)
    header = bytes([rng.randrange(256)]) + rng.choice([b"", b"\x00", b"\x01", b"\xff" * 4])
    return data[:place] + header + data[place + rng.randint(0, len(header)) :]


def cut(rng: random.Random, data: bytes, _: bytes) -> bytes:
    """Leave out a part."""
    start, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:start] + data[end:]


def splice(rng: random.Random, data: bytes, other: bytes) -> bytes:
    """Go on with the rest of another message."""
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def change_a_value(rng: random.Random, data: bytes, _: bytes) -> bytes:
    """Decode with the independent library, change one value anywhere within, and encode."""
    try:
        tree = msgpack.unpackb(data)
        changed: bytes = msgpack.packb(changed_value(rng, tree))
    except Exception:
        return data
    return changed


def changed_value(rng: random.Random, value: Any) -> Any:
    """Return a tree in which one value is another, there is one more, or one is gone."""
    if isinstance(value, list) and value and rng.random() < 0.9:
        place = rng.randrange(len(value))
        match rng.randrange(8):
            case 0:
                return value[:place] + value[place + 1 :]
            case 1:
                return [*value[:place], rng.choice(VALUES), *value[place:]]
            case _:
                inner = changed_value(rng, value[place])
                return [*value[:place], inner, *value[place + 1 :]]
    if isinstance(value, int) and rng.random() < 0.5:
        return rng.choice([value + 1, value - 1, -value, rng.getrandbits(rng.randrange(1, 64))])
    if isinstance(value, bytes) and rng.random() < 0.7:
        return rng.choice([value[:-1], value + b"\0", rng.randbytes(len(value)), value * 2])
    if isinstance(value, str) and rng.random() < 0.7:
        return rng.choice([value + "x", value[:-1], value.upper(), "ä\0\u2028", "x" * 64])
    return rng.choice(VALUES)


VALUES = [
    None, True, False, 0, 1, -1, 2**31, 2**32, 2**48, 2**53, 2**62, 2**63, 2**64 - 1, -(2**63),
    0.0, -0.0, 0.2, math.nan, math.inf, -math.inf, 5e-324, "", "a", "busy", "commit", b"",
    bytes(8), bytes(16), bytes(32), bytes(64), [], [[]], {}, {"a": 1}, msgpack.ExtType(5, b"x"),
    msgpack.Timestamp(0),
]  # fmt: skip
MUTATIONS = [flip_a_bit, put_a_header, cut, splice, change_a_value, change_a_value, change_a_value]


class TestLetters:
    """A letter proves who said it, to whom, about which encounter, in which colony."""

    def test_no_bit_of_a_letter_can_be_changed(self) -> None:
        """It is refused at the door, or its signature is wrong."""
        good = VECTORS["commit"]
        for bit in range(8 * len(good)):
            changed = bytearray(good)
            changed[bit // 8] ^= 1 << bit % 8
            try:
                envelope, _ = open_envelope(bytes(changed))
            except WireError:
                continue
            assert not has_valid_signature(envelope, COLONY), f"bit {bit}"

    def test_a_letter_for_another_colony_is_not_genuine(self) -> None:
        """Nor for one whose name begins alike."""
        envelope, _ = open_envelope(VECTORS["propose"])
        for colony in ("", "vector", "vectors2", "Vectors"):
            assert not has_valid_signature(envelope, colony)

    def test_a_letter_signed_by_another_is_not_genuine(self) -> None:
        """With the sender's public key around it, which everyone knows."""
        content = encode(LETTERS["commit"])
        signature = RESPONDER.sign(b"crcolony mating 1 vectors\n" + content)
        envelope = SignedEnvelope(content, INITIATOR.public_key, signature)
        opened, _ = open_envelope(encode(envelope))
        assert not has_valid_signature(opened, COLONY)

    def test_what_is_signed_is_what_the_protocol_says(self) -> None:
        """The words crcolony, mating, version and colony, a line end, then the content byte for byte."""
        content = encode(LETTERS["commit"])
        signature = INITIATOR.sign(b"crcolony mating 1 vectors\n" + content)
        assert signature == open_envelope(VECTORS["commit"])[0].signature

    def test_a_robot_cannot_seal_for_another(self) -> None:
        """Its letter is refused at the door, before any signature is verified."""
        with pytest.raises(WireError, match="not its sender's"):
            open_envelope(sign_message(LETTERS["commit"], COLONY, RESPONDER))


class TestGenes:
    """Genes are numbers of this species, each in its range."""

    SCHEMA = Schema((Gene("weight"), Gene("rate", 0.0, 1.0)))

    def test_they_arrive_as_they_were_sent(self) -> None:
        """Bit for bit, the sign of zero and the smallest number too."""
        genes = np.array([-0.0, 5e-324])
        assert unpack_genes(pack_genes(genes), self.SCHEMA).tobytes() == (genes.tobytes())

    @pytest.mark.parametrize(
        "genes",
        [
            [math.nan, 0.5],
            [math.inf, 0.5],
            [-math.inf, 0.5],
            [0.0, 1.0 + 1e-15],
            [0.0, -5e-324],
            [0.0, math.nan],
            [0.0],
            [0.0, 0.5, 0.5],
        ],
        ids=str,
    )
    def test_other_numbers_are_refused(self, genes: list[float]) -> None:
        """Not finite, out of range, too few, too many."""
        with pytest.raises(WireError):
            unpack_genes(pack_genes(np.array(genes)), self.SCHEMA)

    @pytest.mark.parametrize("length", [0, 1, 8, 15, 17, 24])
    def test_other_lengths_are_refused(self, length: int) -> None:
        """Also those that are no whole number of genes."""
        with pytest.raises(WireError, match="are not 2 genes"):
            unpack_genes(bytes(length), self.SCHEMA)

    def test_a_signalling_nan_is_refused(self) -> None:
        """Whatever bits a NaN carries."""
        for bits in (0x7FF0_0000_0000_0001, 0xFFF8_0000_0000_0000, 0x7FFF_FFFF_FFFF_FFFF):
            with pytest.raises(WireError):
                unpack_genes(bits.to_bytes(8, "little") + bytes(8), self.SCHEMA)

    def test_a_row_holds_finite_numbers_only(self) -> None:
        """An observation and an action likewise."""
        row = np.zeros(OBSERVATION_WIDTH)
        assert unpack_row(pack_row(row)).tolist() == row.tolist()
        for number in (math.nan, math.inf, -math.inf):
            row[3] = number
            with pytest.raises(WireError, match="not finite"):
                unpack_row(pack_row(row))


# Round trip --------------------------------------------------------------------------------------------------------

ID = st.binary(min_size=16, max_size=16)
ORDINAL = st.integers(0, 2**32 - 1)
NONCES = st.integers(0, 2**48 - 1)
TICK = st.integers(0, 2**53 - 1)
WORLD = st.integers(0, 2**62 - 1)
PLACE = st.integers(0, 2**31 - 1)
NAME = st.text("abcXYZ019_.-", min_size=1, max_size=64)
TEXT = st.text(max_size=64)
ENCOUNTERS = st.builds(Encounter, ID, ID, ORDINAL, ORDINAL)
OFFER = (
    ENCOUNTERS,
    NONCES,
    ID,
    st.text(min_size=1, max_size=64),
    st.binary(min_size=8, max_size=80),
)
ROWS = st.binary(min_size=len(ROW), max_size=len(ROW))
REASONS = st.sampled_from(["busy", "schema", "stale", "storage"])
CONTACTS = st.builds(Contact, ID, NONCES)
PERIOD = st.floats(0.0, 1e4, exclude_min=True)
KINDS: dict[str, st.SearchStrategy[Any]] = {
    "mating": st.one_of(
        st.builds(Propose, *OFFER),
        st.builds(Accept, *OFFER),
        st.builds(Refuse, ENCOUNTERS, REASONS),
        st.builds(Commit, ENCOUNTERS),
        st.builds(Abort, ENCOUNTERS),
        st.builds(Done, ENCOUNTERS),
    ),
    "join": st.one_of(
        st.builds(Join, ID, NAME, st.integers(-1, 2**31 - 1)),
        st.builds(Leave, ID),
    ),
    "join_reply": st.one_of(
        st.builds(BodyGranted, PLACE, WORLD, TICK, PERIOD, st.booleans(), TEXT),
        st.builds(BodyDenied, TEXT),
    ),
    "observation": st.builds(Observation, WORLD, TICK, ROWS, st.none() | CONTACTS),
    "action": st.builds(Action, TICK, st.binary(min_size=len(ACTED), max_size=len(ACTED))),
}


@pytest.mark.parametrize("door", KINDS)
@given(st.data())
def test_what_is_encoded_is_decoded(door: str, data: st.DataObject) -> None:
    """Any message within its limits comes out as it went in, and the other library writes the same bytes."""
    message = data.draw(KINDS[door])
    encoded = encode(message)
    assert DOORS[door](encoded) == message
    assert msgpack.packb(plain(message)) == encoded
    assert msgpack.unpackb(encoded) == plain(message)


@given(KINDS["mating"])
def test_what_is_sealed_is_opened(message: MatingMessage) -> None:
    """A letter of its sender is opened and genuine; of any other robot it is refused."""
    fields = msgspec.structs.asdict(message)
    encounter = msgspec.structs.replace(ENCOUNTER, count=message.encounter.count)
    message = type(message)(**{**fields, "encounter": encounter})
    is_initiators = isinstance(message, BY_INITIATOR)
    sender, other = (INITIATOR, RESPONDER) if is_initiators else (RESPONDER, INITIATOR)
    envelope, opened = open_envelope(sign_message(message, COLONY, sender))
    assert opened == message
    assert has_valid_signature(envelope, COLONY)
    with pytest.raises(WireError):
        open_envelope(sign_message(message, COLONY, other))


def test_a_nonce_survives_an_observation_s_float() -> None:
    """The body's row carries the nonce as a float64 too: 48 bits fit exactly."""
    assert int(float(2**48 - 1)) == 2**48 - 1
    assert int(float(NONCE)) == NONCE
