"""What analog channels measure becomes an observation; what is not measured stays at the end of its range."""

import pytest
from crcolony_bridge.driver import Reading
from crcolony_bridge.firmata.board import load_board
from crcolony_bridge.firmata.senses import reading_of

from crcolony.body import contract


def read(board_name: str = "uno_motor_shield", **volts: float) -> Reading:
    """Return a reading of the channels a2, a3 and so on."""
    board = load_board(board_name)
    values = {channel: round(volts.get(f"a{channel}", 0.0) / 5.0 * 1023) for channel in range(6)}
    return reading_of(
        board, board.describe("uid", 0.05), values, (0.1, -0.1), 1.0, is_stopped=False
    )


def test_a_voltage_means_a_distance() -> None:
    """By the points of the curve, and between them; beyond them the distance of the last one."""
    for volts, distance_m in ((2.3, 0.1), (0.93, 0.3), (0.835, 0.35), (0.0, 0.8), (5.0, 0.1)):
        row = read(a3=volts).row
        assert row[contract.PROXIMITY + 3] == pytest.approx(distance_m, abs=0.005)
        assert row[contract.IR_RANGE] == row[contract.PROXIMITY + 3]
    row = read(a2=2.3).row
    proximity = row[contract.PROXIMITY : contract.PROXIMITY + contract.PROXIMITY_SENSORS]
    assert proximity.tolist() == pytest.approx([0.8, 0.1, 0.8, 0.8, 0.8, 0.8, 0.8], abs=0.002)


def test_a_battery_is_measured_through_its_divider() -> None:
    """And is low below a voltage."""
    half = read(a5=3.7)
    assert half.battery_v == pytest.approx(7.4, abs=0.01)
    assert half.row[contract.BATTERY] == pytest.approx(0.5, abs=0.005)
    assert not half.is_battery_low
    assert read(a5=3.3).is_battery_low


def test_a_robot_that_measures_nothing_observes_nothing() -> None:
    """But its wheels, and a battery that is full."""
    found = read("uno_two_pins")
    assert found.row[[contract.WHEELS, contract.WHEELS + 1]].tolist() == [0.1, -0.1]
    assert found.row[contract.BATTERY] == 1.0
    assert found.row[contract.IR_RANGE] == 0.3
    assert (found.battery_v, found.is_battery_low) == (0.0, False)
