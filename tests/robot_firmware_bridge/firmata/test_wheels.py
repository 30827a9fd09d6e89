"""Speeds become pins and pins become speeds again, on bridges with one pin of direction and with two."""

import pytest
from crcolony_bridge.firmata import wheels
from crcolony_bridge.firmata.board import Board, Motor, load_board, shipped_boards
from crcolony_bridge.firmata.protocol import PinMode, PinState
from hypothesis import given
from hypothesis import strategies as st

BOARDS = [
    *map(load_board, shipped_boards()),
    Board(
        model="turned round, on another controller",
        left=Motor(pwm=44, back=30),
        right=Motor(pwm=45, ahead=31, back=32),
        track_m=0.1,
        radius_m=0.1,
        max_speed_m_s=0.5,
    ),
]
SPEED = st.floats(-0.3, 0.3)


def states_after(board: Board, data: bytes) -> dict[int, PinState]:
    """Return what StandardFirmata has the pins of the motors set to after these messages."""
    modes = dict.fromkeys(board.pins, int(PinMode.OUTPUT))
    levels = dict.fromkeys(board.pins, 0)
    at = 0
    while at < len(data):
        command, first, second = data[at : at + 3]
        at += 3
        if command == 0xF4:
            modes[first] = second
        elif command == 0xF0:
            levels[second] = data[at] | data[at + 1] << 7
            at += 3
        elif command & 0xF0 == 0xE0:
            levels[command & 0x0F] = first | second << 7
        else:
            port, high = 8 * (command & 0x0F), first | second << 7
            for pin in set(board.pins) & set(range(port, port + 8)):
                if modes[pin] == PinMode.OUTPUT:
                    levels[pin] = high >> pin - port & 1
    return {pin: PinState(pin, modes[pin], levels[pin]) for pin in board.pins}


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.model)
@given(left_m_s=SPEED, right_m_s=SPEED)
def test_what_is_read_back_is_what_was_commanded(
    board: Board, left_m_s: float, right_m_s: float
) -> None:
    """As finely as PWM has steps."""
    states = states_after(board, wheels.set_modes(board) + wheels.turn(board, left_m_s, right_m_s))
    assert wheels.are_modes_kept(board, states)
    step_m_s = board.max_speed_m_s / 255 / (1.0 - board.least_duty)
    expected = pytest.approx((left_m_s, right_m_s), abs=step_m_s)
    assert wheels.speeds(board, states) == expected


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.model)
def test_at_rest_there_is_no_pwm(board: Board) -> None:
    """Whatever was before."""
    turning = wheels.set_modes(board) + wheels.turn(board, -0.2, 0.2)
    assert not wheels.are_still(board, states_after(board, turning))
    states = states_after(board, turning + wheels.stand_still(board))
    assert wheels.are_still(board, states)
    assert wheels.speeds(board, states) == (0.0, 0.0)


def test_a_wheel_is_not_faster_than_it_can() -> None:
    """Full PWM is all there is."""
    board = BOARDS[0]
    states = states_after(board, wheels.set_modes(board) + wheels.turn(board, 9.0, -9.0))
    assert wheels.speeds(board, states) == pytest.approx((0.3, -0.3))


def test_a_brake_has_both_pins_high_without_pwm() -> None:
    """Where the board asks for it."""
    board = Board(
        model="brake",
        left=Motor(pwm=5, ahead=7, back=8),
        right=Motor(pwm=6, ahead=9, back=10),
        track_m=0.1,
        radius_m=0.1,
        max_speed_m_s=0.2,
        at_rest="brake",
    )
    states = states_after(board, wheels.set_modes(board) + wheels.stand_still(board))
    assert [states[pin].level for pin in (5, 7, 8, 6, 9, 10)] == [0, 1, 1, 0, 1, 1]
    assert wheels.speeds(board, states) == (0.0, 0.0)


def test_pins_of_a_board_that_was_reset_are_known() -> None:
    """They are outputs, and low."""
    assert not wheels.are_modes_kept(BOARDS[0], states_after(BOARDS[0], b""))
