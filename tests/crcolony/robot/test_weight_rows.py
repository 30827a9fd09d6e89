"""Tiles get rows at their first visit, and memory that no row has needed is not taken."""

import numpy as np
import pytest

from crcolony.body.settings import CyberRodent
from crcolony.robot.batch import empty_robots, step_parameters
from crcolony.robot.settings import Learning, Life
from crcolony.robot.state import Robots
from crcolony.robot.weight_rows import (
    find_rows,
    forget,
    give_rows,
    inherit_weights,
    weights_by_tile,
    with_rows,
)

INITIAL_WEIGHT = 0.25


def new_robots() -> Robots:
    """Return two robots of three agents."""
    return empty_robots(2, step_parameters(Learning(), Life(), CyberRodent()), 3, 1, 1)


def test_a_tile_keeps_the_row_of_its_first_visit() -> None:
    """Of each agent and module, with the initial weight; a row of one is never that of another."""
    robots = new_robots()
    first = np.arange(robots.next_tiles.shape[0])
    rows = []
    for agent, module, tiles in ((0, 0, first), (2, 1, first), (0, 0, first), (0, 0, first + 1)):
        robots.next_tiles[:] = tiles
        give_rows(robots, 1, agent, module, INITIAL_WEIGHT)
        rows.append(robots.next_rows.tolist())
    count = first.size
    assert rows[0] == first.tolist()
    assert rows[1] == (first + count).tolist()
    assert rows[2] == rows[0]
    assert rows[3] == [*rows[0][1:], 2 * count]
    assert robots.rows_used.tolist() == [0, 2 * count + 1]
    assert (robots.weights[: 2 * count + 1] == INITIAL_WEIGHT).all()
    robots.state_tiles[1] = first + 1
    find_rows(robots, 1, 0, 0)
    assert robots.state_rows.tolist() == rows[3]


def visit(robots: Robots, i: int, agent: int, tiles: int) -> set[int]:
    """Let an agent visit its first tiles; return the rows that they have."""
    rows: set[int] = set()
    width = robots.next_tiles.shape[0]
    for first in range(0, tiles, width):
        robots.next_tiles[:] = first + np.arange(width)
        give_rows(robots, i, agent, 0, INITIAL_WEIGHT)
        rows |= set(robots.next_rows.tolist())
    return rows


def test_robots_need_what_they_visit_together() -> None:
    """However unequal they are, their rows are the first of the table, and none is of two robots."""
    robots = new_robots()
    one = visit(robots, 0, 0, 600) | visit(robots, 0, 1, 600)
    other = visit(robots, 1, 0, 80) | visit(robots, 1, 1, 80)
    assert len(one | other) == len(one) + len(other)
    assert max(one | other) < 1.2 * (len(one) + len(other) + 256)


def test_rows_of_a_former_generation_are_used_again() -> None:
    """By whichever robot needs some, for as many generations as there are."""
    robots = new_robots()
    highest = 0
    for generation in range(50):
        i = generation % 2
        forget(robots, i)
        rows = visit(robots, i, 0, 600)
        highest = max(highest, *rows)
    assert highest < 2 * 600 + 2 * 256
    assert robots.free_count[0] + 2 * 3 == robots.free_blocks.size


def test_the_table_of_all_tiles_has_the_initial_weight_where_no_row_is() -> None:
    """What a row holds is at its tile."""
    robots = new_robots()
    robots.next_tiles[:] = 5 + np.arange(robots.next_tiles.shape[0])
    give_rows(robots, 0, 1, 0, INITIAL_WEIGHT)
    robots.weights[robots.next_rows[0], 2] = 7.0
    table = weights_by_tile(robots, 0, INITIAL_WEIGHT)
    assert table[1, 0, 5, 2] == 7.0
    table[1, 0, 5, 2] = INITIAL_WEIGHT
    assert (table == INITIAL_WEIGHT).all()
    forget(robots, 0)
    assert robots.rows_used[0] == 0
    assert (weights_by_tile(robots, 0, INITIAL_WEIGHT) == INITIAL_WEIGHT).all()


def test_fields_with_rows_are_left_alone() -> None:
    """Those of this version, and those that lack something: what is missing is named elsewhere."""
    for arrays in ({"weights": 1, "weight_rows": 2}, {"steps": 3}):
        assert with_rows(arrays, INITIAL_WEIGHT) is arrays


@pytest.mark.parametrize(("agents", "kind"), [(20, np.int16), (21, np.int32)])
def test_rows_take_as_few_bytes_as_they_need(agents: int, kind: type) -> None:
    """16 bits for the default of 20 agents."""
    parameters = step_parameters(Learning(), Life(), CyberRodent())
    assert empty_robots(1, parameters, agents, 1, 1).weight_rows.dtype == kind


def test_what_agents_inherit_takes_as_many_rows_as_it_has_tiles() -> None:
    """In place of what they had learnt themselves; tiles that nobody visited have none."""
    robots = new_robots()
    visit(robots, 0, 0, 600)
    visit(robots, 1, 2, 80)
    robots.weights[:] = np.arange(robots.weights.shape[0], dtype=np.float32)[:, None]
    table, is_visited = weights_by_tile(robots, 1, 0.0), robots.weight_rows[1] >= 0
    parents = [2, 2, 0]
    inherit_weights(robots, 0, table[parents], is_visited[parents])
    assert np.array_equal(weights_by_tile(robots, 0, 0.0), table[parents])
    assert robots.rows_used.tolist() == [2 * robots.rows_used[1], robots.rows_used[1]]
    taken = robots.weight_blocks.shape[1] * 2 - int(robots.free_count[0])
    assert taken == 2  # blocks of the one robot and of the other
