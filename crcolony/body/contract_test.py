"""What every body promises, simulated or physical: inherit `BodyContract` and say how to make one."""

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.contract import ACTION, OBSERVATION, Body, limits
from crcolony.compiled import FloatArray


class BodyContract:
    """Tests against the tables of `world.body`; `new_body` gives a fresh body."""

    def new_body(self) -> Body:
        raise NotImplementedError

    def test_it_observes_within_the_limits_of_the_table(self) -> None:
        """Every column of every observation is finite and in its range."""
        robot_body = self.new_body()
        low, high = limits(OBSERVATION)
        rng = np.random.default_rng(1)
        for _ in range(100):
            row = robot_body.read()
            assert row.shape == (contract.OBSERVATION_WIDTH,)
            assert np.isfinite(row).all()
            assert ((row >= low) & (row <= high)).all()
            robot_body.act(action(rng))
        robot_body.close()

    def test_it_applies_what_is_within_limits_and_clips_the_rest(self) -> None:
        """And says what it did."""
        robot_body = self.new_body()
        low, high = limits(ACTION)
        asked = action(np.random.default_rng(2))
        np.testing.assert_array_equal(robot_body.act(asked), asked)
        np.testing.assert_array_equal(robot_body.act(high + 7.0), high)
        np.testing.assert_array_equal(robot_body.act(low - 7.0), low)
        robot_body.close()

    @pytest.mark.parametrize("wrong", [np.zeros(3), np.full(contract.ACTION_WIDTH, np.nan)])
    def test_it_refuses_what_is_no_action(self, wrong: FloatArray) -> None:
        """Another shape, or numbers that are none."""
        robot_body = self.new_body()
        with pytest.raises(ValueError, match="an action"):
            robot_body.act(wrong)
        robot_body.close()

    def test_its_wheels_stop_when_it_hears_nothing(self) -> None:
        """Within the time to live of the last action, by itself."""
        robot_body = self.new_body()
        asked = np.zeros(contract.ACTION_WIDTH)
        asked[contract.WHEEL_LEFT], asked[contract.WHEEL_RIGHT] = -0.1, 0.1
        asked[contract.TTL] = 0.5
        robot_body.read()
        robot_body.act(asked)
        assert robot_body.read()[contract.WHEELS + 1] == pytest.approx(0.1)
        for _ in range(4):
            row = robot_body.read()
        assert row[contract.WHEELS : contract.WHEELS + 2].tolist() == [0.0, 0.0]
        assert row[contract.GYRO] == pytest.approx(0.0)
        robot_body.close()


def action(rng: np.random.Generator) -> FloatArray:
    """Return a random action within the limits of the table."""
    low, high = limits(ACTION)
    return rng.uniform(low, high)
