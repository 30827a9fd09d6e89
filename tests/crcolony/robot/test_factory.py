"""Robots are made from their settings, the same for every way to run a colony."""

import numpy as np
import pytest

from crcolony.config import Config
from crcolony.evolution.implicit_selection import ImplicitSelection
from crcolony.evolution.medea import Medea
from crcolony.evolution.pega import Pega
from crcolony.evolution.pgta import Pgta
from crcolony.evolution.reproduction import CentrallyBred
from crcolony.evolution.time_sharing import (
    EpsilonGreedyOrder,
    RandomOrder,
    SoftmaxOrder,
    TimeSharing,
)
from crcolony.robot.factory import (
    make_reproduction,
    make_robots,
    make_time_sharing,
    make_variation,
    numbered_streams,
    own_streams,
)
from crcolony.robot.settings import Heredity, Life, RobotSettings, Selection

SETTINGS: RobotSettings = Config(seed=3, life=Life(agents=3), heredity=Heredity(pool_limit=5))


def test_robots_are_made_as_their_settings_define() -> None:
    """One row of the batch for each, with its own stream and its name in the ids of its agents."""
    streams = numbered_streams(3, 0, 2)
    batch, parameters, robots = make_robots(SETTINGS, ["a", "b"], streams)
    assert np.array_equal(batch.streams, streams)
    assert batch.genotypes.shape[:2] == (2, 3)
    assert parameters.slice_steps == SETTINGS.life.slice_steps
    assert [robot.row for robot in robots] == [0, 1]
    robots[1].start()
    assert robots[1].subpopulation.ids == ["b/0", "b/1", "b/2"]
    assert not batch.genotypes[0].any()


def test_a_numbered_robot_has_the_same_stream_in_its_own_process_and_in_a_colony() -> None:
    """Its number and the seed decide, not who else is in the batch."""
    colony = numbered_streams(5, 0, 4)
    for number in range(4):
        assert np.array_equal(numbered_streams(5, number, 1)[0], colony[number])
    assert np.unique(colony[:, 0]).size == 4


def test_a_robot_without_a_number_has_a_stream_by_its_id() -> None:
    """The same id gives the same stream in any company, another id another stream."""
    one, other = bytes(range(16)), bytes(range(1, 17))
    together = own_streams([one, other])
    assert np.array_equal(own_streams([other])[0], together[1])
    assert together[0, 0] != together[1, 0]


@pytest.mark.parametrize(
    ("selection", "strategy"),
    [
        ("implicit", ImplicitSelection),
        ("central", ImplicitSelection),
        ("pgta", Pgta),
        ("pega", Pega),
        ("medea", Medea),
        ("ompac", CentrallyBred),
        ("gpbt_pl", CentrallyBred),
    ],
)
def test_robots_reproduce_as_set(selection: Selection, strategy: type) -> None:
    """Each robot with a strategy of its own."""
    settings = Config(selection=selection)
    one, other = make_reproduction(settings), make_reproduction(settings)
    assert type(one) is type(other) is strategy
    assert one is not other


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("random", RandomOrder(3)),
        ("epsilon_greedy", EpsilonGreedyOrder(3, 0.1)),
        ("softmax", SoftmaxOrder(3, 0.1)),
    ],
)
def test_time_sharing_is_made_by_name(name: str, expected: TimeSharing) -> None:
    """The number of slices and the exploration are settings."""
    life = Life(slices=3, exploration=0.1, time_sharing=name)  # type: ignore[arg-type]
    assert make_time_sharing(life) == expected


def test_variation_is_made_of_the_heredity_settings() -> None:
    """Crossover and the probability of a mutation."""
    variation = make_variation(Heredity(crossover="uniform", mutation_probability=0.3))
    assert (variation.crossover, variation.mutation_probability) == ("uniform", 0.3)
