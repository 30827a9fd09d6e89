"""Messages to observers: any bytes are a message or refused."""

import random

import msgspec
import pytest

from crcolony.protocol import telemetry_messages
from crcolony.protocol.codec import Message, WireError, encode
from crcolony.protocol.telemetry_messages import RobotEvent, decode_state
from tests.support.wire_decoders import TELEMETRY_DECODER_OF, TELEMETRY_DECODERS, VECTORS
from tests.vectors.make import EVENTS, TELEMETRY

MUTATIONS = 1500


def test_there_is_a_vector_for_every_kind_of_telemetry() -> None:
    """There is one for every event, too."""
    kinds = {type(message) for message in TELEMETRY.values()} | {type(e) for e in EVENTS.values()}
    wire = {k for k in Message.__subclasses__() if k.__module__ == telemetry_messages.__name__}
    assert wire <= kinds
    assert {type(event) for event in EVENTS.values()} == set(RobotEvent.__args__)


@pytest.mark.parametrize("name", TELEMETRY)
def test_mutations_are_read_or_refused(name: str) -> None:
    """Bytes are changed, lost and inserted: the result is a message or WireError, the same on every run."""
    rng = random.Random(name)
    decode = TELEMETRY_DECODERS[TELEMETRY_DECODER_OF[name]]
    for _ in range(MUTATIONS):
        data = bytearray(VECTORS[name])
        for _ in range(rng.randint(1, 3)):
            at = rng.randrange(len(data) + 1)
            match rng.randrange(3):
                case 0:
                    data[at : at + 1] = bytes([rng.randrange(256)])
                case 1:
                    del data[at : at + rng.randint(1, 8)]
                case _:
                    data[at:at] = rng.randbytes(rng.randint(1, 8))
            if not data:
                break
        try:
            message = decode(bytes(data))
        except WireError:
            continue
        assert encode(message) == data


def test_the_state_of_a_robot_without_a_body_has_no_arena() -> None:
    """The empty name is allowed; a name with a line end is refused."""
    state = decode_state(VECTORS["state"])
    assert state.arena == ""
    with pytest.raises(WireError):
        decode_state(encode(msgspec.structs.replace(state, arena="lab\n")))
