"""The ready-made control step is the compiled one: the same robots, bit for bit, without a compiler in the process."""

import subprocess
import sys

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.compiled import is_switched_off
from crcolony.robot.aot_step import load_step
from crcolony.robot.state import SLICE_OVER, Robots
from crcolony.robot.step import step_robot
from tests.support.small_robots import new_robots, observation

pytestmark = pytest.mark.skipif(is_switched_off(), reason="nothing is compiled here")


def assert_equal(one: Robots, other: Robots) -> None:
    for name, mine, others in zip(Robots._fields, one, other, strict=True):
        assert np.array_equal(mine, others), name


def test_it_lives_the_same_life() -> None:
    """Over whole generations, in any row of a batch, with hand-overs and turnovers."""
    one, parameters, robots = new_robots(3)
    other, _, others = new_robots(3)
    step = load_step(one, parameters)
    action, expected = np.zeros(contract.ACTION_WIDTH), np.zeros(contract.ACTION_WIDTH)
    for robot in (*robots, *others):
        robot.start()
    rng = np.random.default_rng(1)
    for _ in range(800):
        row = int(rng.integers(3))
        seen = observation(rng)
        step(row, seen, action)
        step_robot(other, parameters, row, seen, expected)
        assert np.array_equal(action, expected)
        if other.events[row] & SLICE_OVER:
            for robot in (robots[row], others[row]):
                if not robot.hand_over():
                    robot.turn_over()
        assert_equal(one, other)


def test_a_robot_with_another_body_steps_by_its_habits() -> None:
    """The table of addresses is made anew when habits change."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    seen = observation(np.random.default_rng(3))
    seen[contract.FACE] = seen[contract.PACK] = 0.0
    robot.step(seen)
    _, parameters, _ = new_robots(1)
    robot.set_parameters(parameters._replace(action_ttl_s=7.0))
    assert robot.step(seen)[contract.TTL] == 7.0


def test_no_compiler_is_imported_where_the_code_is_ready() -> None:
    """A process that only steps robots never imports numba, once the code was made."""
    program = """
import sys
import numpy as np
from tests.support.small_robots import new_robots, nothing
_, _, (robot,) = new_robots(1)
robot.start()
robot.step(nothing())
print("numba" in sys.modules)
"""
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "False"
