"""Energy stays between 0 and 1, and conception depends on it as the settings define."""

import pytest

from crcolony.robot.energy import conception_probability, next_energy


@pytest.mark.parametrize(
    ("energy", "charge", "after"),
    [(0.5, 0.0, 0.49), (0.5, 0.2, 0.69), (0.9, 0.4, 0.99), (0.005, 0.0, 0.0), (0.0, 0.0, 0.0)],
)
def test_energy_stays_between_0_and_1(energy: float, charge: float, after: float) -> None:
    """A charge fills it up to 1, a step costs some, and it is never negative."""
    assert next_energy(energy, charge, 0.01) == pytest.approx(after)


def test_the_probability_of_conception_is_a_power_of_the_energy() -> None:
    """The exponent is a setting; a dead agent never conceives, and none does below the
    threshold."""
    assert conception_probability(0.6, 0.0, 1.0) == 0.6
    assert conception_probability(0.5, 0.0, 2.0) == 0.25
    assert conception_probability(0.0, 0.0, 0.0) == 0.0
    assert conception_probability(0.3, 0.31, 0.0) == 0.0
    assert conception_probability(0.31, 0.31, 0.0) == 1.0
