"""Lies and doubt are judged as registered, whatever the runs show."""

import numpy as np
import pytest

from crcolony.experiments.colonies.mating_traits import HealthOffer
from crcolony.experiments.colonies.trait_societies import COLUMNS
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.lying import DOUBTING, EXPERIMENT, HONEST, LYING, SOCIETIES, draw

CLAIMS = {claim.id: claim for claim in summaries()["lying"].claims}
RUNS = 8


def rows_with(society: str, value: float) -> list[Row]:
    """Return curves and outcomes of a society in which every number is nearly the same."""
    rows: list[Row] = []
    for k in range(RUNS):
        numbers = dict.fromkeys(COLUMNS, value * (1.0 + 0.01 * (k % 3)))
        for generation in (0, 1, None):
            row: Row = {**numbers, "condition": "default", "seed": k, "society": society}
            kept = [name for name in row if name.endswith("_end") or name == "selection"]
            if generation is None:
                rows.append({name: row[name] for name in (*kept, "condition", "seed", "society")})
            else:
                own = {name: row[name] for name in row if name not in kept}
                rows.append({**own, "generation": generation})
    return rows


@pytest.mark.parametrize(
    ("claim", "ahead", "behind"),
    [
        ("lies-spread", LYING, HONEST),
        ("lies-blind", HONEST, LYING),
        ("lies-cost", HONEST, LYING),
        ("doubt-spreads", DOUBTING, LYING),
        ("doubt-helps", DOUBTING, LYING),
    ],
)
def test_a_claim_holds_if_one_society_is_clearly_ahead(claim: str, ahead: str, behind: str) -> None:
    """And not the other way round."""
    judge = EXPERIMENT.measures[claim]
    for one, other, verdict in ((0.9, 0.3, "reproduced"), (0.3, 0.9, "not")):
        rows = rows_with(ahead, one) + rows_with(behind, other)
        assert judge(CLAIMS[claim], rows).verdict == verdict


def test_societies_differ_in_what_they_pay_attention_to() -> None:
    """A liar that is nearly empty seems full to all but the honest, and to those that doubt."""
    liar = HealthOffer("b/0", np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.1)
    doubter = np.array([0.0, 1.0, 0.0])
    seems = {name: accept(doubter, liar) for name, accept in SOCIETIES.items()}
    assert seems == pytest.approx({HONEST: 0.1, LYING: 1.0, DOUBTING: 0.1})


def test_the_jobs_are_one_for_each_seed() -> None:
    """All societies of a seed begin with founders that evolve once."""
    jobs = EXPERIMENT.jobs(Plan([3, 4]))
    assert [(job.condition, job.seed) for job in jobs] == [("default", 3), ("default", 4)]


def test_the_figure_has_every_society() -> None:
    """Two traits by generation, and a point for each run of two societies against the honest one."""
    rows = [row for k, name in enumerate(SOCIETIES) for row in rows_with(name, 0.2 + 0.2 * k)]
    lie, doubt, matings = draw(rows).axes
    assert [len(axes.lines) for axes in (lie, doubt, matings)] == [3, 3, 3]
    assert [np.asarray(line.get_xdata()).size for line in matings.lines] == [RUNS, RUNS, 2]
