"""Infrared carries words where a robot has all that it takes, and not where it is only declared."""

from dataclasses import replace

import pytest
from crcolony_bridge.aseba.ir_words import find_word_port
from crcolony_bridge.aseba.models import E_PUCK, THYMIO

from tests.robot_firmware_bridge.aseba.nodes import E_PUCK_NODE, THYMIO_NODE, Node
from tests.robot_firmware_bridge.aseba.word_thymio import WITHOUT_EFFECT, WORD_THYMIO, WORDS


def test_a_real_thymio_has_a_port() -> None:
    """With the addresses of its variables."""
    node = WORD_THYMIO.described
    port = find_word_port(THYMIO.ir_words, node)
    assert port is not None
    assert (port.sent, port.received) == (node.address(WORDS.sent), node.address(WORDS.received))


@pytest.mark.parametrize(
    "node",
    [
        THYMIO_NODE,
        WITHOUT_EFFECT,
        replace(WORD_THYMIO, events=THYMIO_NODE.events),
        replace(WORD_THYMIO, natives=THYMIO_NODE.natives),
    ],
)
def test_without_a_variable_the_event_or_the_native_function_there_is_none(node: Node) -> None:
    """As in simulators."""
    assert find_word_port(THYMIO.ir_words, node.described) is None


def test_an_e_puck_has_none() -> None:
    """Its firmware has no infrared."""
    assert find_word_port(E_PUCK.ir_words, E_PUCK_NODE.described) is None
