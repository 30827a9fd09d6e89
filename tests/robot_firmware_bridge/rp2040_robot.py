"""The reference firmware on an emulated RP2040 (rp2040js, a package of npm)."""

import os
import shutil
import subprocess
import tty
from pathlib import Path

import pytest

from tests.robot_firmware_bridge.emulated_robot import BenchRobot
from tests.robot_firmware_bridge.firmware import FIRMWARE, build
from tests.robot_firmware_bridge.npm_packages import package_of_npm

_EMULATOR = package_of_npm("rp2040js")

needs_rp2040 = pytest.mark.skipif(
    _EMULATOR is None or any(shutil.which(tool) is None for tool in ("arm-none-eabi-gcc", "node")),
    reason="apt-get install --no-install-recommends gcc-arm-none-eabi nodejs npm, and"
    " npm install --no-save rp2040js@1.4.1 in the repository",
)


class Rp2040Robot(BenchRobot):
    """An RP2040; its motors are its pins (see `firmware/bench/rp2040_bench.mjs`)."""

    def __init__(self, folder: Path, name: str = "robot") -> None:
        super().__init__(folder, name)
        self._held: list[int] = []
        self.start()

    def _launch(self) -> "subprocess.Popen[str]":
        firmware = build("rp2040") / "robot_rp2040.bin"
        pairs = [os.openpty(), os.openpty()]
        self._held = [follower for _, follower in pairs]  # so that a controller may come and go
        for link, follower in zip((self.host_link, self.ir_link), self._held, strict=True):
            link.unlink(missing_ok=True)
            link.symlink_to(os.ttyname(follower))
            tty.setraw(follower)
        leaders = [leader for leader, _ in pairs]
        # The bench has its links as file descriptors 3 and 4, whatever they are here.
        script = f'exec node "$@" 3<&{leaders[0]} 3>&{leaders[0]} 4<&{leaders[1]} 4>&{leaders[1]}'
        bench = str(FIRMWARE / "bench" / "rp2040_bench.mjs")
        shell = ["setpriv", "--pdeathsig", "KILL", "bash", "-c", script, "bench"]
        process = subprocess.Popen(
            [*shell, bench, str(_EMULATOR), str(firmware)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            bufsize=1,
            pass_fds=leaders,
        )
        for leader in leaders:
            os.close(leader)
        return process

    def switch_off(self) -> None:
        """See `EmulatedRobot`."""
        super().switch_off()
        for follower in self._held:
            os.close(follower)

    def set_battery(self, volts: float) -> None:
        """See `EmulatedFirmware`."""
        self.tell(f"adc 0 {round(volts * 250)}")  # a divider of 1:4

    def set_proximity(self, sensor: int, distance_m: float) -> None:
        """See `EmulatedFirmware`."""
        self.tell(f"adc {sensor + 1} {round((0.3 - distance_m) / 0.3 * 3300)}")
