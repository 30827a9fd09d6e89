"""What a line says before a robot is driven: every answer but the right one is an error in one line."""

import numpy as np
import pytest
from crcolony_bridge.aseba.protocol import AsebaMessage, encode_message
from crcolony_bridge.aseba.session import AsebaSession
from crcolony_bridge.errors import DeviceError, DeviceLostError
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.robot_firmware_bridge.aseba.nodes import E_PUCK_NODE, Line, Node, Noise

OTHER = Node("e-puck1", E_PUCK_NODE.variables, E_PUCK_NODE.events, number=2)
KNOWN = E_PUCK_NODE.variables
WITHOUT_MOTORS = {name: words for name, words in KNOWN.items() if name != "speed.left"}


@pytest.mark.parametrize(
    ("nodes", "uid", "said"),
    [
        ([E_PUCK_NODE, OTHER], "", "nodes 1, 2 are there; give the uid of one"),
        ([E_PUCK_NODE], "e-puck-7", "robot e-puck-1 is there, not e-puck-7"),
        ([OTHER], "thymio-2", "robot e-puck-2 is there, not thymio-2"),
        ([Node("marxbot", KNOWN, ())], "", "a robot named marxbot is not known; known are e-puck"),
        ([Node("e-puck0", KNOWN, (), version=4)], "", "e-puck0 speaks version 4"),
        ([Node("e-puck0", WITHOUT_MOTORS, ("ir_sensors",))], "", "no variable speed.left"),
        ([Node("e-puck0", KNOWN, ("camera",))], "", "e-puck0 has no event ir_sensors"),
        (
            [Node("e-puck0", KNOWN, ("ir_sensors",), bytecode_words=9)],
            "",
            "e-puck0 has no room for the program that stops its wheels",
        ),
    ],
)
def test_a_robot_that_cannot_be_driven_is_refused(nodes: list[Node], uid: str, said: str) -> None:
    """With the address, and what is wrong."""
    with pytest.raises(DeviceError, match=f"somewhere: .*{said}"):
        AsebaSession(Line(nodes), "somewhere").start(uid, is_stopped=False)


def test_a_line_that_is_opened_in_the_middle_of_a_message_is_understood() -> None:
    """What comes before the first pause is left out."""
    line = Line([OTHER, Node("marxbot", KNOWN, ())])
    line.half = b"\xff\xff\x01"
    with pytest.raises(DeviceError, match="nodes 1, 2 are there"):
        AsebaSession(line, "somewhere").start("", is_stopped=False)


@settings(max_examples=50)
@given(st.lists(st.binary(min_size=1, max_size=700), max_size=6))
def test_noise_on_the_line_is_no_crash(pieces: list[bytes]) -> None:
    """It is the loss of a device, or no device."""
    with pytest.raises((DeviceError, DeviceLostError)):
        AsebaSession(Noise(pieces), "somewhere").start("", is_stopped=False)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_parts_of_a_description_in_any_order_are_no_crash(seed: int) -> None:
    """Also with bytes that are not what they were."""
    rng = np.random.default_rng(seed)
    pieces = [encode_message(AsebaMessage(0x900C, b"\x05\x00", 1))]
    for place in rng.integers(0, len(E_PUCK_NODE.messages), 30):
        data = bytearray(encode_message(E_PUCK_NODE.messages[place]))
        if rng.random() < 0.3:
            data[rng.integers(6, len(data))] = rng.integers(256)
        pieces.append(bytes(data))
    with pytest.raises((DeviceError, DeviceLostError)):
        AsebaSession(Noise(pieces), "somewhere").start("", is_stopped=False)
