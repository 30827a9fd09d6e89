"""The tests that every body has to pass, simulated or physical.

An author of a driver subclasses `BodyContract` in a test module, with a name that pytest collects,
and implements `new_body`:

    class TestMyBody(BodyContract):
        period_s = 0.1

        def new_body(self) -> Body:
            return MyBody(connect_to_a_device_on_a_bench())

The body needs free space around it, so that its wheels can turn, and has to observe its wheel
speeds. `crcolony_bridge.driver_contract_test` runs these tests on a driver.
"""

import math

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract import ACTION, OBSERVATION, Body, limits
from crcolony.compiled import FloatArray

_WHEELS = slice(contract.WHEELS, contract.WHEELS + 2)
_MOTION = [contract.WHEEL_LEFT, contract.WHEEL_RIGHT]


class BodyContract:
    """The promises of `crcolony.body.contract.Body`, each a test."""

    period_s: float = 0.2
    """The control period: the time from one observation to the next."""
    wheel_tolerance_m_s: float = 1e-9
    """How much an observed wheel speed may differ from the one that was set."""

    observations: int = 100
    """How many observations are looked at."""
    tolerance_periods: int = 0
    """How many control periods earlier or later the wheels of a physical body may stop."""

    def new_body(self) -> Body:
        """Return a new body that stands still."""
        raise NotImplementedError

    def highest_action(self) -> FloatArray:
        """Return the highest action (ACTION_WIDTH,) that this body can carry out."""
        return limits(ACTION)[1]

    def test_every_observation_is_within_the_limits_of_the_table(self) -> None:
        """Each column of each observation is finite and in its range, whatever the body does."""
        body = self.new_body()
        low, high = limits(OBSERVATION)
        rng = np.random.default_rng(1)
        for _ in range(self.observations):
            row = body.read()
            assert row.shape == (contract.OBSERVATION_WIDTH,)
            assert np.isfinite(row).all()
            assert ((row >= low) & (row <= high)).all()
            body.act(random_action(rng))
        body.close()

    def test_an_action_is_clipped_to_the_limits_of_the_table_and_returned(self) -> None:
        """An action within the limits is returned as it is."""
        body = self.new_body()
        low, high = limits(ACTION)
        highest = self.highest_action()
        action = np.minimum(0.5 * random_action(np.random.default_rng(2)), 0.5 * highest)
        action[_MOTION] = 0.25 * highest[_MOTION]
        np.testing.assert_array_equal(body.act(action), action)
        np.testing.assert_allclose(body.act(high + 7.0), highest)
        lowest = np.where(low < 0.0, -highest, low)
        np.testing.assert_allclose(body.act(low - 7.0), lowest)
        body.close()

    @pytest.mark.parametrize("wrong", [np.zeros(3), np.full(contract.ACTION_WIDTH, np.nan)])
    def test_what_is_not_an_action_is_refused(self, wrong: FloatArray) -> None:
        """An array of another shape, or with a number that is not finite, raises ValueError."""
        body = self.new_body()
        with pytest.raises(ValueError, match="an action"):
            body.act(wrong)
        body.close()

    def test_a_new_body_stands_still(self) -> None:
        """Its wheels do not turn before the first action."""
        body = self.new_body()
        assert self._turning_periods(body, 3) == 0
        body.close()

    @pytest.mark.parametrize("ttl_s", [0.0, 0.2, 0.5, 1.0])
    def test_the_wheels_stop_when_the_time_to_live_of_the_action_is_over(
        self, ttl_s: float
    ) -> None:
        """Without a fresh action they turn for the time to live, in whole control periods, and no
        longer."""
        body = self.new_body()
        body.read()
        applied = body.act(turn_action(ttl_s))
        self._turns_for(body, float(applied[contract.TTL]))
        assert body.read()[contract.GYRO] == pytest.approx(0.0, abs=self.wheel_tolerance_m_s)
        body.close()

    def test_every_action_has_its_own_time_to_live(self) -> None:
        """A fresh action replaces the time that was left of the last one, be it longer or
        shorter."""
        for first_s, second_s in ((2.0, 0.2), (0.2, 2.0)):
            body = self.new_body()
            body.read()
            body.act(turn_action(first_s))
            body.read()
            applied = body.act(turn_action(second_s))
            self._turns_for(body, float(applied[contract.TTL]))
            body.close()

    def test_the_wheels_keep_turning_while_there_are_fresh_actions(self) -> None:
        """Each one starts its time to live from the beginning."""
        body = self.new_body()
        body.read()
        for _ in range(5):
            body.act(turn_action((1 + self.tolerance_periods) * self.period_s))
            assert self._turning_periods(body, 1) == 1
        body.close()

    def _turns_for(self, body: Body, ttl_s: float) -> None:
        """Check that the wheels turn for so long, and no longer."""
        periods = self._periods(ttl_s)
        turning = self._turning_periods(body, periods + 3)
        assert abs(turning - periods) <= (self.tolerance_periods if periods else 0)

    def _periods(self, ttl_s: float) -> int:
        """Return how many control periods a time to live lasts; one that has begun is completed."""
        return math.ceil(round(ttl_s / self.period_s, 6))

    def _turning_periods(self, body: Body, periods: int) -> int:
        """Return in how many of so many control periods the wheels turn; they may not start
        again."""
        is_turning = []
        for _ in range(periods):
            wheels = body.read()[_WHEELS]
            expected = turn_action(0.0)[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]]
            is_turning.append(bool(np.abs(wheels).max() > self.wheel_tolerance_m_s))
            if is_turning[-1]:
                assert wheels == pytest.approx(expected, abs=self.wheel_tolerance_m_s)
        assert is_turning == sorted(is_turning, reverse=True)
        return sum(is_turning)


def random_action(rng: np.random.Generator) -> FloatArray:
    """Return a random action within the limits of the table, shape (ACTION_WIDTH,)."""
    low, high = limits(ACTION)
    return rng.uniform(low, high)


def turn_action(ttl_s: float) -> FloatArray:
    """Return an action that turns the body on the spot for so long, shape (ACTION_WIDTH,)."""
    action = np.zeros(contract.ACTION_WIDTH)
    action[contract.WHEEL_LEFT], action[contract.WHEEL_RIGHT] = -0.1, 0.1
    action[contract.TTL] = ttl_s
    return action
