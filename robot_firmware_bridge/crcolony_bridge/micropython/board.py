"""What the robot script needs of a board; `boards/` has one for each."""

from typing import Protocol


class Board(Protocol):
    """A controller with its motors and sensors. Nothing here may block for longer than a few milliseconds."""

    uid: bytes
    """Eight bytes, of this very controller"""
    description: bytes
    """A JSON object, as the reference firmware has it"""
    capabilities: int
    proximity_sensors: int
    battery_low_mv: int
    battery_critical_mv: int
    """Both 0 without a battery that is measured"""

    def received(self) -> bytes:
        """Return what the host has sent; if there is nothing, rest for a moment."""
        ...

    def send(self, data: bytes) -> None:
        """Send to the host."""
        ...

    def ms(self) -> int:
        """Return the milliseconds since the start."""
        ...

    def set_wheels(self, left_mm_s: int, right_mm_s: int) -> None:
        """Drive the motors, positive ahead."""
        ...

    def set_outputs(self, red: int, green: int, blue: int, speaker: int, switches: int) -> None:
        """Set lamp, speaker and jaw, as far as there are any."""
        ...

    def battery_mv(self) -> int:
        """Return the battery's voltage."""
        ...

    def proximity_mm(self, sensor: int) -> int:
        """Return the distance at a sensor, 0xFFFF for nothing in range."""
        ...

    def release(self) -> None:
        """Give the link back to MicroPython's prompt."""
        ...
