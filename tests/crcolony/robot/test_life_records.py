"""What an agent achieved in its lifetime is recorded at the turnover."""

import pytest

from crcolony.robot.life_records import lifetimes_of
from tests.support.small_robots import new_robots


def test_a_lifetime_is_recorded_of_every_agent_of_the_robot() -> None:
    """Steps, mean energy, captures and matings are those of the agent, and of no other robot."""
    batch, _, robots = new_robots(2)
    for robot in robots:
        robot.start()
    batch.steps_alive[1] = [10, 4, 0]
    batch.energy_sum[1] = [5.0, 1.0, 0.0]
    batch.captures[1] = [3, 0, 0]
    batch.matings[1] = [1, 2, 0]
    records = lifetimes_of(robots[1], batch, tick=99, number=7)
    assert [record.agent for record in records] == robots[1].subpopulation.ids
    assert {(record.tick, record.robot, record.generation) for record in records} == {(99, 7, 0)}
    assert [record.steps for record in records] == [10, 4, 0]
    assert [record.captures for record in records] == [3, 0, 0]
    assert [record.matings for record in records] == [1, 2, 0]
    assert [record.energy for record in records] == pytest.approx([0.5, 0.25, 0.0])
