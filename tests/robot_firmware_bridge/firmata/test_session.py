"""Who is at the other end, and whether it is wired as the board says, is found out before anything moves."""

import os
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest
from crcolony_bridge.errors import DeviceError, DeviceLostError
from crcolony_bridge.firmata import session as session_module
from crcolony_bridge.firmata.board import Board, Motor, Proximity, Sensor, load_board
from crcolony_bridge.firmata.session import FirmataSession
from crcolony_bridge.link import open_link
from crcolony_bridge.reference_firmware.driver import SerialFirmware

from tests.robot_firmware_bridge.emulated_robot import AvrRobot
from tests.robot_firmware_bridge.firmata.loose_link import LooseLink
from tests.robot_firmware_bridge.firmata.uno_robot import UnoRobot, needs_firmata
from tests.robot_firmware_bridge.firmware import needs_avr

BAUD = 57_600
SHIELD = load_board("uno_motor_shield")


@contextmanager
def connected(path: str | Path, board: Board = SHIELD) -> Iterator[FirmataSession]:
    """A session that has not begun."""
    made = FirmataSession(open_link(str(path), BAUD), str(path), board)
    try:
        yield made
    finally:
        made.close()


@contextmanager
def device(answer: bytes, *, is_repeated: bool = False) -> Iterator[str]:
    """A device that answers whatever it is asked with the same bytes, at once or again and again."""
    leader, follower = os.openpty()
    ended = threading.Event()

    def run() -> None:
        while not ended.is_set():
            with suppress(OSError):
                if not is_repeated:
                    os.read(leader, 4096)
                if answer:
                    os.write(leader, answer)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield os.ttyname(follower)
    finally:
        ended.set()
        os.write(follower, b"\n")  # so that it does not wait for anything
        thread.join()
        os.close(leader)
        os.close(follower)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (b"", "no Firmata answers, nothing; is StandardFirmata on it, and its baud rate 57600?"),
        (bytes(range(256)), r"no Firmata answers, \d+ bytes that are no Firmata"),
        (b"\xf0\x79\x03\x00\xf7\xf9\x03\x00", "it speaks Firmata 3.0, not 2"),
    ],
)
def test_what_is_no_firmata_is_said(
    monkeypatch: pytest.MonkeyPatch, answer: bytes, said: str
) -> None:
    """In one line: silence, noise, and another version."""
    monkeypatch.setattr(session_module, "STARTS_WITHIN_S", 1.0)
    with device(answer) as path, connected(path) as session:
        with pytest.raises(DeviceError, match=said) as error:
            session.start()
        assert "\n" not in str(error.value)


def test_a_firmware_that_says_nothing_more_is_lost() -> None:
    """After its name."""
    said = pytest.raises(DeviceLostError, match="does not answer any more")
    with device(b"\xf0\x79\x02\x04\xf7\xf9\x02\x04") as path, connected(path) as session, said:
        session.start()


@needs_avr
def test_the_reference_firmware_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """And it is not upset by what it was asked."""
    monkeypatch.setattr(session_module, "STARTS_WITHIN_S", 1.0)
    with AvrRobot(tmp_path) as robot:
        said = pytest.raises(DeviceError, match="no Firmata answers")
        with connected(robot.host_link) as session, said:
            session.start()
        driver = SerialFirmware(str(robot.host_link))
        driver.open()
        driver.close()


@needs_firmata
def test_firmata_is_none_for_the_reference_firmware_either(uno: UnoRobot) -> None:
    """The other way round."""
    with pytest.raises((DeviceError, DeviceLostError)) as error:
        SerialFirmware(str(uno.host_link)).open()
    assert "\n" not in str(error.value)


@needs_firmata
@pytest.mark.parametrize(
    ("left", "channel", "said"),
    [
        (Motor(pwm=4, ahead=7), 0, "left.pwm: pin 4 cannot be PWM; these can: 3, 5, 6, 9, 10, 11"),
        (Motor(pwm=5, ahead=20), 0, "left.ahead: pin 20 cannot be OUTPUT"),
        (Motor(pwm=5, back=77), 0, "left.back: pin 77 cannot be OUTPUT"),
        (Motor(pwm=5, ahead=7), 6, "analog: it has no channel 6"),
    ],
)
def test_a_board_that_the_controller_cannot_have_is_said(
    uno: UnoRobot, left: Motor, channel: int, said: str
) -> None:
    """With the key, and the pins that would do."""
    sensors = (Sensor(analog=channel, column=3, bearing_rad=0.0),)
    board = Board(
        model="wrong",
        left=left,
        right=Motor(pwm=6, ahead=8),
        track_m=0.1,
        radius_m=0.1,
        max_speed_m_s=0.2,
        proximity=Proximity(sensors=sensors, volts=(0.0, 5.0), metres=(1.0, 0.0)),
    )
    with connected(uno.host_link, board) as session, pytest.raises(DeviceError, match=said):
        session.start()


@needs_firmata
def test_what_pins_are_set_to_is_read_back(uno: UnoRobot) -> None:
    """And how old that is: a stop is asked about afterwards."""
    with connected(uno.host_link) as session:
        session.start()
        session.turn(0.3, -0.15)
        found = session.read(1.0)
        while found is None or found.are_still:
            found = session.read(1.0)
        assert found.wheels_m_s == pytest.approx((0.3, -0.15), abs=0.002)
        assert session.values.keys() == set(SHIELD.channels)
        assert session.halt()
        found = session.read(1.0)
        assert found is not None
        assert (found.wheels_m_s, found.are_still, found.is_after_stop) == ((0.0, 0.0), True, True)


@needs_firmata
def test_a_robot_that_was_reset_is_lost(uno: UnoRobot) -> None:
    """It says its name by itself then, and its pins are what they are after a reset."""
    link = LooseLink(open_link(str(uno.host_link), BAUD))
    with closing(FirmataSession(link, "uno", SHIELD)) as session:
        session.start()
        link.noise = b"\xf9\x02\x04\xf0\x79\x02\x04S\0\xf7"
        with pytest.raises(DeviceLostError, match="uno: the robot was reset"):
            session.read(1.0)
        link.write(b"\xff")
        with pytest.raises(DeviceLostError, match="uno: its pins were set to something else"):
            list(iter(lambda: session.read(1.0), None))


@needs_firmata
def test_answers_that_are_missing_are_waited_for(uno: UnoRobot) -> None:
    """No reading is made of two halves: there are no more of them than questions that went out whole."""
    link = LooseLink(open_link(str(uno.host_link), BAUD))
    with closing(FirmataSession(link, "uno", SHIELD)) as session:
        session.start()
        questions = []

        def lose_every_other_question(data: bytes) -> bytes:
            questions.append(data)
            return data[4:] if len(questions) % 2 else data

        link.lose = lose_every_other_question
        found = 0
        while len(questions) < 11:
            found += session.read(0.1) is not None
        assert 1 <= found <= len(questions) // 2 + 1  # one was under way from the start
