"""An emulated BBC micro:bit (QEMU) with the MicroPython that Debian ships, unmodified: the script is uploaded to it.

What its motors are given is seen at the pins of its controller. QEMU's timers carry no PWM that changes: of the speeds
only the directions are seen. Nor can its input pins be set: its detectors of obstacles see nothing.
"""

import shutil
import threading
import time
from pathlib import Path

import pytest

from tests.robot_firmware_bridge.emulated_robot import EmulatedRobot
from tests.robot_firmware_bridge.qemu_monitor import Qemu

_FIRMWARE = Path("/usr/share/firmware-microbit-micropython/firmware.hex")
_PINS_OUT = 0x50000504
_AHEAD, _BACK = (18, 23), (20, 22)
"""Of the left and the right motor: pins 8 and 13, 12 and 14 of the board, as its controller numbers them."""
_LOOK_EVERY_S = 0.005

needs_microbit = pytest.mark.skipif(
    not _FIRMWARE.exists() or shutil.which("qemu-system-arm") is None,
    reason="apt-get install --no-install-recommends qemu-system-arm firmware-microbit-micropython",
)


class MicrobitRobot(EmulatedRobot):
    """A micro:bit in QEMU; of its wheels 1 is ahead and -1 is back, and the times are of the wall clock."""

    def __init__(self, folder: Path, name: str = "microbit") -> None:
        super().__init__(folder, name)
        self.start()

    def start(self) -> None:
        """See `EmulatedRobot`."""
        self._started_s = time.monotonic()
        loader = f"loader,file={_FIRMWARE}"
        self._qemu = Qemu(["-M", "microbit", "-device", loader], 1, lambda name, at_s: None)
        self.host_link.unlink(missing_ok=True)
        self.host_link.symlink_to(self._qemu.lines[0])
        self._qemu.resume()
        self._off = threading.Event()
        self._looking = threading.Thread(target=self._look, daemon=True)
        self._looking.start()

    def now_ms(self) -> int:
        """Return the time since it was switched on, by the wall clock."""
        return round((time.monotonic() - self._started_s) * 1000)

    def switch_off(self) -> None:
        """See `EmulatedRobot`."""
        self._off.set()
        self._looking.join()
        self._qemu.end()

    def _look(self) -> None:
        while not self._off.wait(_LOOK_EVERY_S):
            (pins,) = self._qemu.words(_PINS_OUT, 1)
            left, right = (
                (pins >> a & 1) - (pins >> b & 1) for a, b in zip(_AHEAD, _BACK, strict=True)
            )
            if (left, right) != self.wheels:
                self._add(f"wheels {left} {right} at {self.now_ms()}")
