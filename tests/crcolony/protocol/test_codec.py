"""Received bytes are a message in its canonical form or a WireError, and another library reads and writes the same."""

import random
import tracemalloc
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    Leave,
    Observation,
)
from crcolony.protocol.codec import (
    MAX_BODY_MESSAGE_BYTES,
    MAX_ENVELOPE_BYTES,
    Message,
    WireError,
    encode,
)
from crcolony.protocol.mating_messages import (
    Abort,
    Accept,
    Commit,
    Done,
    Encounter,
    Propose,
    Refuse,
)
from tests.support.malformed_messages import EDGES, MALFORMED
from tests.support.mutations import mutate
from tests.support.wire_decoders import (
    DECODER_OF,
    DECODERS,
    TELEMETRY_DECODER_OF,
    TELEMETRY_DECODERS,
    VECTORS,
)
from tests.vectors.make import (
    BODIES,
    DEPLOYMENTS,
    FOLDER,
    MATING_MESSAGES,
    STOPS,
    TELEMETRY,
    make,
    plain,
)

MESSAGE_MODULES = ("crcolony.protocol.mating_messages", "crcolony.protocol.body_messages")
ALL_DECODERS = DECODERS | TELEMETRY_DECODERS
ALL_DECODER_OF = DECODER_OF | TELEMETRY_DECODER_OF


HEADERS = [b"\xdc" + items.to_bytes(2, "big") for items in (32, 64, 1_000, 4_096, 2**16 - 1)]
"""Headers of arrays that announce so many items."""


class TestVectors:
    """The golden vectors, with which other implementations are tested."""

    def test_making_them_gives_the_files_byte_for_byte(self) -> None:
        """A message that is changed by accident is noticed here."""
        paths = (*FOLDER.glob("*.msgpack"), *FOLDER.glob("*.bytes"))
        assert {path.name: path.read_bytes() for path in paths} == make()

    def test_there_is_one_for_every_kind_of_message(self) -> None:
        """No message is without an example."""
        kinds = {type(message) for message in (*MATING_MESSAGES.values(), *BODIES.values())}
        wire = [k for k in Message.__subclasses__() if k.__module__ in MESSAGE_MODULES]
        assert kinds == set(wire)

    @pytest.mark.parametrize("name", ALL_DECODER_OF)
    def test_both_libraries_read_the_same_values(self, name: str) -> None:
        """Robots use msgpack; msgspec has a MessagePack of its own."""
        message = ALL_DECODERS[ALL_DECODER_OF[name]](VECTORS[name])
        assert plain(message) == msgspec.msgpack.decode(VECTORS[name])
        if name not in MATING_MESSAGES:
            assert message == (BODIES | TELEMETRY | STOPS | DEPLOYMENTS)[name]

    @pytest.mark.parametrize("name", ALL_DECODER_OF)
    def test_both_libraries_write_the_same_bytes(self, name: str) -> None:
        """The canonical form is MessagePack's shortest form of every value."""
        message = ALL_DECODERS[ALL_DECODER_OF[name]](VECTORS[name])
        assert encode(message) == VECTORS[name]
        assert msgspec.msgpack.encode(plain(message)) == VECTORS[name]


class TestDecoders:
    """A decoder returns a message or raises WireError, whatever the bytes."""

    @pytest.mark.parametrize("name", MALFORMED)
    def test_malformed_bytes_are_refused(self, name: str) -> None:
        """Each input of the table breaks one rule of PROTOCOL.md."""
        decoder, data = MALFORMED[name]
        with pytest.raises(WireError):
            DECODERS[decoder](data)

    @pytest.mark.parametrize("name", EDGES)
    def test_messages_just_within_the_limits_are_read(self, name: str) -> None:
        """A limit is the last value that is accepted."""
        decoder, data = EDGES[name]
        assert encode(DECODERS[decoder](data)) == data

    def test_no_decoder_accepts_a_byte_more_than_its_limit(self) -> None:
        """The length is checked before anything is decoded."""
        for name, decode in DECODERS.items():
            is_envelope = name in ("envelope", "mating")
            most = MAX_ENVELOPE_BYTES if is_envelope else MAX_BODY_MESSAGE_BYTES
            with pytest.raises(WireError, match="are allowed"):
                decode(bytes(most + 1))

    @pytest.mark.parametrize("header", HEADERS)
    @pytest.mark.parametrize("name", ALL_DECODERS)
    def test_headers_of_long_arrays_reserve_little_memory(self, name: str, header: bytes) -> None:
        """Arrays nested in each other, each of which announces more elements than there are."""
        data = header * (MAX_BODY_MESSAGE_BYTES // len(header))
        tracemalloc.start()
        try:
            with pytest.raises(WireError):
                ALL_DECODERS[name](data)
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert peak < {"scene": 40e6, "robot_metadata": 10e6}.get(name, 1e6)

    def test_a_view_of_bytes_is_read_like_bytes(self) -> None:
        """A transport need not copy what it received."""
        for name in ALL_DECODER_OF:
            decode = ALL_DECODERS[ALL_DECODER_OF[name]]
            assert decode(memoryview(VECTORS[name])) == decode(VECTORS[name])  # type: ignore[arg-type]

    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize("name", DECODERS)
    def test_every_mutation_is_a_message_or_refused(self, name: str, seed: int) -> None:
        """Thousands of mutations of valid messages, in bytes and in structure; what is read is canonical."""
        rng = random.Random(f"{name} {seed}")
        corpus = [VECTORS[vector] for vector, decoder in DECODER_OF.items() if decoder == name]
        corpus += [encode(message) for message in MATING_MESSAGES.values()] * (name == "mating")
        read = 0
        for number in range(1_500):
            data = mutate(rng, corpus)
            try:
                message = DECODERS[name](data)
            except WireError:
                continue
            except BaseException as error:
                pytest.fail(f"{name}, seed {seed}, mutation {number}: {data!r} raised {error!r}")
            assert encode(message) == data, f"{name}, seed {seed}, mutation {number}"
            read += 1
        assert read > 0, "no mutation passed the first check: nothing behind it was tested"


ID = st.binary(min_size=16, max_size=16)
KEY = st.binary(min_size=32, max_size=32)
ORDINAL = st.integers(0, 2**32 - 1)
NONCES = st.integers(0, 2**48 - 1)
TICK = st.integers(0, 2**53 - 1)
ARENA_RUN = st.integers(0, 2**62 - 1)
SLOT = st.integers(0, 2**31 - 1)
NAME = st.text("abcXYZ019_.-", min_size=1, max_size=64)
TEXT = st.text(max_size=64)
ENCOUNTERS = st.builds(Encounter, ID, ID, ORDINAL, ORDINAL)
AGENTS = st.text(min_size=1, max_size=64)
OFFER = (ENCOUNTERS, NONCES, ID, AGENTS, st.binary(min_size=8, max_size=80))
OBSERVATIONS = st.binary(min_size=8 * OBSERVATION_WIDTH, max_size=8 * OBSERVATION_WIDTH)
ACTIONS = st.binary(min_size=8 * ACTION_WIDTH, max_size=8 * ACTION_WIDTH)
REASONS = st.sampled_from(["busy", "schema", "stale", "storage"])
CONTACTS = st.builds(Contact, ID, NONCES)
PERIOD = st.floats(0.0, 1e4, exclude_min=True)
MESSAGES: dict[str, st.SearchStrategy[Any]] = {
    "mating": st.one_of(
        st.builds(Propose, *OFFER),
        st.builds(Accept, *OFFER),
        st.builds(Refuse, ENCOUNTERS, REASONS),
        st.builds(Commit, ENCOUNTERS),
        st.builds(Abort, ENCOUNTERS),
        st.builds(Done, ENCOUNTERS),
    ),
    "join": st.one_of(
        st.builds(Join, ID, NAME, st.integers(-1, 2**31 - 1), ARENA_RUN, ORDINAL, TICK, KEY),
        st.builds(Leave, ID, ARENA_RUN, ORDINAL, TICK),
    ),
    "join_reply": st.one_of(
        st.builds(BodyGranted, ID, KEY, SLOT, ARENA_RUN, TICK, PERIOD, st.booleans(), TEXT),
        st.builds(BodyDenied, ID, TEXT),
    ),
    "observation": st.builds(Observation, ARENA_RUN, TICK, OBSERVATIONS, st.none() | CONTACTS),
    "action": st.builds(Action, TICK, ACTIONS),
}


@pytest.mark.parametrize("name", MESSAGES)
@given(st.data())
def test_what_is_encoded_is_decoded(name: str, data: st.DataObject) -> None:
    """Every message within its limits is decoded unchanged, and the other library writes the same bytes."""
    message = data.draw(MESSAGES[name])
    encoded = encode(message)
    assert DECODERS[name](encoded) == message
    assert msgspec.msgpack.encode(plain(message)) == encoded
    assert msgspec.msgpack.decode(encoded) == plain(message)
