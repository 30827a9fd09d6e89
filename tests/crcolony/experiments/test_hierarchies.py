"""The experiment on hierarchies: its conditions, its rows, and that a seed gives the same ones."""

import numpy as np

from crcolony.evolution.typed_tree import parse_tree
from crcolony.experiments.framework.experiment import CONDITION, SEED, Plan, Row
from crcolony.experiments.hierarchies import (
    COLUMNS,
    EDGES,
    EXPERIMENT,
    changing_worlds,
    environments,
    plan_jobs,
    run_changes,
    run_environment,
)
from crcolony.experiments.hierarchies_claims import (
    CHANGES,
    DARWINIAN,
    DRIFT,
    IN_SIGHT,
    LAMARCKIAN,
    SENSES,
)
from crcolony.experiments.worlds.bring_home_tasks import GRAMMAR


def test_quick_runs_of_all_conditions_give_rows_that_are_drawn() -> None:
    """Two inheritances in three environments, two with long lives, four kinds of change, and drift."""
    jobs = plan_jobs(Plan([1], is_quick=True))
    assert len(jobs) == 19
    rows: list[Row] = []
    for job in jobs:
        found = job.run()
        for row in [found] if isinstance(found, dict) else found:
            assert row.keys() <= COLUMNS.keys()
            rows.append({CONDITION: job.condition, SEED: job.seed, **row})
    best = [parse_tree(str(row["best_graph"])) for row in rows if "best_graph" in row]
    assert len(best) == 18
    assert all(GRAMMAR.is_well_typed(tree) for tree in best)
    (drifted,) = (row for row in rows if row[CONDITION] == DRIFT)
    assert all(0.0 <= float(drifted[edge]) <= 1.0 for edge in EDGES)
    assert len(EXPERIMENT.draw(rows).axes) == 7


def test_a_seed_gives_the_same_rows() -> None:
    """And another seed others."""
    rows = [run_environment(IN_SIGHT, LAMARCKIAN, seed, True) for seed in (1, 1, 2)]
    assert rows[0] == rows[1] != rows[2]


def test_a_sensor_of_the_setting_makes_no_difference_to_darwinian_robots() -> None:
    """They live in one setting, and know nothing of another: the same runs, to the last pack."""
    for change in CHANGES:
        unsensed, sensed = (run_changes(change, sense, DARWINIAN, 1, True) for sense in SENSES)
        assert unsensed == sensed


def test_changes_are_of_the_wall_and_what_a_sensor_says_of_it() -> None:
    """Conflicting: its opening is at the other side. Harmless: it is not there. Unsensed: nothing says so."""
    one, other = changing_worlds("conflicting", is_sensed=True)
    assert (one.cue, other.cue) == (0, 1)
    mirrored = one.walls[4, [2, 1, 0, 3]] * [-1.0, 1.0, -1.0, 1.0] + [14.0, 0.0, 14.0, 0.0]
    np.testing.assert_array_equal(other.walls[4], mirrored)
    one, other = changing_worlds("harmless", is_sensed=False)
    assert (one.cue, other.cue) == (0, 0)
    assert (len(one.walls), len(other.walls)) == (5, 4)


def test_environments_are_of_rising_difficulty() -> None:
    """All in sight; beyond the camera's range; a wall between."""
    in_sight, out_of_sight, walled, in_view = environments().values()
    assert in_sight.view_range > 12.0 * 2.0**0.5
    assert out_of_sight.view_range < 10.0
    assert [len(world.walls) for world in (in_sight, out_of_sight, walled)] == [4, 4, 5]
    np.testing.assert_array_equal(in_view.walls, walled.walls)
    assert in_view.view_range > 14.0 * 2.0**0.5
