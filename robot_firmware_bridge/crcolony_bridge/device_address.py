"""Addresses of robots whose driver has to be told on which board they are: `DEVICE?board=NAME`."""

from typing import NamedTuple

from crcolony_bridge.errors import DeviceError


class DeviceAddress(NamedTuple):
    """Where a robot is, and on which board."""

    device: str
    """The path of a serial device, or tcp:HOST:PORT"""
    board: str


def parse_address(address: str, default_board: str) -> DeviceAddress:
    """Return the parts of an address; raises DeviceError for an option that there is not."""
    device, _, option = address.partition("?")
    name, _, board = option.partition("=")
    if option and (name != "board" or not board):
        raise DeviceError(
            f"{address}: expected DEVICE?board=NAME, as in /dev/ttyACM0?board={default_board}"
        )
    return DeviceAddress(device, board or default_board)
