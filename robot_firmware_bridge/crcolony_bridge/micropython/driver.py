"""Robots whose controller runs MicroPython, over a serial line or TCP: `/dev/ttyACM0?board=NAME`.

The script is uploaded when the robot is connected, and again after each reset; then the robot is as with the reference
firmware: the time to live and the latch are the script's. No hardware watchdog guards it, for MicroPython's prompt
could not be reached any more: an error in the script stops the wheels, a hang of MicroPython itself does not.
"""

import dataclasses
from collections.abc import Callable

from crcolony_bridge.device_address import parse_address
from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.link import Link, open_link
from crcolony_bridge.micropython.upload import BOARDS, upload
from crcolony_bridge.reference_firmware.driver import SerialFirmware

BAUD = 115_200
_DEFAULT_BOARD = "microbit"
_PERIOD_S = 0.1
"""Of the script, which sends no telemetry faster."""


class MicroPythonRobot(SerialFirmware):
    """A robot with MicroPython on one of the boards of `boards/`, a micro:bit if none is named.

    `uid` is the one that is expected there, "" for any. Raises DeviceError for a board that there is not.
    """

    def __init__(
        self,
        address: str,
        uid: str = "",
        baud: int = BAUD,
        connect: Callable[[str, int], Link] = open_link,
    ) -> None:
        device, board = parse_address(address, _DEFAULT_BOARD)
        if board not in BOARDS:
            raise DeviceError(
                f"{address}: no board {board!r}; there is {', '.join(sorted(BOARDS))}"
            )

        def connect_and_upload(address: str, baud: int) -> Link:
            link = connect(address, baud)
            try:
                upload(link, board, address)
            except BaseException:
                link.close()
                raise
            return link

        super().__init__(device, uid, baud, connect_and_upload)

    @property
    def description(self) -> RobotDescription:
        """See `Driver`."""
        return dataclasses.replace(
            super().description, watchdog="uploaded program", period_s=_PERIOD_S
        )
