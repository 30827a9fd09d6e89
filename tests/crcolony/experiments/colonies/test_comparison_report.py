"""The report of a comparison holds the statistics of its runs, and is written beside them."""

import csv
import json
from pathlib import Path

import numpy as np
from scipy import stats

from crcolony.experiments.colonies.comparison_report import format_report, write_comparison
from crcolony.experiments.colonies.default_world_criteria import check_criteria
from crcolony.experiments.colonies.neutral_drift import Drift
from crcolony.experiments.framework.statistics import equivalence, mean_interval, rank_correlation
from tests.support.outcomes import outcomes_of

RNG = np.random.default_rng(1)
OWN, CENTRAL, LAMBDAS = RNG.normal(7.0, 1.0, 20), RNG.normal(6.0, 1.0, 20), RNG.random(20)
OUTCOMES = [
    *outcomes_of("implicit", 20, matings_end=OWN, mating_lambda_end=LAMBDAS),
    *outcomes_of("central", 20, matings_end=CENTRAL, mating_share_end=0.95),
]
DRIFTS = [
    Drift("implicit", "mating.tau", 0.1, 0.3, 0.7),
    Drift("implicit", "mating.gamma", 0.5, 0.3, 0.7),
    Drift("central", "mating.tau", 0.4, 0.2, 0.8),
    Drift("central", "mating.gamma", 0.9, 0.2, 0.8),
]


def cells(lines: list[str], first: str, second: str = "") -> list[str]:
    """Return the cells of the one row that begins so."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if "|" in line]
    (row,) = [row for row in rows if row[0] == first and second in ("", row[1])]
    return row


def test_every_condition_has_its_column() -> None:
    """Means with intervals, runs that use both modules, and the correlation of matings with λ."""
    lines = format_report(OUTCOMES, [], [])
    interval = mean_interval(OWN)
    assert cells(lines, "matings, end")[1].startswith(
        f"{interval.estimate:.2f} ({interval.low:.2f} to {interval.high:.2f})"
    )
    assert cells(lines, "runs that use both modules (share 0.1 to 0.9)")[1:] == [
        "20 of 20",
        "0 of 20",
    ]
    found = rank_correlation(OWN, LAMBDAS)
    assert cells(lines, "matings and λ of mating (Spearman)")[1].startswith(f"{found.rho:.2f} (")
    assert "a rank correlation of ±0.60 is significant with probability 0.8" in "\n".join(lines)


def test_implicit_selection_is_tested_against_the_others() -> None:
    """Ratio, A12, Mann-Whitney's p, and both p of the paired test with a margin of a tenth."""
    row = cells(format_report(OUTCOMES, [], []), "matings", "central")
    assert row[2].startswith(f"{OWN.mean() / CENTRAL.mean():.2f} (")
    assert row[3] == f"{np.mean(OWN[:, None] > CENTRAL[None, :]):.2f}"
    assert row[4] == f"{stats.mannwhitneyu(OWN, CENTRAL).pvalue:.2g}"
    found = equivalence(OWN, CENTRAL, 0.1 * CENTRAL.mean())
    assert row[5:] == [f"{found.p_inferior:.2g}", f"{found.p:.2g}"]


def test_meta_parameters_stand_beside_neutral_genes() -> None:
    """What lies outside of their band is bold."""
    lines = format_report(OUTCOMES, [], DRIFTS)
    assert cells(lines, "meta-parameter, end")[1:] == ["implicit", "central"]
    assert cells(lines, "mating.tau")[1:] == [
        "**0.100** (0.300 to 0.700)",
        "0.400 (0.200 to 0.800)",
    ]
    assert cells(lines, "mating.gamma")[2] == "**0.900** (0.200 to 0.800)"


def test_few_runs_are_reported_without_tests() -> None:
    """Also one run, one condition alone, and conditions that share no seed."""
    few = [*outcomes_of("implicit", 2), *outcomes_of("central", 2)]
    assert "too few runs" in cells(
        format_report(few, check_criteria(few), []), "matings", "central"
    )
    assert format_report(outcomes_of("central", 1), [], [])
    apart = [*outcomes_of("implicit", 4), *outcomes_of("central", 6)[4:]]
    assert cells(format_report(apart, [], []), "matings", "central")[2:] == ["–"] * 5


def test_outcomes_criteria_and_report_are_files(tmp_path: Path) -> None:
    """The printed lines are those of the report; every criterion has its number and its verdict."""
    lines = write_comparison(OUTCOMES, DRIFTS, tmp_path)
    assert (tmp_path / "comparison.md").read_text("utf-8").splitlines() == lines
    with (tmp_path / "outcomes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["matings_end"]) for row in rows] == [*OWN, *CENTRAL]
    with (tmp_path / "meta_parameters.csv").open(newline="") as file:
        assert [row["gene"] for row in csv.DictReader(file)] == [drift.gene for drift in DRIFTS]
    criteria = json.loads((tmp_path / "criteria.json").read_text("utf-8"))
    assert len(criteria) == 5
    for criterion, expected in zip(criteria, check_criteria(OUTCOMES), strict=True):
        assert criterion["passed"] is expected.passed
        assert criterion["measured"] == expected.measured
        assert cells(lines, criterion["claim"])[3] == ("yes" if expected.passed else "**no**")
