"""What a robot says of itself becomes its description."""

import json

import pytest
from crcolony_bridge.driver import IrMode
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.reference_firmware.messages import Capability, Info
from crcolony_bridge.reference_firmware.readings import describe_robot

TEXT = json.dumps(
    dict.fromkeys(("track_m", "radius_m", "max_speed_m_s", "proximity_range_m", "watchdog_s"), 0.1)
    | {"model": "robot", "proximity_bearings_rad": [0.0]}
    | {"battery_empty_v": 6.0, "battery_full_v": 8.0}
).encode()


@pytest.mark.parametrize(
    ("capabilities", "max_ir_bytes", "ir"),
    [
        (Capability.IR, 768, "messages"),
        (Capability.IR, 2, "tokens"),
        (Capability(0), 2, "none"),
    ],
)
def test_its_longest_message_by_infrared_says_whether_it_carries_words_alone(
    capabilities: Capability, max_ir_bytes: int, ir: IrMode
) -> None:
    """A word has two bytes."""
    info = Info(1, 1, capabilities, 500, max_ir_bytes, 0, len(TEXT), bytes(8))
    described = describe_robot(TEXT, info, 0.02, "here")
    assert (described.ir, described.max_ir_bytes) == (ir, max_ir_bytes)


def test_a_text_that_is_no_description_is_refused() -> None:
    """With the address."""
    info = Info(1, 1, Capability.IR, 500, 768, 0, 2, bytes(8))
    with pytest.raises(DeviceError, match="here: its description cannot be read"):
        describe_robot(b"[]", info, 0.02, "here")
