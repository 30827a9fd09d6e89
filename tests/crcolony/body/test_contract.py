"""The tables of the body contract are consistent with the columns that compiled code uses."""

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract import ACTION, OBSERVATION, Quantity, clip_action, columns, limits

UNITS = ("_m", "_rad", "_m_s", "_rad_s", "_m_s2", "_s")
"""A quantity without a unit is a share, a flag, a colour, or a count."""
PLAIN = {"visible", "red", "green", "blue", "jaw", "holds", "charge", "battery", "speaker"}
PLAIN |= {"left", "right", "beacon", "encounter", "robot", "nonce"}


def test_names_end_in_their_unit_and_ranges_are_not_empty() -> None:
    """For every quantity of both tables; names are unique in a table."""
    for table in (OBSERVATION, ACTION):
        assert len(columns(table)) == len(table)
        for quantity in table:
            assert isinstance(quantity, Quantity)
            assert quantity.low < quantity.high
            assert quantity.meaning
            assert quantity.name.endswith(UNITS) or quantity.name.split("_")[-1] in PLAIN


def test_the_columns_are_those_of_the_table() -> None:
    """Compiled code reads and writes them by these constants."""
    names = [quantity.name for quantity in OBSERVATION]
    assert names[contract.PACK + contract.DISTANCE] == "pack_distance_m"
    assert names[contract.FACE + contract.BEARING] == "face_bearing_rad"
    assert names[contract.TAIL + contract.COLOUR] == "tail_red"
    assert names[contract.PROXIMITY + 6] == "proximity_6_m"
    assert names[contract.ACCELERATION + 1] == "acceleration_left_m_s2"
    assert names[contract.WHEELS + 1] == "wheel_right_m_s"
    assert names[contract.MICROPHONES + 1] == "microphone_right"
    acted = [quantity.name for quantity in ACTION]
    assert acted[contract.LED + 2] == "led_blue"
    assert (len(names), len(acted)) == (contract.OBSERVATION_WIDTH, contract.ACTION_WIDTH)


def test_an_action_is_clipped_to_its_limits() -> None:
    """Each column on its own; an action within the limits is unchanged."""
    low, high = limits(ACTION)
    middle = 0.5 * (low + high)
    np.testing.assert_array_equal(clip_action(middle), middle)
    np.testing.assert_array_equal(clip_action(high + 1.0), high)
    np.testing.assert_array_equal(clip_action(low - 1.0), low)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_what_is_not_an_action_is_refused(number: float) -> None:
    """Another shape, or a number that is not finite, raises ValueError."""
    action = np.zeros(contract.ACTION_WIDTH)
    with pytest.raises(ValueError, match="an action has shape"):
        clip_action(action[1:])
    action[contract.SPEAKER] = number
    with pytest.raises(ValueError, match="only finite numbers"):
        clip_action(action)


def test_an_observation_beyond_its_limits_is_named() -> None:
    """A column of the table at its limits is sensed; beyond them, or not a number, it is not."""
    low, high = contract.limits(contract.OBSERVATION)
    for limit in (low, high):
        contract.check_observation(np.where(np.isfinite(limit), limit, 0.0))
    for column, quantity in enumerate(contract.OBSERVATION):
        for value in (np.nan, np.inf, -np.inf, high[column] + 1.0, low[column] - 1.0):
            row = np.zeros(contract.OBSERVATION_WIDTH)
            row[column] = value
            if not np.isfinite(value) or not low[column] <= value <= high[column]:
                with pytest.raises(ValueError, match=quantity.name):
                    contract.check_observation(row)
