"""An address is a device and a board."""

import pytest
from crcolony_bridge.device_address import parse_address
from crcolony_bridge.errors import DeviceError


def test_an_address_is_a_device_and_a_board() -> None:
    """The default one if none is named; anything else is refused with what is expected."""
    assert parse_address("/dev/ttyACM0", "shield") == ("/dev/ttyACM0", "shield")
    assert parse_address("tcp:a:1?board=my.toml", "shield") == ("tcp:a:1", "my.toml")
    for wrong in ("/dev/ttyACM0?baud=9600", "/dev/ttyACM0?board=", "/dev/ttyACM0?board"):
        with pytest.raises(DeviceError, match=r"expected DEVICE\?board=NAME"):
            parse_address(wrong, "shield")
