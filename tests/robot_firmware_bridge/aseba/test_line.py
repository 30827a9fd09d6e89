"""Bytes of a line are whole messages, or the loss of the line."""

import pytest
from crcolony_bridge.aseba.line import AsebaLine
from crcolony_bridge.aseba.protocol import AsebaMessage, AsebaType, encode_message, request
from crcolony_bridge.errors import DeviceLostError
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_firmware_bridge.aseba.nodes import THYMIO_NODE, Line, Noise

PRESENT = encode_message(AsebaMessage(AsebaType.NODE_PRESENT, bytes(2), 1))


def test_a_line_that_is_opened_in_the_middle_of_a_message_is_understood() -> None:
    """What comes before the first pause is left out."""
    link = Line([THYMIO_NODE])
    link.half = PRESENT[3:]
    line = AsebaLine(link, "somewhere")
    line.discard_half_messages()
    line.send(request(AsebaType.LIST_NODES, 5))
    assert line.wait(lambda message: message.type == AsebaType.NODE_PRESENT, 1.0)


def test_what_does_not_come_is_waited_for_no_longer_than_the_time() -> None:
    """And other messages are seen meanwhile."""
    seen: list[int] = []
    line = AsebaLine(Line([THYMIO_NODE]), "somewhere")
    line.send(request(AsebaType.LIST_NODES, 5))

    def is_met(message: AsebaMessage) -> bool:
        seen.append(message.type)
        return False

    assert not line.wait(is_met, 0.05)
    assert seen == [AsebaType.NODE_PRESENT]


@given(st.lists(st.binary(min_size=1, max_size=40), max_size=6))
def test_noise_is_messages_or_the_loss_of_the_line(pieces: list[bytes]) -> None:
    """And no other error."""
    line = AsebaLine(Noise(pieces), "tcp:somewhere")
    with pytest.raises(DeviceLostError):
        line.wait(lambda message: False, 60.0)
