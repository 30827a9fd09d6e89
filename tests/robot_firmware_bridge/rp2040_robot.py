"""The reference firmware on an emulated RP2040 (rp2040js, a package of npm)."""

import shutil
from pathlib import Path

import pytest

from tests.robot_firmware_bridge.emulated_robot import BenchRobot
from tests.robot_firmware_bridge.firmware import FIRMWARE, build
from tests.robot_firmware_bridge.node_bench import NodeBench
from tests.robot_firmware_bridge.npm_packages import package_of_npm

_EMULATOR = package_of_npm("rp2040js")

needs_rp2040 = pytest.mark.skipif(
    _EMULATOR is None or any(shutil.which(tool) is None for tool in ("arm-none-eabi-gcc", "node")),
    reason="apt-get install --no-install-recommends gcc-arm-none-eabi nodejs npm, and"
    " the packages of npm in CONTRIBUTING.md",
)


class Rp2040Robot(NodeBench, BenchRobot):
    """An RP2040; its motors are its pins (see `firmware/bench/rp2040_bench.mjs`)."""

    def __init__(self, folder: Path, name: str = "robot") -> None:
        super().__init__(folder, name)
        self.start()

    def _links(self) -> list[Path]:
        return [self.host_link, self.ir_link]

    def _command(self) -> list[str]:
        firmware = build("rp2040") / "robot_rp2040.bin"
        return [str(FIRMWARE / "bench" / "rp2040_bench.mjs"), str(_EMULATOR), str(firmware)]

    def set_battery(self, volts: float) -> None:
        """See `EmulatedFirmware`."""
        self.tell(f"adc 0 {round(volts * 250)}")  # a divider of 1:4

    def set_proximity(self, sensor: int, distance_m: float) -> None:
        """See `EmulatedFirmware`."""
        self.tell(f"adc {sensor + 1} {round((0.3 - distance_m) / 0.3 * 3300)}")
