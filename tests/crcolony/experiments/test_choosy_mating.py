"""Liberal and choosy mating are judged as registered, whatever the runs show."""

import numpy as np
import pytest

from crcolony.experiments.choosy_mating import (
    CHOOSY,
    EVOLVING,
    EXPERIMENT,
    LIBERAL,
    SOCIETIES,
    WORLDS,
    draw,
)
from crcolony.experiments.colonies.mating_traits import HealthOffer
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Plan, Row

CLAIMS = {claim.id: claim for claim in summaries()["choosy-mating"].claims}
RUNS = 8


def rows_with(society: str, value: float, world: str = "default") -> list[Row]:
    """Return two generations and the outcome of a society, in which every number is nearly the same."""
    rows: list[Row] = []
    for k in range(RUNS):
        own: Row = {"condition": world, "seed": k, "society": society}
        number = value * (1.0 + 0.01 * (k % 3))
        rows += [{**own, "generation": one, "choosiness": number} for one in range(2)]
        names = ("energy_weighted_matings_end", "captures_end", "choosiness_end")
        rows.append({**own, **dict.fromkeys(names, number)})
    return rows


@pytest.mark.parametrize(
    ("claim", "world", "ahead", "behind"),
    [
        ("choosy-ahead-default", "default", CHOOSY, LIBERAL),
        ("choosy-ahead-scarce", "scarce", CHOOSY, LIBERAL),
        ("choosy-forages", "default", CHOOSY, LIBERAL),
        ("liberal-evolves-default", "default", LIBERAL, EVOLVING),
        ("liberal-evolves-scarce", "scarce", LIBERAL, EVOLVING),
    ],
)
def test_a_claim_holds_if_one_society_is_clearly_ahead(
    claim: str, world: str, ahead: str, behind: str
) -> None:
    """In its world, and not the other way round."""
    judge = EXPERIMENT.measures[claim]
    for one, other, verdict in ((0.9, 0.3, "reproduced"), (0.3, 0.9, "not")):
        rows = rows_with(ahead, one, world) + rows_with(behind, other, world)
        assert judge(CLAIMS[claim], rows).verdict == verdict


def test_societies_differ_in_whom_they_take() -> None:
    """The liberal anyone, the choosy a partner that is well off, the others what they ask for."""
    own, partner = np.array([0.0, 0.0, 0.5]), HealthOffer("b/0", np.zeros(3), np.zeros(3), 0.6)
    taken = {name: accept(own, partner) for name, accept in SOCIETIES.items()}
    assert taken == {LIBERAL: 1.0, CHOOSY: 0.0, EVOLVING: 1.0}


def test_the_worlds_differ_in_batteries_alone() -> None:
    """A job for each world and seed."""
    jobs = EXPERIMENT.jobs(Plan([3]))
    assert [job.condition for job in jobs] == list(WORLDS)
    configs = [job.run.args[0] for job in jobs]  # type: ignore[attr-defined]
    assert [one.arena.packs_per_robot for one in configs] == [2.0, 1.0]
    assert configs[0].life == configs[1].life


def test_the_figure_has_every_society_in_every_world() -> None:
    """Points and their mean for each; choosiness of two societies in a panel for each world."""
    rows = [row for world in WORLDS for name in SOCIETIES for row in rows_with(name, 0.5, world)]
    matings, *panels = draw(rows).axes
    assert len(matings.lines) == 2 * len(WORLDS) * len(SOCIETIES)
    assert [len(panel.lines) for panel in panels] == [2, 2]
