"""Navigation evolves in one body, and in another one; its figure has every run."""

import numpy as np

from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.navigation import COLUMNS, EXPERIMENT, GENERATIONS, draw, run
from crcolony.experiments.navigation_claims import KHEPERA, KOALA, LARGE_WEIGHTS, MOVED

CONDITIONS = (KHEPERA, KOALA, LARGE_WEIGHTS)


def test_a_run_gives_a_row_a_generation_and_one_of_the_best() -> None:
    """Until it is moved to another body the course is the same as if it were not; afterwards it is not."""
    staying, moved = run(6, 6, 2, 5), run(4, 6, 2, 5)
    assert [row.get("generation") for row in staying] == [0, 1, 2, 3, 4, 5, None]
    assert set().union(*staying) == set(COLUMNS)
    assert moved[:4] == staying[:4]
    assert moved[4] != staying[4]
    assert moved[-1] == staying[-1]
    assert run(6, 6, 2, 5) == staying


def test_conditions_differ_in_the_body_or_in_the_first_weights() -> None:
    """With the same seed the first generation does better or worse by its weights alone."""
    jobs = {job.condition: job for job in EXPERIMENT.jobs(Plan([7], is_quick=True))}
    assert tuple(jobs) == CONDITIONS
    first = {name: job.run()[0] for name, job in jobs.items()}  # type: ignore[index]
    assert first[KHEPERA] == first[KOALA] != first[LARGE_WEIGHTS]
    moved = {job.condition: job.run.args[0] for job in EXPERIMENT.jobs(Plan([7]))}  # type: ignore[attr-defined]
    assert moved == {KHEPERA: GENERATIONS, KOALA: MOVED, LARGE_WEIGHTS: GENERATIONS}


def test_the_figure_has_every_condition_and_every_run() -> None:
    """Curves of all, and a point for each best individual of those that drive in the small body alone."""
    rows: list[Row] = []
    for condition in CONDITIONS:
        for seed in range(4):
            own: Row = {"condition": condition, "seed": seed}
            rows += [{**own, "generation": k, "best": 0.4, "mean": 0.2} for k in range(3)]
            rows.append({**own, "fitness": 0.4, "speed": 0.8, "touched": 0.0, "laps": 1.5})
    best, mean, examined = draw(rows).axes
    assert [len(axes.lines) for axes in (best, mean, examined)] == [3, 3, 2]
    assert [np.asarray(line.get_xdata()).size for line in examined.lines] == [4, 4]
