"""All of a robot's state is in named arrays, and what earlier versions saved stays readable."""

import numpy as np

from crcolony.robot.state import FORMER_NAMES, SCRATCH, Robots, with_present_names
from tests.support.small_robots import new_robots, random_observation


def test_every_former_name_leads_to_a_saved_field() -> None:
    """No present field has a name that once meant another one."""
    saved = set(Robots._fields) - set(SCRATCH)
    assert set(FORMER_NAMES.values()) <= saved
    assert not set(FORMER_NAMES) & set(Robots._fields)
    assert len(set(FORMER_NAMES.values())) == len(FORMER_NAMES)


def test_present_names_are_left_alone() -> None:
    """A snapshot of this version passes unchanged."""
    assert with_present_names({"weights": 1, "lived": 2}) == {"weights": 1, "steps_alive": 2}


def test_scratch_carries_nothing_from_one_step_to_the_next() -> None:
    """A robot whose scratch arrays are overwritten between two steps does the same as one whose are
    not."""
    one, _, (robot,) = new_robots(1)
    other, _, (disturbed,) = new_robots(1)
    robot.start()
    disturbed.start()
    rng = np.random.default_rng(1)
    for _ in range(50):
        row = random_observation(rng)
        for name in SCRATCH:
            getattr(other, name)[...] = -1
        assert np.array_equal(robot.step(row), disturbed.step(row))
    assert np.array_equal(one.weights, other.weights)
