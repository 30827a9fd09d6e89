"""The experiment on the learning ability: what its runs are, and what a run leaves."""

from typing import Any

import numpy as np

from crcolony.config import Config
from crcolony.experiments.framework.experiment import CONDITION, SEED, Plan, Row
from crcolony.experiments.learning_ability import COLUMNS, EXPERIMENT


def test_a_quick_run_has_all_columns_and_a_figure_of_every_run() -> None:
    """The best agent of selection by mating goes to all bodies; its matings and captures are those of its slices."""
    rows: list[Row] = []
    for job in EXPERIMENT.jobs(Plan([7], True)):
        found = job.run()
        rows += [{CONDITION: job.condition, SEED: job.seed, **row} for row in found]  # type: ignore[dict-item]
    assert {name for row in rows for name in row} - {CONDITION, SEED} == set(COLUMNS)
    own, *slices = [row for row in rows if row[CONDITION] == "implicit"]
    assert len(slices) == 2
    assert len(rows) == 4
    for what in ("matings", "captures"):
        for body in ("own", "worn", "delayed"):
            lived = sum(float(row[f"curve_{what}_{body}"]) for row in slices)
            assert np.isclose(lived, float(own[f"transfer_{what}_life_{body}"]))
            thirds = [f"transfer_{what}_{third}_{body}" for third in ("first", "second", "last")]
            assert np.isclose(lived, sum(float(own[third]) for third in thirds))
    start, *_, mating, captures, _unused = EXPERIMENT.draw(rows).axes
    assert sum(np.asarray(line.get_xdata()).size for line in start.lines) == 4
    assert [len(axes.lines) for axes in (mating, captures)] == [3, 3]


def test_conditions_differ_in_selection_alone() -> None:
    """And runs in their seed; all else is the default world. Other bodies are those of two robots."""
    runs: dict[Any, Any] = {
        (job.condition, job.seed): job.run.args  # type: ignore[attr-defined]
        for job in EXPERIMENT.jobs(Plan([3, 4]))
    }
    assert len(runs) == 4
    config, bodies = runs["implicit", 3]
    assert config == Config(seed=3)
    assert runs["central", 4] == (Config(seed=4, selection="central"), {})
    assert bodies["own"] == Config(seed=3, robots=2)
    assert bodies["worn"].body.noise.distance_m > 0.0
    assert bodies["delayed"].body.action_latency_steps == 1
