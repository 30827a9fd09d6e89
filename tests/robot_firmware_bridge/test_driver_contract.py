"""All drivers pass the contract test that is shipped for authors of drivers."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from crcolony_bridge.aseba.driver import AsebaRobot
from crcolony_bridge.driver import Driver
from crcolony_bridge.driver_contract_test import DriverContract
from crcolony_bridge.firmata.driver import FirmataRobot
from crcolony_bridge.reference_firmware.driver import SerialFirmware

from crcolony.body import contract
from crcolony.compiled import FloatArray
from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmata.uno_robot import UnoRobot, needs_firmata
from tests.robot_firmware_bridge.firmware import needs_avr
from tests.robot_firmware_bridge.playground import (
    PlacedRobot,
    free_port,
    needs_playground,
    playground,
)


@pytest.fixture(scope="module")
def attached(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SerialFirmware]:
    """A driver of an emulated robot."""
    with AvrRobot(tmp_path_factory.mktemp("robot")) as robot:
        yield SerialFirmware(str(robot.host_link))


@needs_avr
class TestReferenceFirmware(DriverContract):
    """The reference firmware on an emulated controller."""

    period_s = 0.05

    @pytest.fixture(autouse=True)
    def _emulated(self, attached: SerialFirmware) -> None:
        self.attached = attached

    def new_driver(self) -> Driver:
        """Return the same driver for all tests: another one would have to wait for its lease."""
        return self.attached


@pytest.fixture(scope="module", params=["e-puck", "thymio2"])
def placed(request: pytest.FixtureRequest) -> Iterator[PlacedRobot]:
    """A robot in the simulator of its makers, far from all walls."""
    robot = PlacedRobot(request.param, 200.0, 200.0, free_port())
    with playground([robot]):
        yield robot


@needs_playground
class TestAseba(DriverContract):
    """The robots of Aseba's simulator."""

    reopen_after_s = 0.1

    @pytest.fixture(autouse=True)
    def _placed(self, placed: PlacedRobot) -> None:
        self.placed = placed
        self.period_s = 0.2 if placed.kind == "thymio2" else 0.1  # twice its own, if it is slow

    def new_driver(self) -> Driver:
        """Return a driver of the simulated robot, once the simulator has noticed that the last one is gone."""
        time.sleep(0.1)
        return AsebaRobot(self.placed.address, self.placed.uid)

    def highest_action(self) -> FloatArray:
        """These robots have no jaw, no loudness, and no infrared."""
        highest = super().highest_action()
        highest[[contract.JAW, contract.SPEAKER, contract.BEACON]] = 0.0
        return highest


@pytest.fixture(scope="module")
def uno_link(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The device of an emulated Uno."""
    with UnoRobot(tmp_path_factory.mktemp("uno")) as robot:
        yield robot.host_link


@needs_firmata
class TestFirmata(DriverContract):
    """Unmodified StandardFirmata: what the contract asks of a robot, this process does."""

    @pytest.fixture(autouse=True)
    def _emulated(self, uno_link: Path) -> None:
        self.uno_link = uno_link

    def new_driver(self) -> Driver:
        """Return a driver of the emulated Uno."""
        return FirmataRobot(str(self.uno_link))

    def highest_action(self) -> FloatArray:
        """It has wheels alone."""
        highest = super().highest_action()
        highest[contract.JAW : contract.BEACON + 1] = 0.0
        return highest
