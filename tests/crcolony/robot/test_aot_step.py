"""The step compiled ahead of time gives the same robots as the compiled step, bit for bit."""

import ctypes
import subprocess
import sys

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.shared_pages import ACTION_AT, NOTHING, OBSERVATION_AT, ROW_AFTER, new_page
from crcolony.compiled import is_switched_off
from crcolony.robot.aot_step import load_step, math_library
from crcolony.robot.state import SLICE_OVER, Robots
from crcolony.robot.step import step_robot
from tests.support.small_robots import new_robots, random_observation

pytestmark = pytest.mark.skipif(is_switched_off(), reason="nothing is compiled here")


def assert_equal(one: Robots, other: Robots) -> None:
    """Compare all fields of two batches, bit for bit."""
    for name in Robots._fields:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_it_does_what_the_compiled_step_does() -> None:
    """In any row of a batch, over whole generations with hand-overs and turnovers."""
    one, parameters, robots = new_robots(3)
    other, _, others = new_robots(3)
    page = new_page()
    step = load_step(one, parameters, page)
    action, expected = np.zeros(contract.ACTION_WIDTH), np.zeros(contract.ACTION_WIDTH)
    for robot in (*robots, *others):
        robot.start()
    rng = np.random.default_rng(1)
    for _ in range(800):
        row = int(rng.integers(3))
        observation = random_observation(rng)
        page.numbers[OBSERVATION_AT + ROW_AFTER :][: contract.OBSERVATION_WIDTH] = observation
        assert step(row, NOTHING) == one.events[row]
        action[:] = page.numbers[ACTION_AT + 1 :][: contract.ACTION_WIDTH]
        step_robot(other, parameters, row, observation, expected)
        assert np.array_equal(action, expected)
        if other.events[row] & SLICE_OVER:
            for robot in (robots[row], others[row]):
                if not robot.hand_over():
                    robot.turn_over()
        assert_equal(one, other)


def test_other_parameters_apply_from_the_next_step_on() -> None:
    """A robot in another body steps by the parameters of that body."""
    _, _, (robot,) = new_robots(1)
    robot.start()
    observation = random_observation(np.random.default_rng(3))
    observation[contract.FACE] = observation[contract.PACK] = 0.0
    robot.step(observation)
    _, parameters, _ = new_robots(1)
    robot.set_parameters(parameters._replace(action_ttl_s=7.0))
    assert robot.step(observation)[contract.TTL] == 7.0


def test_no_compiler_is_imported_where_the_machine_code_is_stored() -> None:
    """A process that only steps robots does not import numba once the step has been compiled."""
    program = """
import sys
import numpy as np
from tests.support.small_robots import new_robots, empty_observation
_, _, (robot,) = new_robots(1)
robot.start()
robot.step(empty_observation())
print("numba" in sys.modules)
"""
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "False"


def test_the_functions_of_mathematics_are_found_without_a_tool_that_searches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In a container without ldconfig and compiler the C library has them all the same."""
    monkeypatch.setattr("ctypes.util.find_library", lambda _: None)
    assert ctypes.CDLL(math_library()).exp
