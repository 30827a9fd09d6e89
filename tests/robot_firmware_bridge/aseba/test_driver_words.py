"""Words go from one Thymio to another through the uploaded bytecode, run by a small virtual machine of ours.

Never run on a robot: no simulator that runs here has working infrared.
"""

import time
from collections.abc import Iterator

import pytest
from crcolony_bridge.aseba.driver import AsebaRobot

from crcolony.body import contract
from tests.robot_firmware_bridge.aseba.driven import drive
from tests.robot_firmware_bridge.aseba.word_thymio import WITHOUT_EFFECT, WORDS, WordThymio

THYMIO_REPEATS = 0.1
SECONDS = 0.6


@pytest.fixture
def thymios() -> list[WordThymio]:
    """Two robots that face each other."""
    one, other = WordThymio(), WordThymio()
    one.others, other.others = [other], [one]
    return [one, other]


@pytest.fixture
def drivers(thymios: list[WordThymio]) -> Iterator[list[AsebaRobot]]:
    """Their drivers, open."""
    made = [new_driver(robot) for robot in thymios]
    for driver in made:
        driver.open()
        driver.activate()
    yield made
    for driver in made:
        driver.close()


def new_driver(robot: WordThymio) -> AsebaRobot:
    return AsebaRobot("thymio", connect=lambda address, baud: robot)


def switch(driver: AsebaRobot, *, is_on: bool) -> None:
    """Switch a robot's beacon."""
    action = drive(0.5, 0.0, 0.0)
    action[contract.BEACON] = float(is_on)
    assert driver.write(action)[contract.BEACON] == is_on


def listen(drivers: list[AsebaRobot]) -> list[bytes]:
    """Return what the second robot receives in a while."""
    heard: list[bytes] = []
    end_s = time.monotonic() + SECONDS
    while time.monotonic() < end_s:
        for driver in drivers:
            reading = driver.read(0.01)
            if driver is drivers[1] and reading is not None:
                heard += reading.ir_messages
    return heard


def test_a_word_is_repeated_while_the_beacon_is_on(drivers: list[AsebaRobot]) -> None:
    """Until the next one; before and after there is nothing."""
    assert all(driver.description.ir == "tokens" for driver in drivers)
    assert drivers[0].send_ir(b"\x07\xff")
    assert listen(drivers) == []
    switch(drivers[0], is_on=True)
    heard = listen(drivers)
    assert set(heard) == {b"\x07\xff"}
    assert 3 <= len(heard) <= SECONDS / THYMIO_REPEATS + 1
    assert drivers[0].send_ir(b"\x00\x01")
    assert set(listen(drivers)[1:]) == {b"\x00\x01"}
    switch(drivers[0], is_on=False)
    assert listen(drivers)[1:] == []


def test_a_robot_that_stands_still_is_silent(
    thymios: list[WordThymio], drivers: list[AsebaRobot]
) -> None:
    """Also after it has been connected to again, until its beacon is on."""
    switch(drivers[0], is_on=True)
    drivers[0].send_ir(b"\x00\x05")
    assert thymios[0].variable(WORDS.sent) == 5
    drivers[0].deactivate()
    assert thymios[0].variable(WORDS.sent) < 0
    drivers[0].close()
    drivers[0].open()
    drivers[0].activate()
    assert thymios[0].variable(WORDS.sent) < 0
    switch(drivers[0], is_on=True)
    assert thymios[0].variable(WORDS.sent) == 5


@pytest.mark.parametrize("message", [b"", b"\x01", b"\x08\x00", b"\x00\x00\x01"])
def test_what_is_no_word_is_not_sent(drivers: list[AsebaRobot], message: bytes) -> None:
    """A word has eleven bits."""
    assert not drivers[0].send_ir(message)


def test_numbers_that_are_no_words_are_not_received(
    thymios: list[WordThymio], drivers: list[AsebaRobot]
) -> None:
    """By the sources of the firmware it may receive up to 2,056."""
    for number in (-1, 2048, 2056, 9):
        thymios[1].hear(number)
    assert listen(drivers) == [b"\x00\x09"]


def test_a_robot_whose_infrared_is_only_declared_has_none() -> None:
    """As in Aseba's own simulator."""
    robot = WordThymio(WITHOUT_EFFECT)
    driver = new_driver(robot)
    driver.open()
    assert driver.description.ir == "none"
    assert not driver.send_ir(b"\x00\x01")
    driver.activate()
    action = drive(0.5, 0.0, 0.0)
    action[contract.BEACON] = 1.0
    assert driver.write(action)[contract.BEACON] == 0.0
    assert robot.variable(WORDS.sent) == 0
    driver.close()
