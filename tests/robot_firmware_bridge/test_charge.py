"""A battery that is charged feeds the robot, and nothing else does."""

import itertools

import pytest
from crcolony_bridge.charge import ChargeMeter
from hypothesis import given
from hypothesis import strategies as st

LEVELS = st.lists(st.floats(0.0, 1.0), max_size=50)


@given(st.integers(2, 90), st.floats(0.0, 1.0))
def test_charging_from_empty_to_full_gives_the_energy_of_a_charge(
    steps: int, energy: float
) -> None:
    """However many readings it takes."""
    meter = ChargeMeter(energy)
    total = sum(meter.update(k / steps) for k in range(steps + 1))
    assert total == pytest.approx(energy)


def test_a_voltage_that_recovers_a_little_is_no_charge() -> None:
    """As when motors stop."""
    meter = ChargeMeter()
    assert sum(meter.update(level) for level in (0.5, 0.508, 0.5, 0.509, 0.501)) == 0.0


@given(LEVELS)
def test_energy_is_never_more_than_what_the_battery_gained(levels: list[float]) -> None:
    """And never negative: a battery that runs down takes nothing from the robot."""
    meter = ChargeMeter()
    gained = [meter.update(level) for level in levels]
    rises = sum(max(b - a, 0.0) for a, b in itertools.pairwise(levels))
    assert all(energy >= 0.0 for energy in gained)
    assert sum(gained) <= rises + 1e-9
