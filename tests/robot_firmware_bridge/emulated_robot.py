"""Robots on emulated controllers, at the speed of the wall clock; here the reference firmware on an ATmega2560."""

import re
import subprocess
from abc import ABC, abstractmethod
from pathlib import Path
from types import TracebackType
from typing import Self

from tests.robot_firmware_bridge.firmware import build
from tests.robot_firmware_bridge.printed_lines import LineProcess, PrintedLines


class EmulatedRobot(PrintedLines, ABC):
    """A running emulator, which is switched off at the end of its context.

    Its links are pseudo-terminals, and what its motors are given is in `lines`:
    `wheels LEFT RIGHT at MS` in mm/s; of a robot with the reference firmware also `hung at MS` and `reset at MS`.
    """

    def __init__(self, folder: Path, name: str = "robot") -> None:
        super().__init__()
        self.host_link, self.ir_link = folder / f"{name}-host", folder / f"{name}-ir"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.switch_off()

    @abstractmethod
    def start(self) -> None:
        """Switch it on."""

    @abstractmethod
    def switch_off(self) -> None:
        """End the emulator: the links go, as when a cable is pulled."""

    @property
    def wheels(self) -> tuple[int, int]:
        """What the motors are given now (mm/s)."""
        for line in reversed(self.lines):
            if match := re.match(r"wheels (-?\d+) (-?\d+)", line):
                return int(match[1]), int(match[2])
            if line == "ready":
                break  # it was switched on since
        return 0, 0


class EmulatedFirmware(EmulatedRobot):
    """An emulator with the reference firmware, whose sensors and faults are ours."""

    @abstractmethod
    def set_battery(self, volts: float) -> None:
        """Set what the battery has."""

    @abstractmethod
    def set_proximity(self, sensor: int, distance_m: float) -> None:
        """Put something in front of a proximity sensor."""

    @abstractmethod
    def hang(self) -> None:
        """Keep the firmware's loop from going on."""


class BenchProcess(EmulatedRobot, LineProcess):
    """An emulator that is told by lines on its standard input, and tells on its output."""

    @abstractmethod
    def _launch(self) -> "subprocess.Popen[str]":
        """Start the bench's process with pipes, and its links."""

    def start(self) -> None:
        """See `EmulatedRobot`."""
        since = len(self.lines)
        self._begin(self._launch())
        self.wait_for("ready", since=since)

    def switch_off(self) -> None:
        """See `EmulatedRobot`."""
        self.kill()


class BenchRobot(BenchProcess, EmulatedFirmware):
    """A bench with the reference firmware."""

    def hang(self) -> None:
        """See `EmulatedFirmware`."""
        self.tell("hang")


class AvrRobot(BenchRobot):
    """An ATmega2560 in simavr; its motors are its pins (see `firmware/bench/simavr_bench.c`)."""

    def __init__(self, folder: Path, name: str = "robot", uid: int = 1, defines: str = "") -> None:
        super().__init__(folder, name)
        self._uid, self._defines = uid, defines
        self.start()

    def _launch(self) -> "subprocess.Popen[str]":
        folder = build("avr", self._uid, self._defines)
        bench, firmware = folder / "simavr_bench", folder / "robot_atmega2560.elf"
        return subprocess.Popen(
            [str(bench), str(firmware), str(self.host_link), str(self.ir_link)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            bufsize=1,
        )

    def set_battery(self, volts: float) -> None:
        """See `EmulatedFirmware`."""
        self.tell(f"adc 7 {round(volts * 500)}")  # a divider of 1:2

    def set_proximity(self, sensor: int, distance_m: float) -> None:
        """See `EmulatedFirmware`."""
        self.tell(f"adc {sensor} {round((0.3 - distance_m) / 0.3 * 5000)}")
