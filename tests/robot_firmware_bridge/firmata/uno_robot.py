"""An emulated Arduino Uno (simavr) with unmodified StandardFirmata, as it is in the package avrgirl-arduino of npm."""

import re
import signal
import subprocess
from pathlib import Path

import pytest
from crcolony_bridge.firmata.board import DEFAULT_BOARD, Board, Motor, load_board

from tests.robot_firmware_bridge.emulated_robot import BenchProcess
from tests.robot_firmware_bridge.firmware import build
from tests.robot_firmware_bridge.npm_packages import package_of_npm

_PACKAGE = package_of_npm("avrgirl-arduino")
_FIRMWARE = _PACKAGE / "junk/hex/uno/StandardFirmata.cpp.hex" if _PACKAGE is not None else None
needs_firmata = pytest.mark.skipif(
    _FIRMWARE is None or not _FIRMWARE.exists() or not Path("/usr/include/simavr").exists(),
    reason="apt-get install simavr libsimavr-dev npm, and .ci/fetch_firmata in the repository",
)


class UnoRobot(BenchProcess):
    """An Uno; of its wheels it has full PWM for 255, and the pins by which they turn are those of a board."""

    def __init__(self, folder: Path, name: str = "uno", board: str = DEFAULT_BOARD) -> None:
        super().__init__(folder, name)
        self._board: Board = load_board(board)
        self.start()

    def _launch(self) -> "subprocess.Popen[str]":
        bench = build("uno") / "simavr_uno"
        return subprocess.Popen(
            [str(bench), str(_FIRMWARE), str(self.host_link)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            bufsize=1,
        )

    def set_volts(self, channel: int, volts: float) -> None:
        """Set what an analog channel has."""
        self.tell(f"adc {channel} {round(1000 * volts)}")

    def freeze(self) -> None:
        """Keep it from doing anything, for the rest of its life."""
        self._process.send_signal(signal.SIGSTOP)

    def _add(self, line: str) -> None:
        """Add what the wheels do to what the pins do."""
        super()._add(line)
        if match := re.match(r"pins ([\d ]+) at (\d+)", line):
            levels = [int(level) for level in match[1].split()]
            left, right = (_duty(m, levels) for m in (self._board.left, self._board.right))
            if (left, right) != self.wheels:
                super()._add(f"wheels {left} {right} at {match[2]}")


def _duty(motor: Motor, levels: list[int]) -> int:
    high = [levels[pin] > 0 if pin is not None else None for pin in (motor.ahead, motor.back)]
    if high[0] == high[1]:
        return 0
    return levels[motor.pwm] if high[0] or high[1] is False else -levels[motor.pwm]
