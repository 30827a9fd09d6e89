"""On a page of shared memory a robot makes the same steps, and leaves all but quiet ones to the rest of its process."""

from collections.abc import Callable
from math import inf, nan

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.shared_pages import (
    LATEST_ACTION,
    LATEST_OBSERVATION,
    NOTHING,
    OBSERVATION_AT,
    OBSERVATION_WORDS,
    PAGE_BYTES,
    action_on,
)
from crcolony.protocol.body_messages import Contact
from crcolony.robot.aot_step import load_step
from crcolony.robot.paged_step import NOT_QUIET
from crcolony.robot.robot import Robot
from crcolony.robot.state import DIED, MET, SLICE_OVER, Robots
from crcolony.robot.step import step_robot
from crcolony.transport.shared_rows import RowPage
from tests.support.small_robots import empty_observation, new_robots, random_observation

TICK = 6


def new_page() -> RowPage:
    page = RowPage(memoryview(bytearray(PAGE_BYTES)))
    page.clear()
    return page


def new_robot() -> tuple[Robots, Robot, RowPage, Callable[[int], int]]:
    """Return a robot that has started, its batch, its page, and its step on that."""
    batch, _, (robot,) = new_robots(1)
    robot.start()
    page = new_page()
    return batch, robot, page, robot.step_on(page.arrays)


def state_of(batch: Robots) -> list[bytes]:
    return [np.asarray(field).tobytes() for field in batch]


def follow(robot: Robot) -> None:
    """Do what follows from a step."""
    if robot.events & SLICE_OVER and not robot.hand_over():
        robot.turn_over()


def test_a_quiet_observation_steps_as_ever() -> None:
    """Same robots, same actions, bit for bit, over generations; an action is announced unless there are events."""
    batch, robot, page, step = new_robot()
    other, parameters, (twin,) = new_robots(1)
    twin.start()
    expected = np.zeros(contract.ACTION_WIDTH)
    rng = np.random.default_rng(2)
    happened = 0
    for tick in range(1, 900):
        row = random_observation(rng)
        page.write_observation(tick, row, None)
        events = step(tick)
        step_robot(other, parameters, 0, row, expected)
        assert events == twin.events
        happened |= events
        announced = page.read_action(after_tick=NOTHING)
        if events == 0:
            assert announced is not None
            assert announced[0] == tick
            assert np.array_equal(announced[1], expected)
        else:
            assert announced is None or announced[0] < tick, "it has to wait for what follows"
        assert np.array_equal(action_on(page.arrays, tick), expected)
        for one in (robot, twin):
            follow(one)
        assert state_of(batch) == state_of(other)
    assert happened & MET
    assert happened & SLICE_OVER
    assert robot.generation > 0


def test_a_robot_that_dies_does_not_announce_its_action() -> None:
    """Its death is recorded before."""
    batch, _, page, step = new_robot()
    page.write_observation(TICK, empty_observation(), None)
    batch.energies[:] = 1e-9
    assert step(TICK) & DIED
    assert page.read_action(NOTHING) is None


def with_value(column: int, value: float) -> Callable[[RowPage], None]:
    """Return what writes an observation with this number."""

    def write(page: RowPage) -> None:
        row = empty_observation()
        row[column] = value
        page.write_observation(TICK, row, None)

    return write


def with_contact(page: RowPage) -> None:
    page.write_observation(TICK, empty_observation(), Contact(bytes(16), 0))


def half_written(page: RowPage) -> None:
    """Write an observation, and begin with the one that takes its place."""
    page.write_observation(TICK, empty_observation(), None)
    page.arrays.words[OBSERVATION_AT + (TICK & 1) * OBSERVATION_WORDS] = NOTHING


def older(page: RowPage) -> None:
    for tick in (TICK - 2, TICK - 1):
        page.write_observation(tick, empty_observation(), None)


def newer(page: RowPage) -> None:
    for tick in (TICK, TICK + 1):
        page.write_observation(tick, empty_observation(), None)


@pytest.mark.parametrize(
    "write",
    [
        pytest.param(lambda page: None, id="nothing"),
        older,
        newer,
        half_written,
        with_contact,
        pytest.param(with_value(contract.CHARGE, 1.5), id="charge"),
        pytest.param(with_value(contract.PACK, -1e-300), id="negative"),
        pytest.param(with_value(contract.GYRO, nan), id="nan"),
        pytest.param(with_value(contract.GYRO, inf), id="inf"),
        pytest.param(with_value(contract.GYRO, -inf), id="-inf"),
        pytest.param(with_value(contract.ENCOUNTER_NONCE, nan), id="last column"),
    ],
)
def test_what_is_not_quiet_makes_no_step(write: Callable[[RowPage], None]) -> None:
    """An absent or torn observation, a contact, numbers beyond the limits: robot and page stay as they are."""
    batch, _, page, step = new_robot()
    write(page)
    robot_before, page_before = state_of(batch), page.arrays.words.copy()
    assert step(TICK) == NOT_QUIET
    assert state_of(batch) == robot_before
    assert np.array_equal(page.arrays.words, page_before)


def test_the_same_observation_is_quiet_without_those() -> None:
    """Or the test above shows nothing; the largest numbers of unlimited columns are quiet, too."""
    for column, value in ((contract.GYRO, 1e308), (contract.CHARGE, 1.0), (contract.PACK, 0.0)):
        _, _, page, step = new_robot()
        with_value(column, value)(page)
        assert step(TICK) == 0
        assert page.arrays.words[LATEST_OBSERVATION] == page.arrays.words[LATEST_ACTION] == TICK


def test_without_a_tick_it_steps_by_whatever_is_there() -> None:
    """As a robot does whose observations come over the network: they were checked before."""
    batch, parameters, (robot,) = new_robots(1)
    robot.start()
    page = new_page()
    step = load_step(batch, parameters, page.arrays)
    steps = robot.steps
    assert step(0, NOTHING) == robot.events
    assert robot.steps == steps + 1
    assert page.read_action(NOTHING) is None, "nothing is announced"
