"""Ways of choosing the next agent are judged as registered, whatever the runs show."""

import pytest

from crcolony.experiments.agent_choice import (
    COLUMNS,
    EXPERIMENT,
    GREEDY,
    RANDOM,
    SOFTMAX,
    WAYS,
    draw,
    run,
)
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Plan, Row
from tests.support.small_colony import small

CLAIMS = {claim.id: claim for claim in summaries()["agent-choice"].claims}
RUNS = 8


def rows_with(way: str, value: float) -> list[Row]:
    """Return two generations and the outcome of a way, in which every number is nearly the same."""
    rows: list[Row] = []
    for k in range(RUNS):
        own: Row = {"condition": way, "seed": k}
        numbers = dict.fromkeys(COLUMNS, value * (1.0 + 0.01 * (k % 3)))
        ends = {name for name in COLUMNS if name.endswith(("_early", "_newborn"))}
        curve = {name: number for name, number in numbers.items() if name not in ends}
        rows += [{**own, **curve, "generation": generation} for generation in range(2)]
        rows.append({**own, **{name: numbers[name] for name in ends}})
    return rows


@pytest.mark.parametrize(("name", "way"), [("greedy", GREEDY), ("softmax", SOFTMAX)])
@pytest.mark.parametrize("claim", ["accelerates", "evolves-further"])
def test_an_informed_way_must_be_clearly_ahead_of_random_order(
    claim: str, name: str, way: str
) -> None:
    """Not if it is behind."""
    judge, registered = EXPERIMENT.measures[f"{name}-{claim}"], CLAIMS[f"{name}-{claim}"]
    for value, verdict in ((2.0, "reproduced"), (0.5, "not")):
        rows = rows_with(way, value) + rows_with(RANDOM, 1.0)
        assert judge(registered, rows).verdict == verdict


def test_conditions_differ_in_time_sharing_alone() -> None:
    """All have as many slices in a generation."""
    jobs = EXPERIMENT.jobs(Plan([3]))
    assert [job.condition for job in jobs] == list(WAYS)
    lives = [job.run.args[0].life for job in jobs]  # type: ignore[attr-defined]
    assert [life.time_sharing for life in lives] == list(WAYS)
    assert len({(life.agents, life.slices, life.slice_steps) for life in lives}) == 1


def test_a_run_gives_what_the_columns_say() -> None:
    """A row a generation and one of what came of it; the same again for the same seed."""
    config = small(f"life.time_sharing={GREEDY}", "generations=2", "seed=4")
    rows = run(config)
    assert [row.get("generation") for row in rows] == [0, 1, None]
    assert set().union(*rows) == set(COLUMNS)
    assert rows[-1]["matings_early"] == pytest.approx(
        (float(rows[0]["matings"]) + float(rows[1]["matings"])) / 2
    )
    assert rows == run(config)


def test_the_figure_has_every_way() -> None:
    """Two curves, and points with their mean."""
    rows = [row for k, way in enumerate(WAYS) for row in rows_with(way, 1.0 + k)]
    matings, captures, newborn = draw(rows).axes
    assert [len(axes.lines) for axes in (matings, captures, newborn)] == [3, 3, 6]
