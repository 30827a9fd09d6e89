"""A run with faults gives what the columns say, and its control loses as many matings."""

import numpy as np
import pytest

from crcolony.experiments.colonies.faulty_colony import FaultRates
from crcolony.experiments.faults import COLUMNS, EXPERIMENT, draw, run
from crcolony.experiments.faults_claims import BOTH, GENES, KILLS, LOSSES, RANDOM, condition_of
from crcolony.experiments.framework.experiment import Plan, Row

QUICK = Plan(seeds=(1,), is_quick=True)


def test_a_run_with_a_control_has_every_column() -> None:
    """The same each time, and the genes within their ranges."""
    job = next(job for job in EXPERIMENT.jobs(QUICK) if job.condition == BOTH)
    row = job.run()
    assert isinstance(row, dict)
    assert row == job.run()
    rarely = {"mating_energy", f"{RANDOM}mating_energy"}
    assert set(COLUMNS) - rarely <= set(row) <= set(COLUMNS)
    assert (row["loss"], row["kills_per_h"]) == (0.4, 10.0)
    for gene in GENES:
        assert 0.0 <= float(row[gene]) <= 1.0
    for name in ("waiting", "choosiness", "tracking", "mating_share", "failed"):
        assert 0.0 <= float(row[name]) <= 1.0


def test_conditions_differ_in_their_faults_alone() -> None:
    """Eight of them; two have a control."""
    jobs = EXPERIMENT.jobs(Plan(seeds=(3, 4)))
    calls = {(job.condition, job.seed): job.run.args for job in jobs}  # type: ignore[attr-defined]
    assert len(calls) == 2 * len(LOSSES) * len(KILLS)
    for loss in LOSSES:
        for kills in KILLS:
            config, rates, has_control = calls[condition_of(loss, kills), 3]
            assert config == calls[condition_of(0.0, 0.0), 3][0]
            assert rates == FaultRates(loss, kills)
            assert has_control == (loss == 0.4)


def test_without_a_control_there_are_no_columns_of_one() -> None:
    """As where nothing fails."""
    config = EXPERIMENT.jobs(QUICK)[0].run.args[0]  # type: ignore[attr-defined]
    row = run(config, FaultRates(), has_control=False)
    assert row["failed"] == pytest.approx(0.0)
    assert not any(name.startswith(RANDOM) for name in row)


def test_the_figure_has_every_condition() -> None:
    """Both curves by loss, and a point for each gene and part of a strategy."""
    rng = np.random.default_rng(1)
    rows: list[Row] = []
    for loss in LOSSES:
        for kills in KILLS:
            for seed in range(5):
                row: Row = {"condition": condition_of(loss, kills), "seed": seed}
                rows.append(row | {name: float(rng.normal()) for name in COLUMNS})
    failed, matings, effects = draw(rows).axes
    assert len(failed.lines) == len(matings.lines) == len(KILLS)
    assert len(effects.get_yticks()) == len(GENES) + 5
