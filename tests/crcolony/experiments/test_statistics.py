"""The statistics of a comparison are those of scipy."""

from dataclasses import replace

import numpy as np
from scipy import stats

from crcolony.experiments.statistics import format_report
from crcolony.experiments.sweep import Outcome

OUTCOME = Outcome("implicit", 1, 0.2, 5.0, 1.0, 2.0, 0.5, 0.1, 0.4, "00")


def outcomes_of(condition: str, ends: np.ndarray, lambdas: np.ndarray) -> list[Outcome]:
    return [
        replace(
            OUTCOME,
            condition=condition,
            seed=k,
            matings_end=float(end),
            mating_lambda_end=float(lambda_),
        )
        for k, (end, lambda_) in enumerate(zip(ends, lambdas, strict=True))
    ]


def test_the_report_agrees_with_scipy() -> None:
    """Means with Student's interval, the ratio with one by resampling, Mann-Whitney's and Spearman's p."""
    rng = np.random.default_rng(1)
    own, central = rng.normal(5.0, 1.0, 20), rng.normal(6.0, 1.0, 20)
    lambdas = 1.0 - 0.1 * own + rng.normal(0.0, 0.1, 20)
    lines = format_report(
        outcomes_of("implicit", own, lambdas) + outcomes_of("central", central, lambdas)
    )
    text = "\n".join(lines)
    low, high = stats.t.interval(0.95, 19, own.mean(), stats.sem(own))
    assert f"{own.mean():.2f} ± {0.5 * (high - low):.2f} at the end" in text
    found = stats.spearmanr(own, lambdas)
    assert f"Spearman {found.statistic:.2f} (p = {found.pvalue:.2g})" in text
    p = stats.mannwhitneyu(own, central).pvalue
    assert f"Mann-Whitney p = {p:.2g}" in text
    assert f"implicit / central: {own.mean() / central.mean():.2f} (" in text
    interval = text.split("implicit / central: ")[1].split("(")[1].split(")")[0]
    below, above = map(float, interval.split(" to "))
    assert below < own.mean() / central.mean() < above < below + 0.4
    assert "too few runs" in "\n".join(format_report(outcomes_of("implicit", own[:2], lambdas[:2])))
    assert format_report(outcomes_of("implicit", own[:1], lambdas[:1]))
