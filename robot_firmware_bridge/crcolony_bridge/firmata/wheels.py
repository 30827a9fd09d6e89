"""From speeds of wheels to the pins of their motors, and from what the pins are set to back to speeds."""

from collections.abc import Iterable, Mapping

from crcolony_bridge.firmata.board import Board, Motor
from crcolony_bridge.firmata.protocol import PinMode, PinState, set_pin_mode, write_port, write_pwm

FULL = 255
_PORT_PINS = 8


def set_modes(board: Board) -> bytes:
    """Use the pins of the motors for PWM and as outputs."""
    motors = (board.left, board.right)
    pwm = [set_pin_mode(motor.pwm, PinMode.PWM) for motor in motors]
    directions = [set_pin_mode(p, PinMode.OUTPUT) for motor in motors for p in motor.directions]
    return b"".join(pwm + directions)


def turn(board: Board, left_m_s: float, right_m_s: float) -> bytes:
    """Let the wheels turn so, at most at full speed; a direction is set before its PWM."""
    duties = _duty(board, left_m_s), _duty(board, right_m_s)
    motors = ((board.left, duties[0]), (board.right, duties[1]))
    high = [pin for motor, duty in motors for pin in _high(board, motor, duty)]
    pwm = [write_pwm(motor.pwm, abs(duty)) for motor, duty in motors]
    return _ports(board, high) + b"".join(pwm)


def stand_still(board: Board) -> bytes:
    """Take the PWM off both motors first, and set their directions as they are at rest."""
    return write_pwm(board.left.pwm, 0) + write_pwm(board.right.pwm, 0) + turn(board, 0.0, 0.0)


def speeds(board: Board, states: Mapping[int, PinState]) -> tuple[float, float]:
    """Return how fast the wheels turn (m/s) by what their pins are set to, of which all have to be there."""
    left, right = (_speed(board, motor, states) for motor in (board.left, board.right))
    return left, right


def are_modes_kept(board: Board, states: Mapping[int, PinState]) -> bool:
    """Return whether the pins are used as `set_modes` has it; after a reset they are not."""
    motors = (board.left, board.right)
    return all(states[motor.pwm].mode == PinMode.PWM for motor in motors) and all(
        states[pin].mode == PinMode.OUTPUT for motor in motors for pin in motor.directions
    )


def are_still(board: Board, states: Mapping[int, PinState]) -> bool:
    """Return whether neither motor has any PWM."""
    return all(states[motor.pwm].level == 0 for motor in (board.left, board.right))


def _duty(board: Board, speed_m_s: float) -> int:
    """Return the PWM, negative to drive back."""
    share = min(abs(speed_m_s) / board.max_speed_m_s, 1.0)
    if share * FULL < 0.5:
        return 0
    duty = round(FULL * (board.least_duty + (1.0 - board.least_duty) * share))
    return duty if speed_m_s > 0.0 else -duty


def _speed(board: Board, motor: Motor, states: Mapping[int, PinState]) -> float:
    duty = min(states[motor.pwm].level, FULL) / FULL
    share = max(duty - board.least_duty, 0.0) / (1.0 - board.least_duty)
    ahead, back = (
        states[pin].level > 0 if pin is not None else None for pin in (motor.ahead, motor.back)
    )
    if ahead == back:  # neither, or both: the bridge drives nothing
        return 0.0
    is_ahead = ahead if ahead is not None else not back
    return board.max_speed_m_s * (share if is_ahead else -share)


def _high(board: Board, motor: Motor, duty: int) -> tuple[int, ...]:
    """Return the pins of its direction that are high."""
    if duty == 0:
        return motor.directions if board.at_rest == "brake" else ()
    pin = motor.ahead if duty > 0 else motor.back
    return (pin,) if pin is not None else ()


def _ports(board: Board, high: Iterable[int]) -> bytes:
    """Set the pins of directions; other outputs beside them are low, as after a reset."""
    levels = {pin // _PORT_PINS: 0 for m in (board.left, board.right) for pin in m.directions}
    for pin in high:
        levels[pin // _PORT_PINS] |= 1 << pin % _PORT_PINS
    return b"".join(write_port(port, level) for port, level in sorted(levels.items()))
