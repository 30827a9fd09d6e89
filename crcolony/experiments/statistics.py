"""The statistics of a comparison of conditions: intervals, ratios, tests and correlations over runs."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.sweep import Outcome


def format_report(outcomes: list[Outcome]) -> list[str]:
    """Return a report as lines: means with 95 % intervals, correlations, and tests against implicit selection."""
    from scipy.stats import mannwhitneyu

    lines = []
    conditions = list(dict.fromkeys(outcome.condition for outcome in outcomes))
    ends = {condition: _column(outcomes, condition, "matings_end") for condition in conditions}
    for condition in conditions:
        first = _column(outcomes, condition, "matings_first")
        lines += [
            "",
            f"{condition}: {ends[condition].size} runs",
            f"  matings per agent   {_format_interval(first)} at generation 0, {_format_interval(ends[condition])}"
            f" at the end: {ends[condition].mean() / max(first.mean(), 1e-12):.1f} times",
            f"  captured batteries  {_format_interval(_column(outcomes, condition, 'captures_first'))} to"
            f" {_format_interval(_column(outcomes, condition, 'captures_end'))}",
            f"  tau at the end      mating {_format_interval(_column(outcomes, condition, 'mating_tau_end'))},"
            f" foraging {_format_interval(_column(outcomes, condition, 'foraging_tau_end'))}",
            f"  matings and lambda  {_format_correlation(outcomes, condition)}",
        ]
    if "implicit" in conditions:
        own = ends["implicit"]
        for condition in (condition for condition in conditions if condition != "implicit"):
            p = mannwhitneyu(own, ends[condition]).pvalue
            lines += [
                "",
                f"implicit / {condition}: {_format_ratio(own, ends[condition])} (Mann-Whitney p = {p:.2g})",
            ]
    return lines


def _format_ratio(one: FloatArray, other: FloatArray) -> str:
    """Return the ratio of two means with its 95 % interval by bootstrap (10,000 resamples from a fixed seed)."""
    rng = np.random.default_rng(0)
    means = [rng.choice(values, (10_000, values.size)).mean(axis=1) for values in (one, other)]
    low, high = np.quantile(means[0] / np.maximum(means[1], 1e-12), [0.025, 0.975])
    return f"{one.mean() / max(other.mean(), 1e-12):.2f} ({low:.2f} to {high:.2f})"


def _column(outcomes: list[Outcome], condition: str, name: str) -> FloatArray:
    return np.array(
        [getattr(outcome, name) for outcome in outcomes if outcome.condition == condition]
    )


def _format_interval(values: FloatArray) -> str:
    """Return the mean with its 95 % interval (Student's t)."""
    from scipy.stats import t

    if values.size < 2:
        return f"{values.mean():.2f}"
    half = t.ppf(0.975, values.size - 1) * values.std(ddof=1) / np.sqrt(values.size)
    return f"{values.mean():.2f} ± {half:.2f}"


def _format_correlation(outcomes: list[Outcome], condition: str) -> str:
    from scipy.stats import spearmanr

    matings = _column(outcomes, condition, "matings_end")
    if matings.size < 3:
        return "too few runs"
    found = spearmanr(matings, _column(outcomes, condition, "mating_lambda_end"))
    return f"Spearman {found.statistic:.2f} (p = {found.pvalue:.2g})"
