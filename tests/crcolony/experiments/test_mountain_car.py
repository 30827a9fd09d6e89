"""The experiment on the mountain car: what its runs are, and what a run leaves."""

import numpy as np
import pytest

from crcolony.experiments.framework.experiment import CONDITION, SEED, Plan, Row
from crcolony.experiments.mountain_car import (
    EXPERIMENT,
    first_robust_episode,
    run_competition,
    run_textbook,
)
from crcolony.experiments.mountain_car_claims import BOTH, META_ALONE, OMPAC, TEXTBOOK
from crcolony.experiments.worlds.mountain_car_evolution import CarSettings


def rows_of(is_quick: bool) -> list[Row]:
    """Return the rows of the runs of one seed, as they are written."""
    rows: list[Row] = []
    for job in EXPERIMENT.jobs(Plan([7], is_quick)):
        found = job.run()
        rows += [{CONDITION: job.condition, SEED: job.seed, **row} for row in found]  # type: ignore[dict-item]
    return rows


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    """Return the rows of quick runs of one seed."""
    return rows_of(True)


def test_a_quick_run_has_all_columns(rows: list[Row]) -> None:
    """Of every kind of learner, generations and curves included, and no other."""
    columns = {name for row in rows for name in row} - {CONDITION, SEED}
    assert columns == set(EXPERIMENT.columns)
    for condition in (BOTH, META_ALONE, TEXTBOOK, OMPAC):
        own = [row for row in rows if row[CONDITION] == condition]
        assert sum("first_steps" in row for row in own) == 1
        assert [row["episode"] for row in own if "episode" in row] == list(range(1, 121))
    assert {row["potential_0"] for row in rows if "potential_0" in row} != {0.0}


def test_the_same_seed_gives_the_same_rows() -> None:
    """Whoever runs it, and whatever ran before."""
    jobs = EXPERIMENT.jobs(Plan([7], True))
    assert [job.run() for job in jobs] == [job.run() for job in reversed(jobs)][::-1]


def test_competition_begins_with_the_founders_of_meta_parameters_alone(rows: list[Row]) -> None:
    """Of as many instances, so that both are compared in pairs; it measures what these do, and newborns."""
    first = {row[CONDITION]: row for row in rows if row.get("generation") == 0}
    found = run_competition(CarSettings(individuals=10, generations=2, episodes=20), 7)
    assert found[0]["alpha_mean"] == first[META_ALONE]["alpha_mean"]
    assert found[-1]["alpha_first"] == pytest.approx(found[0]["alpha_mean"])
    episodes = [float(row["steps"]) for row in found if "episode" in row]
    assert len(episodes) == 40
    assert found[-1]["first_steps"] == episodes[0]
    assert found[-1]["car_steps"] == pytest.approx(10 * sum(episodes))
    assert float(found[-1]["newborn_steps"]) > float(found[1]["steps_median"])


def test_the_best_textbook_learner_is_no_bad_one() -> None:
    """It is undiscounted and greedy, and learns as fast as the fast curves of figure 12.10."""
    found = run_textbook(20, 1)[-1]
    assert found["gamma"] == 1.0
    assert found["tau"] == 0.0
    assert float(found["chosen_steps"]) < 225
    assert 1_000 < float(found["first_steps"]) < 2_000


def test_a_policy_is_robust_from_the_first_of_ten_episodes_on() -> None:
    """Counted from 1; where none are robust it is the last episode."""
    assert first_robust_episode(np.full(50, 110.0)) == 1
    curve = np.concatenate([np.full(20, 500.0), np.full(30, 100.0)])
    assert first_robust_episode(curve) == 21
    assert first_robust_episode(np.full(50, 111.0)) == 50
