"""A signed envelope proves who sent a message, to which robot, about which encounter, in which colony."""

import msgspec
import pytest
from hypothesis import given

from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.envelope import has_valid_signature, open_envelope, sign_message
from crcolony.protocol.mating_messages import (
    BY_INITIATOR,
    MatingMessage,
    decode_mating_message,
    receiver_of,
    sender_of,
)
from crcolony.protocol.signed_envelope import SignedEnvelope
from tests.crcolony.protocol.test_codec import MESSAGES
from tests.support.malformed_messages import EDGES
from tests.support.wire_decoders import VECTORS
from tests.vectors.make import COLONY, ENCOUNTER, INITIATOR, MATING_MESSAGES, RESPONDER, plain


class TestEnvelopes:
    """What is signed, by whom, and what is refused."""

    @pytest.mark.parametrize("name", MATING_MESSAGES)
    def test_the_vectors_are_valid(self, name: str) -> None:
        """Each is signed by the robot that sends this kind of message."""
        envelope, message = open_envelope(VECTORS[name])
        sender = INITIATOR if name in ("propose", "commit", "abort") else RESPONDER
        receiver = RESPONDER if sender is INITIATOR else INITIATOR
        assert has_valid_signature(envelope, COLONY)
        assert envelope.key == sender.public_key
        assert sender_of(message) == sender.id
        assert receiver_of(message) == receiver.id

    @pytest.mark.parametrize("name", MATING_MESSAGES)
    def test_their_content_is_read_and_written_alike_by_both_libraries(self, name: str) -> None:
        """The content is a message in its canonical form."""
        envelope, message = open_envelope(VECTORS[name])
        assert message == decode_mating_message(envelope.content) == MATING_MESSAGES[name]
        assert plain(message) == msgspec.msgpack.decode(envelope.content)
        assert msgspec.msgpack.encode(plain(message)) == envelope.content

    def test_no_bit_of_an_envelope_can_be_changed(self) -> None:
        """It is malformed then, or its signature is wrong."""
        good = VECTORS["commit"]
        for bit in range(8 * len(good)):
            changed = bytearray(good)
            changed[bit // 8] ^= 1 << bit % 8
            try:
                envelope, _ = open_envelope(bytes(changed))
            except WireError:
                continue
            assert not has_valid_signature(envelope, COLONY), f"bit {bit}"

    def test_an_envelope_of_another_colony_is_not_valid(self) -> None:
        """Nor is one of a colony whose name begins alike."""
        envelope, _ = open_envelope(VECTORS["propose"])
        for colony in ("", "vector", "vectors2", "Vectors"):
            assert not has_valid_signature(envelope, colony)

    def test_an_envelope_that_another_robot_signed_is_not_valid(self) -> None:
        """Not even with the sender's public key, which is known to all."""
        content = encode(MATING_MESSAGES["commit"])
        signature = RESPONDER.sign(b"crcolony mating 1 vectors\n" + content)
        envelope = SignedEnvelope(content, INITIATOR.public_key, signature)
        opened, _ = open_envelope(encode(envelope))
        assert not has_valid_signature(opened, COLONY)

    def test_the_signed_text_is_that_of_the_protocol(self) -> None:
        """The words crcolony, mating, version and colony, a line end, then the content byte for byte."""
        content = encode(MATING_MESSAGES["commit"])
        signature = INITIATOR.sign(b"crcolony mating 1 vectors\n" + content)
        assert signature == open_envelope(VECTORS["commit"])[0].signature

    def test_a_robot_cannot_send_the_message_of_another(self) -> None:
        """Its envelope is refused before any signature is verified."""
        with pytest.raises(WireError, match="not its sender's"):
            open_envelope(sign_message(MATING_MESSAGES["commit"], COLONY, RESPONDER))

    def test_the_longest_message_fits(self) -> None:
        """An envelope with 4,096 genes and the longest name is within the limit."""
        message = decode_mating_message(EDGES["largest_numbers"][1])
        assert open_envelope(sign_message(message, COLONY, INITIATOR))[1] == message


@given(MESSAGES["mating"])
def test_what_is_signed_is_opened(message: MatingMessage) -> None:
    """An envelope of its sender is opened and valid; of any other robot it is refused."""
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
