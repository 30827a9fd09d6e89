"""The foreign robot reads and writes the golden vectors, and refuses what PROTOCOL.md says is none."""

import msgpack  # type: ignore[import-untyped]
import pytest
from nacl.public import PrivateKey
from nacl.signing import SigningKey

from crcolony.body.contract import OBSERVATION
from crcolony.protocol.identity import seeded
from tests.foreign import body_link
from tests.foreign.driving import LIMITS
from tests.foreign.identity import ARENA, id_of, open_envelope, seal
from tests.foreign.messages import (
    BODY_BYTES,
    ENVELOPE_BYTES,
    FIELDS,
    MATING,
    RefusedError,
    decode,
    encode,
)
from tests.foreign.species import species
from tests.support.gene_table import DEFAULT_SCHEMA
from tests.vectors.make import (
    ARENA_IDENTITY,
    BODIES,
    COLONY,
    ENCOUNTER,
    FOLDER,
    INITIATOR,
    LINK,
    LINK_KEYS,
    RESPONDER,
)

SPOKEN = [*(name for name in BODIES if name != "local_link"), "history_request", "robot_metadata"]
"""It shares no memory with its body."""
SECRET = bytes(range(32))
OTHER_SECRET = bytes(range(32, 64))
KEY = SigningKey(bytes.fromhex("3c9d459f875c0bc4043baaee1a6c34c3bd3dc33a2c3129277e004ecaa729b581"))


def vector(name: str) -> bytes:
    return (FOLDER / f"{name}.msgpack").read_bytes()


@pytest.mark.parametrize("name", SPOKEN)
def test_it_reads_and_writes_the_vectors(name: str) -> None:
    """Byte for byte."""
    message = decode(vector(name), ENVELOPE_BYTES, *FIELDS)
    assert encode(message) == vector(name)
    assert message[0] == name.removesuffix("_alone")


@pytest.mark.parametrize("name", MATING)
def test_it_opens_and_verifies_the_vectors_of_a_mating(name: str) -> None:
    """And not as one of another colony."""
    envelope = open_envelope(vector(name))
    envelope.verify(f"crcolony mating 1 {COLONY}")
    with pytest.raises(RefusedError):
        envelope.verify("crcolony mating 1 another")
    message = decode(envelope.content, ENVELOPE_BYTES, *MATING)
    assert message[1] == [INITIATOR.id, RESPONDER.id, 3, 300]
    assert id_of(envelope.key) in message[1]


def test_it_signs_as_the_vectors_are_signed() -> None:
    """Ed25519 has one signature for one text."""
    content = encode(["commit", [ENCOUNTER.initiator, ENCOUNTER.responder, 3, 300]])
    assert seal(KEY, f"crcolony mating 1 {COLONY}", content) == vector("commit")
    assert id_of(bytes(KEY.verify_key)) == INITIATOR.id == seeded(COLONY, 1, 1).id


@pytest.mark.parametrize("name", SPOKEN)
def test_it_refuses_every_message_that_is_cut_prolonged_or_not_canonical(name: str) -> None:
    """Nothing but a refusal comes of it."""
    good = vector(name)
    message = msgpack.unpackb(good)
    bad = [good[:length] for length in range(len(good))] + [good + b"\x00"]
    bad += [encode(message[:-1]), encode([*message, 0]), encode([message[0].upper(), *message[1:]])]
    bad += [encode([*message[:place], {}, *message[place + 1 :]]) for place in range(len(message))]
    bad += [b"\xdc" + len(message).to_bytes(2, "big") + good[1:]]  # a longer header of the array
    for payload in bad:
        with pytest.raises(RefusedError):
            decode(payload, ENVELOPE_BYTES, *FIELDS)


def test_it_agrees_on_the_keys_of_the_link_of_the_vectors() -> None:
    """From both ends."""
    request, reply = (open_envelope(LINK[f"link_{end}.bytes"]) for end in ("request", "reply"))
    for secret, public in ((SECRET, OTHER_SECRET), (OTHER_SECRET, SECRET)):
        other = bytes(PrivateKey(public).public_key)
        keys = body_link.agreed_keys(PrivateKey(secret), other, request.content, reply.content)
        assert keys == (LINK_KEYS.observations, LINK_KEYS.actions)


def test_it_takes_the_body_that_the_vectors_grant() -> None:
    """And opens its observation, and seals the action that they have."""
    content = vector("join")
    own = PrivateKey(SECRET)
    envelope = LINK["link_request.bytes"]
    assert seal(KEY, body_link.signed_text("lab"), content) == envelope
    request = body_link.Request(2**61, content, envelope, own)
    link = body_link.granted(request, LINK["link_reply.bytes"], "lab", None)
    assert isinstance(link, body_link.Link)
    assert link.arena_id == id_of(ARENA_IDENTITY.public_key, ARENA)
    body = body_link.LinkedBody(link)
    observation = body.observation(LINK["link_observation.bytes"])
    assert isinstance(observation, list)
    assert encode(observation) == vector("observation")
    row = decode(vector("action"), BODY_BYTES, "action")[2]
    assert body.action(row) == LINK["link_action.bytes"]
    for other in (b"", b"\x00" * 16, vector("observation"), LINK["link_action.bytes"]):
        with pytest.raises(RefusedError):
            body.observation(other)


def test_it_takes_no_body_of_another_arena_or_for_another_request() -> None:
    """Whoever signed it."""
    request = body_link.Request(2**61, vector("join"), b"", PrivateKey(SECRET))
    for changed, name, known in (
        (request, "another", None),
        (request, "lab", b"x" * 16),
        (request._replace(content=vector("leave")), "lab", None),
        (request._replace(arena_run=7), "lab", None),
    ):
        with pytest.raises(RefusedError):
            body_link.granted(changed, LINK["link_reply.bytes"], name, known)


def test_an_exchange_key_of_small_order_is_refused() -> None:
    """With it anybody would know the keys."""
    with pytest.raises(RefusedError):
        body_link.agreed_keys(PrivateKey(SECRET), bytes(32), b"request", b"reply")


def test_it_knows_the_limits_of_what_a_body_senses() -> None:
    """As the table of the page has them."""
    assert [(quantity.low, quantity.high) for quantity in OBSERVATION] == list(LIMITS)


def test_it_computes_the_digests_of_schemas() -> None:
    """Of the page's example, and of the default species."""
    assert (
        species("weight -inf inf\nrate 0.0 1.0").digest.hex() == "7640c86bf308c2eb8ff379d079102212"
    )
    default = species(DEFAULT_SCHEMA.text)
    assert (default.digest.hex(), len(default.genes)) == (
        DEFAULT_SCHEMA.digest,
        len(DEFAULT_SCHEMA),
    )
