"""The claims about faults are judged as registered, whatever the runs show."""

from typing import Any

import numpy as np
import pytest

from crcolony.experiments.faults import COLUMNS
from crcolony.experiments.faults_claims import (
    BOTH,
    GENES,
    KILLED,
    KILLS,
    LOSS,
    LOSSES,
    MEASURES,
    NEUTRAL,
    NONE,
    RANDOM,
    STRATEGY,
    condition_of,
    effect_of,
    gene_name,
)
from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Measured, Row

CLAIMS = {claim.id: claim for claim in summaries()["faults"].claims}
RUNS = 20
CONDITIONS = {condition_of(loss, kills): loss for loss in LOSSES for kills in KILLS}


def rows_with(changes: dict[str, dict[str, Any]] | None = None) -> list[Row]:
    """Return rows in which all columns are noise around 1/2, but for what is added to columns of conditions."""
    rng = np.random.default_rng(7)
    rows: list[Row] = []
    for condition in CONDITIONS:
        values = {name: 0.5 + 0.05 * rng.standard_normal(RUNS) for name in COLUMNS}
        for name, added in (changes or {}).get(condition, {}).items():
            values[name] = values[name] + added
        for k in range(RUNS):
            row: Row = {"condition": condition, "seed": k}
            rows.append(row | {name: float(values[name][k]) for name in COLUMNS})
    return rows


def measured(claim: str, changes: dict[str, dict[str, Any]] | None = None) -> Measured:
    return MEASURES[claim](CLAIMS[claim], rows_with(changes))


def test_hardly_any_encounter_may_fail() -> None:
    """Half of them is not hardly any."""
    assert measured("delivered", {LOSS: {"failed": -0.45}}).verdict == "reproduced"
    assert measured("delivered").verdict == "not"


@pytest.mark.parametrize(("slope", "expected"), [(-1.0, "reproduced"), (0.0, "not"), (1.0, "not")])
def test_conceptions_are_to_fall_with_loss(slope: float, expected: str) -> None:
    """The estimate is the slope, over both rates of kills."""
    changes = {
        condition: {"conceptions_end": slope * loss} for condition, loss in CONDITIONS.items()
    }
    found = measured("conceptions-fall", changes)
    assert found.verdict == expected
    assert found.estimate == pytest.approx(slope, abs=0.1)


@pytest.mark.parametrize(
    ("claim", "condition"),
    [("evolves-with-loss", LOSS), ("evolves-with-kills", KILLED), ("evolves-with-both", BOTH)],
)
def test_evolution_stands_faults_if_agents_mate_four_fifths_as_much(
    claim: str, condition: str
) -> None:
    """A little more than that is not sure; half as much is not enough."""
    for matings, expected in ((5.0, "reproduced"), (4.1, "partly"), (2.5, "not")):
        rows = rows_with()
        for row in rows:
            spread = 0.1 * (int(row["seed"]) - (RUNS - 1) / 2)
            row["matings_end"] = matings + spread if row["condition"] == condition else 5.0 - spread
        assert MEASURES[claim](CLAIMS[claim], rows).verdict == expected


@pytest.mark.parametrize(
    ("claim", "condition", "columns"),
    [
        ("genes-loss", LOSS, GENES),
        ("genes-kills", KILLED, GENES),
        ("genes-both", BOTH, GENES),
        ("strategy-loss", LOSS, STRATEGY),
        ("strategy-kills", KILLED, STRATEGY),
        ("strategy-both", BOTH, STRATEGY),
    ],
)
def test_faults_have_an_effect_if_a_column_moves(
    claim: str, condition: str, columns: tuple[str, ...]
) -> None:
    """It is named, with its size; noise has none, though some column of noise is always the most different."""
    still = measured(claim)
    assert still.verdict == "not"
    assert "no effect" in still.statistic
    moved = measured(claim, {condition: {columns[2]: 0.2}})
    assert moved.verdict == "reproduced"
    assert moved.statistic.startswith(columns[2])
    assert moved.estimate > 1.0
    assert moved.p < 0.001


@pytest.mark.parametrize(
    ("claim", "condition"), [("loss-or-chance", LOSS), ("both-or-chance", BOTH)]
)
def test_faults_differ_from_chance_only_where_the_control_of_the_same_run_does_not_move(
    claim: str, condition: str
) -> None:
    """If both move there is no effect, whatever becomes of colonies without faults."""
    assert measured(claim, {condition: {"tracking": 0.2}}).verdict == "reproduced"
    both = {condition: {"tracking": 0.2, f"{RANDOM}tracking": 0.2}}
    assert measured(claim, both).verdict == "not"
    assert measured(claim, {NONE: {"tracking": 0.2}}).verdict == "not"


def test_selection_stands_if_a_gene_goes_where_neutral_ones_do_not() -> None:
    """One that drifts as they do is not selected."""
    gene = "mating_tau"
    assert measured("selection-stands", {BOTH: {gene: -0.2}}).verdict == "reproduced"
    drifted = {BOTH: {gene: -0.2, f"{gene}{NEUTRAL}": -0.2}}
    assert measured("selection-stands", drifted).verdict == "not"


def test_p_is_corrected_for_the_columns_of_a_claim() -> None:
    """What would be significant alone is not among ten."""
    rng = np.random.default_rng(3)
    noise = 0.05 * rng.standard_normal(RUNS)
    rows = rows_with()
    for row in rows:
        for gene in GENES:
            row[gene] = 0.5
        if row["condition"] == LOSS:
            row["mating_tau"] = 0.5 + noise[int(row["seed"])] - noise.mean() + 0.036
    found = MEASURES["genes-loss"](CLAIMS["genes-loss"], rows)
    assert found.verdict == "not"
    assert found.statistic.startswith("no effect; smallest p: mating_tau")
    assert 0.05 < found.p < 10 * 0.05


def test_an_effect_is_a_difference_over_its_spread() -> None:
    """With its interval around it."""
    low, middle, high = effect_of(rows_with({BOTH: {"waiting": 0.14}}), BOTH, "waiting")
    assert low < middle < high
    assert middle == pytest.approx(2.0, abs=0.7)


def test_columns_name_genes() -> None:
    """Module and meta-parameter."""
    assert gene_name("mating_tau_decay") == "mating.tau_decay"
    assert len(GENES) == 10
