"""The reference firmware on an emulated Cortex-M3: QEMU's LM3S6965 evaluation board.

The board has no motors and no sensors; a block of its memory stands in for them (`firmware/hal/cortex_m3/board.h`).
It is read here through QEMU's monitor: what the motors are given is seen without the firmware's telemetry.
"""

import struct
import threading
from pathlib import Path

from tests.robot_firmware_bridge.emulated_robot import EmulatedFirmware
from tests.robot_firmware_bridge.firmware import build
from tests.robot_firmware_bridge.qemu_monitor import Qemu

_BOARD = 0x2000FF00
_CHANGES, _BATTERY, _PROXIMITY, _LOG = _BOARD + 4, _BOARD + 8, _BOARD + 12, _BOARD + 32
_LOG_ENTRIES = 16
_FREE = _BOARD + 0xF0
_BRANCH_TO_ITSELF = b"\xfe\xe7"
_LOOK_EVERY_S = 0.01


class CortexRobot(EmulatedFirmware):
    """An LM3S6965 in QEMU."""

    def __init__(self, folder: Path, name: str = "robot") -> None:
        super().__init__(folder, name)
        self.start()

    def start(self) -> None:
        """See `EmulatedRobot`."""
        self._seen = 0
        self._reset_ms = 0.0
        self._started_s: float | None = None
        self._is_hanging = False
        kernel = build("cortex_m3") / "robot_lm3s6965.elf"
        self._qemu = Qemu(["-M", "lm3s6965evb", "-kernel", str(kernel)], 2, self._on_event)
        for link, line in zip((self.host_link, self.ir_link), self._qemu.lines, strict=True):
            link.unlink(missing_ok=True)
            link.symlink_to(line)
        self._qemu.resume()
        self._off = threading.Event()
        self._looking = threading.Thread(target=self._look, daemon=True)
        self._looking.start()

    def set_battery(self, volts: float) -> None:
        """See `EmulatedFirmware`."""
        self._qemu.debug({_BATTERY: struct.pack("<H", round(volts * 1000))})

    def set_proximity(self, sensor: int, distance_m: float) -> None:
        """See `EmulatedFirmware`."""
        self._qemu.debug({_PROXIMITY + 2 * sensor: struct.pack("<H", round(distance_m * 1000))})

    def hang(self) -> None:
        """See `EmulatedFirmware`."""
        self._is_hanging = True
        self._qemu.debug({_FREE: _BRANCH_TO_ITSELF}, program_counter=_FREE)

    def switch_off(self) -> None:
        """See `EmulatedRobot`."""
        self._off.set()
        self._looking.join()
        self._qemu.end()

    def _on_event(self, name: str, at_s: float) -> None:
        """Take what happens to the machine: in order with what is read of its memory, for both come by one stream."""
        if name == "RESUME" and self._started_s is None:
            self._started_s = at_s
        elif name == "RESUME" and self._is_hanging:
            self._is_hanging = False
            self._add(f"hung at {round(self._ms(at_s))}")
        elif name == "RESET" and self._started_s is not None:
            self._reset_ms = self._ms(at_s)
            self._add(f"reset at {round(self._reset_ms)}")

    def _ms(self, at_s: float) -> float:
        assert self._started_s is not None
        return (at_s - self._started_s) * 1000

    def _look(self) -> None:
        while not self._off.wait(_LOOK_EVERY_S):
            words = self._qemu.words(_CHANGES, (_LOG - _CHANGES) // 4 + 2 * _LOG_ENTRIES)
            changes, log = words[0], words[(_LOG - _CHANGES) // 4 :]
            for change in range(self._seen, changes):
                at_ms, speeds = log[change % _LOG_ENTRIES * 2 :][:2]
                left, right = struct.unpack("<hh", speeds.to_bytes(4, "little"))
                self._add(f"wheels {left} {right} at {round(self._reset_ms + at_ms)}")
            self._seen = changes
