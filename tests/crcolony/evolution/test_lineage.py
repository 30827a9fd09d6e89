"""Agents have unique ids, and a birth has the parents and the time."""

import dataclasses

import pytest

from crcolony.evolution.lineage import Birth, agent_id


def test_an_id_has_the_robot_and_its_count_of_births() -> None:
    """Two robots, or two births of one, have different ids."""
    assert agent_id("3", 12) == "3/12"
    assert len({agent_id(robot, number) for robot in ("a", "b") for number in range(5)}) == 10


def test_a_birth_cannot_change() -> None:
    """It is a record."""
    birth = Birth("a/1", "a/0", None, "digest", 1, 100)
    with pytest.raises(dataclasses.FrozenInstanceError):
        birth.mother = "b/0"  # type: ignore[misc]
