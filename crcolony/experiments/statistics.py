"""The statistics of a comparison: intervals, ratios, tests and correlations over runs."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.sweep import Outcome


def report(outcomes: list[Outcome]) -> list[str]:
    """Return the lines that say what the runs show: means with 95 % intervals, tests, correlations."""
    from scipy.stats import mannwhitneyu

    lines = []
    arms = list(dict.fromkeys(outcome.arm for outcome in outcomes))
    ends = {arm: _column(outcomes, arm, "matings_end") for arm in arms}
    for arm in arms:
        first = _column(outcomes, arm, "matings_first")
        lines += [
            "",
            f"{arm}: {ends[arm].size} runs",
            f"  matings per agent   {_interval(first)} at generation 0, {_interval(ends[arm])}"
            f" at the end: {ends[arm].mean() / max(first.mean(), 1e-12):.1f} times",
            f"  captured batteries  {_interval(_column(outcomes, arm, 'captures_first'))} to"
            f" {_interval(_column(outcomes, arm, 'captures_end'))}",
            f"  tau at the end      mating {_interval(_column(outcomes, arm, 'mating_tau_end'))},"
            f" foraging {_interval(_column(outcomes, arm, 'foraging_tau_end'))}",
            f"  matings and lambda  {_correlation(outcomes, arm)}",
        ]
    if "implicit" in arms:
        own = ends["implicit"]
        for arm in (arm for arm in arms if arm != "implicit"):
            p = mannwhitneyu(own, ends[arm]).pvalue
            lines += ["", f"implicit / {arm}: {_ratio(own, ends[arm])} (Mann-Whitney p = {p:.2g})"]
    return lines


def _ratio(one: FloatArray, other: FloatArray) -> str:
    """Return the ratio of two means and its 95 % interval by bootstrap (10,000 resamples, always the same)."""
    rng = np.random.default_rng(0)
    means = [rng.choice(values, (10_000, values.size)).mean(axis=1) for values in (one, other)]
    low, high = np.quantile(means[0] / np.maximum(means[1], 1e-12), [0.025, 0.975])
    return f"{one.mean() / max(other.mean(), 1e-12):.2f} ({low:.2f} to {high:.2f})"


def _column(outcomes: list[Outcome], arm: str, name: str) -> FloatArray:
    return np.array([getattr(outcome, name) for outcome in outcomes if outcome.arm == arm])


def _interval(values: FloatArray) -> str:
    """Return mean and 95 % interval (Student's t) in words."""
    from scipy.stats import t

    if values.size < 2:
        return f"{values.mean():.2f}"
    half = t.ppf(0.975, values.size - 1) * values.std(ddof=1) / np.sqrt(values.size)
    return f"{values.mean():.2f} ± {half:.2f}"


def _correlation(outcomes: list[Outcome], arm: str) -> str:
    from scipy.stats import spearmanr

    matings = _column(outcomes, arm, "matings_end")
    if matings.size < 3:
        return "too few runs"
    found = spearmanr(matings, _column(outcomes, arm, "mating_lambda_end"))
    return f"Spearman {found.statistic:.2f} (p = {found.pvalue:.2g})"
