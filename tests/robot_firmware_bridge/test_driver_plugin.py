"""The driver of docs/write_a_driver.md is installed as a package of its own, is found, and passes the contract test."""

import importlib
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from crcolony_bridge.driver import Driver
from crcolony_bridge.driver_contract_test import DriverContract

from tests.robot_firmware_bridge.desk_robot_emulator import DeskRobotEmulator, desk_robot
from tests.support.paths import PYTHONPATH, ROOT
from tests.support.process_colony import crcolony

PAGE = (ROOT / "docs/write_a_driver.md").read_text("utf-8")
DRIVER, _ = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
(ENTRY_POINT,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


def write_wheel(folder: Path) -> Path:
    """Write the page's driver as a wheel, as its author would publish it."""
    _, _, entry = ENTRY_POINT.partition("\n")
    path = folder / "desk_robot-1.0-py3-none-any.whl"
    info = "desk_robot-1.0.dist-info"
    files = {
        "desk_robot.py": DRIVER,
        f"{info}/METADATA": "Metadata-Version: 2.1\nName: desk-robot\nVersion: 1.0\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": f"[crcolony_bridge.drivers]\n{entry.replace(chr(34), '')}",
    }
    record = "".join(f"{name},,\n" for name in (*files, f"{info}/RECORD"))
    with zipfile.ZipFile(path, "w") as wheel:
        for name, text in {**files, f"{info}/RECORD": record}.items():
            wheel.writestr(name, text)
    return path


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder into which pip has installed the package."""
    folder = tmp_path_factory.mktemp("elsewhere")
    wheel = write_wheel(tmp_path_factory.mktemp("wheel"))
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    subprocess.run([*pip, "--no-deps", "--no-index", "--target", folder, wheel], check=True)
    sys.path.insert(0, str(folder))
    yield folder
    sys.path.remove(str(folder))


def bridge(folder: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    """Run `crcolony bridge` where the package is installed."""
    return subprocess.run(
        crcolony("bridge", *options),
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), PYTHONPATH])},
        timeout=60,
    )


def test_an_installed_driver_is_listed(installed: Path) -> None:
    """By its name, beside those of crcolony."""
    listed = bridge(installed, "list").stdout
    assert re.search(r"driver +desk +desk_robot:DeskRobot", listed)
    assert re.search(r"driver +firmware +crcolony_bridge", listed)


def test_a_driver_whose_package_is_broken_is_said_in_one_line(installed: Path) -> None:
    """Whatever happens when it is imported."""
    module = installed / "desk_robot.py"
    module.write_text("import a_package_that_is_missing\n")
    try:
        refused = bridge(installed, "--robot", "desk@/dev/ttyACM0")
    finally:
        module.write_text(DRIVER)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "a_package_that_is_missing" in refused.stderr


def test_the_driver_of_the_page_is_short() -> None:
    """Fifty lines of code."""
    lines = [line for line in DRIVER.splitlines() if line.strip() and not line.startswith('"""')]
    assert len(lines) <= 50


@pytest.fixture(scope="module")
def desk() -> Iterator[DeskRobotEmulator]:
    """A robot for all tests."""
    with desk_robot() as robot:
        yield robot


class TestDeskRobot(DriverContract):
    """The page's test."""

    @pytest.fixture(autouse=True)
    def _desk(self, installed: Path, desk: DeskRobotEmulator) -> None:
        self.address = desk.address

    def new_driver(self) -> Driver:
        """Return a driver of the emulated robot."""
        driver: Driver = importlib.import_module("desk_robot").DeskRobot(self.address)
        return driver
