"""Infrared of the reference firmware that is built to carry words alone, in an emulator."""

import time
from contextlib import ExitStack
from pathlib import Path

from crcolony_bridge.reference_firmware.driver import SerialFirmware

from crcolony.body import contract
from tests.robot_firmware_bridge.driving import drive
from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmware import WORDS_ALONE, needs_avr
from tests.robot_firmware_bridge.ir_air import ir_air

pytestmark = needs_avr


def test_a_word_is_repeated_until_the_next_one(tmp_path: Path) -> None:
    """About ten times a second, while the beacon is on; nothing longer is sent."""
    with ExitStack() as opened:
        robots = [
            opened.enter_context(AvrRobot(tmp_path, name, 1, WORDS_ALONE))
            for name in ("left", "right")
        ]
        drivers = [SerialFirmware(str(robot.host_link)) for robot in robots]
        opened.enter_context(ir_air([robot.ir_link for robot in robots]))
        for driver in drivers:
            driver.open()
            opened.callback(driver.close)
            assert driver.description.ir == "tokens"
        assert not drivers[0].send_ir(bytes(3))
        heard = {}
        for is_on, word in ((True, b"\x01\x02"), (True, b"\x03\x04"), (False, b"\x05\x06")):
            assert drivers[0].send_ir(word)
            heard[word] = listen(drivers[0], drivers[1], is_on)
    assert set(heard[b"\x01\x02"]) == {b"\x01\x02"}
    assert 5 <= heard[b"\x01\x02"].count(b"\x01\x02") <= 12
    assert set(heard[b"\x03\x04"][1:]) == {b"\x03\x04"}
    assert b"\x05\x06" not in heard[b"\x05\x06"]


def listen(speaker: SerialFirmware, listener: SerialFirmware, is_on: bool) -> list[bytes]:
    """Return what one robot receives of another's beacon within a second."""
    action = drive(0.5, 0.0, 0.0)
    action[contract.BEACON] = float(is_on)
    heard: list[bytes] = []
    end_s = time.monotonic() + 1.0
    while time.monotonic() < end_s:
        speaker.write(action)
        speaker.read(0.0)
        reading = listener.read(0.05)
        heard += reading.ir_messages if reading is not None else ()
    return heard
