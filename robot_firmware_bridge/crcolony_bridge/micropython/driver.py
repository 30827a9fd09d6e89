"""Robots whose controller runs MicroPython, over a serial line or TCP.

The script is uploaded when the robot is connected, and again after each reset; then the robot is as with the reference
firmware: the time to live and the latch are the script's. No hardware watchdog guards it, for MicroPython's prompt
could not be reached any more: an error in the script stops the wheels, a hang of MicroPython itself does not.
"""

import dataclasses
from collections.abc import Callable

from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.link import Link, open_link
from crcolony_bridge.micropython.upload import upload
from crcolony_bridge.reference_firmware.driver import SerialFirmware

BAUD = 115_200
_PERIOD_S = 0.1
"""Of the script, which sends no telemetry faster."""


class MicroPythonRobot(SerialFirmware):
    """A robot with MicroPython on one of the boards of `boards/`. `uid` is the expected one, "" for any."""

    def __init__(
        self,
        address: str,
        uid: str = "",
        baud: int = BAUD,
        board: str = "microbit",
        connect: Callable[[str, int], Link] = open_link,
    ) -> None:
        def connect_and_upload(address: str, baud: int) -> Link:
            link = connect(address, baud)
            try:
                upload(link, board, address)
            except BaseException:
                link.close()
                raise
            return link

        super().__init__(address, uid, baud, connect_and_upload)

    @property
    def description(self) -> RobotDescription:
        """See `Driver`."""
        return dataclasses.replace(
            super().description, watchdog="uploaded program", period_s=_PERIOD_S
        )
