"""The report of a comparison, as Markdown: every condition, implicit selection against the others, and the criteria."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import msgspec
import numpy as np
from scipy import stats

from crcolony.compiled import FloatArray
from crcolony.durable_files import replace_file
from crcolony.experiments.colonies.default_world_criteria import (
    MARGIN,
    USES_BOTH,
    Criterion,
    check_criteria,
    uses_both,
)
from crcolony.experiments.colonies.energy_effect import HIGH_ENERGY, LOW_ENERGY
from crcolony.experiments.colonies.neutral_drift import Drift
from crcolony.experiments.colonies.outcomes import Outcome
from crcolony.experiments.framework.statistics import (
    MIN_RUNS,
    Interval,
    correlation_power,
    detectable_correlation,
    effect_size,
    equivalence,
    mean_interval,
    rank_correlation,
    ratio_interval,
)
from crcolony.results.generation_table import LAST_GENERATIONS, write_table

OUTCOMES_TABLE = "outcomes.csv"
"""One row for every run."""
CRITERIA_FILE = "criteria.json"
"""The criteria of the default world, each with its measurement."""
DRIFT_TABLE = "meta_parameters.csv"
"""Every meta-parameter at the end beside neutral genes."""
REPORT_FILE = "comparison.md"

_POWER = 0.8
"""The correlation is named that the runs show with this probability."""
_QUANTITIES = {
    "matings_first": "matings, generation 0",
    "matings_early": "matings, generations 5 to 14",
    "matings_end": "matings, end",
    "energy_weighted_matings_end": "energy-weighted matings, end",
    "captures_end": "captured batteries, end",
    "energy_end": "mean energy, end",
    "starved_end": "share that starved, end",
    "mating_share_end": "share of mating steps, end",
    "mating_tau_end": "τ of mating, end",
    "mating_effective_tau_end": "effective τ of mating, end",
    "foraging_tau_end": "τ of foraging, end",
    "foraging_effective_tau_end": "effective τ of foraging, end",
    "energy_effect": f"P(mating), energy {LOW_ENERGY} → {HIGH_ENERGY}",
    "energy_effect_facing": "the same, with a face in sight",
    "energy_effect_searching": "the same, with none in sight",
    "energy_correlation": "raw correlation of energy and mating",
}
"""Rows of the table of conditions: fields of an outcome, and what they are."""
_COMPARED = {"matings_end": "matings", "energy_weighted_matings_end": "energy-weighted matings"}


def write_comparison(outcomes: Sequence[Outcome], drifts: Sequence[Drift], out: Path) -> list[str]:
    """Write outcomes, criteria and report into a folder; return the report's lines. Raises FolderError and OSError."""
    criteria = check_criteria(outcomes)
    lines = format_report(outcomes, criteria, drifts)
    write_table(out / OUTCOMES_TABLE, [asdict(outcome) for outcome in outcomes])
    write_table(out / DRIFT_TABLE, [asdict(drift) for drift in drifts])
    encoded = msgspec.json.format(msgspec.json.encode(criteria))
    replace_file(out / CRITERIA_FILE, lambda file: file.write(encoded))
    text = ("\n".join(lines) + "\n").encode()
    replace_file(out / REPORT_FILE, lambda file: file.write(text))
    return lines


def format_report(
    outcomes: Sequence[Outcome], criteria: Sequence[Criterion], drifts: Sequence[Drift]
) -> list[str]:
    """Return the report as lines."""
    runs: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        runs.setdefault(outcome.condition, []).append(outcome)
    return [
        f"Means over runs with 95 % intervals (bootstrap); the end is the mean of the last {LAST_GENERATIONS}"
        " generations, τ the median over agents.",
        "",
        *_format_conditions(runs),
        *_format_tests(runs),
        *_format_drifts(drifts),
        *_format_criteria(criteria),
    ]


def _format_conditions(runs: dict[str, list[Outcome]]) -> list[str]:
    rows = [["runs", *(str(len(own)) for own in runs.values())]]
    rows += [
        [name, *(_format(mean_interval(_values(own, field))) for own in runs.values())]
        for field, name in _QUANTITIES.items()
    ]
    rows += [
        [
            f"runs that use both modules (share {USES_BOTH[0]} to {USES_BOTH[1]})",
            *(f"{uses_both(own)} of {len(own)}" for own in runs.values()),
        ],
        ["matings and λ of mating (Spearman)", *map(_format_correlation, runs.values())],
    ]
    return [*_format_table(["", *runs], rows), *_format_power(max(map(len, runs.values()))), ""]


def _format_correlation(outcomes: Sequence[Outcome]) -> str:
    found = rank_correlation(
        _values(outcomes, "matings_end"), _values(outcomes, "mating_lambda_end")
    )
    if np.isnan(found.rho):
        return "too few runs"
    return f"{found.rho:.2f} ({found.low:.2f} to {found.high:.2f}), p = {found.p:.2g}"


def _format_power(runs: int) -> list[str]:
    """Return what a correlation over so many runs can show."""
    if runs <= MIN_RUNS:
        return []
    detectable = detectable_correlation(runs, _POWER)
    return [
        "",
        f"Over {runs} runs a rank correlation of ±{detectable:.2f} is significant with probability {_POWER}, one of"
        f" ±0.4 with {correlation_power(0.4, runs):.2f}.",
    ]


def _format_tests(runs: dict[str, list[Outcome]]) -> list[str]:
    """Return a table of implicit selection against every other condition, or nothing if there is nothing to compare."""
    others = [condition for condition in runs if condition != "implicit"]
    if "implicit" not in runs or not others:
        return []
    rows = [
        [name, condition, *_format_test(runs["implicit"], runs[condition], field)]
        for field, name in _COMPARED.items()
        for condition in others
    ]
    header = ["implicit against", "", "ratio", "A12", "Mann-Whitney p", "p not worse", "p equal"]
    return [
        *_format_table(header, rows),
        "",
        "A12 is the probability that a run of implicit selection is above one of the other. p not worse and p equal are"
        f" those of paired t-tests (TOST) with a margin of {MARGIN:.0%} of the other's mean, fixed beforehand.",
        "",
    ]


def _format_test(own: Sequence[Outcome], other: Sequence[Outcome], field: str) -> list[str]:
    by_seed = {outcome.seed: outcome for outcome in other}
    pairs = [(outcome, by_seed[outcome.seed]) for outcome in own if outcome.seed in by_seed]
    one, two = (_values([pair[side] for pair in pairs], field) for side in (0, 1))
    if one.size < MIN_RUNS:
        return [_format(ratio_interval(one, two)), *["too few runs"] * 4] if pairs else ["–"] * 5
    found = equivalence(one, two, MARGIN * max(float(two.mean()), 1e-12))
    return [
        _format(ratio_interval(one, two)),
        f"{effect_size(one, two):.2f}",
        f"{stats.mannwhitneyu(one, two).pvalue:.2g}",
        f"{found.p_inferior:.2g}",
        f"{found.p:.2g}",
    ]


def _format_drifts(drifts: Sequence[Drift]) -> list[str]:
    """Return a table of every meta-parameter beside neutral genes, by condition."""
    if not drifts:
        return []
    conditions = list(dict.fromkeys(drift.condition for drift in drifts))
    rows: dict[str, list[str]] = {}
    for drift in drifts:
        evolved = f"**{drift.evolved:.3f}**" if drift.is_outside else f"{drift.evolved:.3f}"
        band = f"({drift.neutral_low:.3f} to {drift.neutral_high:.3f})"
        rows.setdefault(drift.gene, [drift.gene]).append(f"{evolved} {band}")
    return [
        *_format_table(["meta-parameter, end", *conditions], list(rows.values())),
        "",
        "In brackets where 90 % of neutral genes end that are passed on along the same pedigrees; what lies outside, as"
        " one in ten does by chance, is bold.",
        "",
    ]


def _format_criteria(criteria: Sequence[Criterion]) -> list[str]:
    if not criteria:
        return []
    rows = [
        [one.claim, f"{one.measured:.3g}", one.statistic, "yes" if one.passed else "**no**"]
        for one in criteria
    ]
    return _format_table(["criterion of the default world", "measured", "statistic", "met"], rows)


def _format_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a table whose columns are aligned in a terminal, too."""
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]

    def line(cells: Sequence[str], fill: str = " ") -> str:
        padded = (cell.ljust(width, fill) for cell, width in zip(cells, widths, strict=True))
        return f"| {' | '.join(padded)} |"

    return [line(header), line(["---"] * len(widths), "-"), *map(line, rows)]


def _format(interval: Interval) -> str:
    if np.isnan(interval.low):
        return f"{interval.estimate:.2f}"
    return f"{interval.estimate:.2f} ({interval.low:.2f} to {interval.high:.2f})"


def _values(outcomes: Sequence[Outcome], name: str) -> FloatArray:
    return np.array([getattr(outcome, name) for outcome in outcomes])
