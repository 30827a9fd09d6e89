"""Aseba robots are driven on a simulator that others wrote: what they do, and how they stop."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing

import numpy as np
import pytest
from crcolony_bridge.aseba.driver import AsebaRobot
from crcolony_bridge.driver import DriverState

from crcolony.body import contract
from tests.robot_firmware_bridge.aseba.driven import (
    NewRobot,
    ahead_m,
    drive,
    read_for,
    turns,
)
from tests.robot_firmware_bridge.aseba.onlooker import Onlooker
from tests.robot_firmware_bridge.driving import read_until
from tests.robot_firmware_bridge.playground import (
    PlacedRobot,
    Playground,
    free_port,
    needs_playground,
    playground,
)
from tests.support.paths import PYTHONPATH, ROOT

pytestmark = needs_playground

KINDS = ("e-puck", "thymio2")
TICK_S = 0.031
"""A step of the simulator; the program of a Thymio ticks faster, but the wheels turn by steps."""


@pytest.mark.parametrize("placed", KINDS, indirect=True)
def test_a_robot_says_what_it_is_and_measures(placed: PlacedRobot, driver: AsebaRobot) -> None:
    """Its uid, where its watchdog is, how often it measures, and the wall before it."""
    description = driver.description
    assert description.uid == placed.uid
    assert description.watchdog == "uploaded program"
    assert description.watchdog_s <= 0.5 + 2 * 0.04
    assert description.ir == "none"
    assert description.period_s == pytest.approx(
        {"e-puck": 0.03, "thymio2": 0.1}[placed.kind], rel=0.25
    )
    reading = read_until(driver, lambda reading: True)
    assert ahead_m(reading) == pytest.approx(0.05, abs=0.008)
    assert reading.row[contract.PROXIMITY] == description.proximity_range_m
    assert reading.row[contract.ENCOUNTER_ROBOT] == -1.0


@pytest.mark.parametrize("placed", KINDS, indirect=True)
def test_wheels_turn_only_while_the_driver_is_active(driver: AsebaRobot) -> None:
    """They turn as fast as they are told, and the robot comes as near to the wall as that makes; then it stays."""
    driver.deactivate()
    assert (driver.write(drive())[:2] == 0.0).all()
    assert not any(turns(reading) for reading in read_for(driver, 0.25))
    driver.activate()
    start = read_until(driver, lambda reading: True)
    assert driver.write(drive(0.5, 0.06, 0.06))[:2].tolist() == [0.06, 0.06]
    moving = read_until(driver, turns)
    assert moving.row[contract.WHEELS : contract.WHEELS + 2] == pytest.approx(0.06, rel=0.15)
    stands = read_until(driver, lambda reading: not turns(reading))
    assert ahead_m(start) - ahead_m(stands) == pytest.approx(0.06 * 0.5, abs=0.008)
    driver.write(drive())
    driver.deactivate()
    read_until(driver, lambda reading: not turns(reading), within_s=0.2)


def test_a_robot_that_is_too_fast_keeps_its_curve(driver: AsebaRobot) -> None:
    """Both wheels are slowed by the same factor, and the robot does turn that way."""
    applied = driver.write(drive(0.25, 1.0, -0.5))
    assert applied[:2].tolist() == pytest.approx([0.128, -0.064])
    reading = read_until(driver, turns)
    assert reading.row[contract.WHEELS : contract.WHEELS + 2] == pytest.approx(
        [0.128, -0.064], abs=0.001
    )
    assert ahead_m(read_until(driver, lambda reading: not turns(reading))) > 0.05


@pytest.mark.parametrize("placed", KINDS, indirect=True)
def test_without_a_fresh_command_the_wheels_stop(driver: AsebaRobot) -> None:
    """By the robot's own count: the time to live is not cut short, and is over within two steps of the simulator."""
    period_s = driver.description.period_s
    for ttl_s in (0.1, 0.4):
        driver.write(drive(ttl_s))
        sent_s = time.monotonic()
        read_until(driver, turns)
        read_until(driver, lambda reading: not turns(reading))
        lasted_s = time.monotonic() - sent_s
        assert 0.9 * ttl_s - period_s <= lasted_s <= 1.1 * ttl_s + 2 * TICK_S + period_s
    driver.write(drive(0.0))
    assert not any(turns(reading) for reading in read_for(driver, 0.2))


@pytest.mark.parametrize("placed", ["thymio2"], indirect=True)
def test_when_this_machine_is_frozen_or_dies_the_wheels_stop(
    world: Playground, placed: PlacedRobot
) -> None:
    """Seen by a second client; the process that has driven is frozen, then killed."""
    ttl_s = 0.4
    process = subprocess.Popen(
        [sys.executable, "-m", f"{__package__}.driving_process", placed.address, str(ttl_s)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": PYTHONPATH},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    try:
        for _ in range(5):
            last_s = float(process.stdout.readline())
        process.send_signal(signal.SIGSTOP)
        frozen_s = time.monotonic()
        motor = "motor.left.target"
        with closing(Onlooker(placed.address)) as onlooker:
            assert onlooker.value(motor) > 0
            while onlooker.value(motor) != 0:
                pass
            stopped_s = time.monotonic()
            onlooker.set(motor, 300)  # and nobody moves it but through the program
            wait_s = stopped_s + 4 * TICK_S
            while onlooker.value(motor) != 0:
                assert time.monotonic() < wait_s
        # It may have commanded once more, after the command that it has told of last.
        assert stopped_s - frozen_s <= ttl_s + 2 * TICK_S + 0.1
        assert stopped_s - last_s >= 0.8 * ttl_s
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def test_an_emergency_stop_is_confirmed_and_latched(driver: AsebaRobot) -> None:
    """From another thread, while the first one reads, or by the only thread."""
    driver.write(drive(0.5))
    read_until(driver, turns)
    confirmed: list[bool] = []
    stopping = threading.Thread(target=lambda: confirmed.append(driver.stop()))
    stopping.start()
    while stopping.is_alive():
        driver.read(0.02)
    assert confirmed == [True]
    assert not turns(read_until(driver, lambda reading: reading.is_stopped))
    driver.activate()
    assert driver.state is DriverState.INACTIVE
    assert driver.clear()
    read_until(driver, lambda reading: not reading.is_stopped)
    driver.activate()
    driver.write(drive(0.5))
    assert driver.stop()  # with nobody else who reads
    assert not turns(read_until(driver, lambda reading: True))


def test_a_lamp_has_the_colour_that_it_is_told(placed: PlacedRobot, driver: AsebaRobot) -> None:
    """Also while the robot is INACTIVE."""
    driver.deactivate()
    action = np.zeros(contract.ACTION_WIDTH)
    action[contract.LED : contract.LED + 3] = 1.0, 0.0, 0.5
    driver.write(action)
    read_for(driver, 0.1)
    with closing(Onlooker(placed.address)) as onlooker:
        colours = [onlooker.value(f"color.{name}") for name in ("red", "green", "blue")]
    assert colours == [100, 0, 50]


def test_an_e_puck_sees_feeders_and_lamps_and_is_charged(new_robot: NewRobot) -> None:
    """Green is a pack, red is a face, left is positive; beside a feeder the battery rises."""
    robot = PlacedRobot("e-puck", 100.0, 100.0, free_port())
    things = '<cylinder x="130" y="90" r="3.7" h="6" color="red"/><feeder x="109" y="103"/>'
    with playground([robot], things):
        driver = new_robot(robot.address, robot.uid)
        driver.open()
        first = read_until(driver, lambda reading: True)
        face, pack = first.row[contract.FACE :], first.row[contract.PACK :]
        assert face[0] == pack[0] == 1.0
        assert face[contract.BEARING] == pytest.approx(np.arctan2(-10, 30), abs=0.05)
        assert face[contract.DISTANCE] == pytest.approx(np.hypot(0.1, 0.3), rel=0.25)
        assert pack[contract.BEARING] > 0.0
        assert pack[contract.DISTANCE] == pytest.approx(np.hypot(0.03, 0.09), rel=0.4)
        assert pack[contract.COLOUR + 1] == pytest.approx(0.5, abs=0.02)
        battery = first.row[contract.BATTERY]
        read_until(driver, lambda reading: reading.row[contract.BATTERY] > battery)
