"""MicroPython itself, run here as on a board with a USB console; its hardware is `micropython_bench.mjs`."""

import shutil
from pathlib import Path

import pytest

from tests.robot_firmware_bridge.node_bench import NodeBench
from tests.robot_firmware_bridge.npm_packages import package_of_npm

_INTERPRETER = package_of_npm("@micropython/micropython-webassembly-pyscript")

needs_micropython = pytest.mark.skipif(
    _INTERPRETER is None or shutil.which("node") is None,
    reason="apt-get install --no-install-recommends nodejs npm, and"
    " the packages of npm in CONTRIBUTING.md",
)


class UsbBoard(NodeBench):
    """A board with these named pins; `lines` has what pins are set to: `pin NAME VALUE`, `pwm NAME DUTY`."""

    has_blocking_links = False

    def __init__(self, folder: Path, *named_pins: str) -> None:
        super().__init__(folder, "board")
        self._named_pins = named_pins
        self.start()

    def level(self, kind: str, pin: str) -> int:
        """Return what a pin, or its PWM, was set to last."""
        for line in reversed(self.lines):
            if line.startswith(f"{kind} {pin} "):
                return int(line.split()[2])
        raise AssertionError(f"{kind} {pin} was never set")

    def _links(self) -> list[Path]:
        return [self.host_link]

    def _command(self) -> list[str]:
        bench = Path(__file__).with_name("micropython_bench.mjs")
        return [str(bench), str(_INTERPRETER), *self._named_pins]
