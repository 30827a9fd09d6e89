"""The taxi's task graph is that of figure 3.2."""

import numpy as np
import pytest

from crcolony.experiments.worlds.taxi_tasks import MOVES, NAVIGATE, taxi_tasks
from crcolony.learning.maxq.flat_graph import ACTIVE, flatten
from crcolony.learning.maxq.maxq_learner import MaxqQ


@pytest.mark.parametrize(("abstract", "total"), [(False, 14_000), (True, 632)])
def test_it_has_as_many_values_as_is_known(abstract: bool, total: int) -> None:
    """14,000 values without abstraction, 632 with it."""
    assert MaxqQ(taxi_tasks(abstract)).sizes.total == total


@pytest.mark.parametrize(
    ("abstract", "moves", "others", "navigate", "get", "put", "root"),
    [(False, 500, 500, 2000, 1000, 1000, 1000), (True, 1, 2, 100, 104, 104, 16)],
)
def test_every_subtask_has_its_share(
    abstract: bool, moves: int, others: int, navigate: int, get: int, put: int, root: int
) -> None:
    """As Dietterich counts them: 4 + 4 + 400 + (4 + 100) + (4 + 100) + (16 + 0) with abstraction."""
    learner = MaxqQ(taxi_tasks(abstract))
    assert [learner.entries(name) for name in MOVES] == [moves] * 4
    assert [learner.entries(name) for name in ("Pickup", "Putdown")] == [others] * 2
    assert [learner.entries(name) for name in NAVIGATE] == [navigate] * 4
    assert [learner.entries(name) for name in ("Get", "Put", "Root")] == [get, put, root]


def test_there_is_always_something_to_do() -> None:
    """The root can go on in every state, by exactly one of Get and Put."""
    graph = taxi_tasks(True)
    flat, _ = flatten(graph)
    ends = dict(zip(graph.order, flat.ends, strict=True))
    assert np.all(ends["Root"] == ACTIVE)
    assert np.all((ends["Get"] == ACTIVE) != (ends["Put"] == ACTIVE))
