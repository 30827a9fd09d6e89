"""The evolved against the founders: what agents did and inherited in the first generation seen and in the last."""

from collections.abc import Callable

from crcolony.compiled import FloatArray
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
from crcolony_dashboards.view_model.gene_statistics import QUANTILES, GeneStatistics
from crcolony_dashboards.view_model.generation_history import GenerationHistory, GenerationRow

SYMBOLS = {"alpha": "α", "gamma": "γ", "lambda": "λ", "tau": "τ", "tau_decay": "decay of τ"}
"""Of the meta-parameters"""
INPUTS = ("bias", "energy", "battery seen", "robot seen")
"""Of the selector, in words"""
_MEDIAN = QUANTILES.index(0.5)
_MEASURES: dict[str, Callable[[GenerationRow], float]] = {
    "matings of an agent": lambda row: row.matings.mean,
    "batteries": lambda row: row.captures.mean,
    "offspring": lambda row: row.conceptions.mean,
    "mean energy": lambda row: row.energy.mean,
}


def format_comparison(history: GenerationHistory, waiting: str) -> str:
    """Return a table in Markdown of the first and the last generation, or `waiting` before there are two."""
    rows = history.rows
    if len(rows) < 2:
        return waiting
    first, last = rows[0], rows[-1]
    name = "founders" if first.number == 0 else "first seen"
    lines = [
        f"| | {name} (generation {first.number}) | evolved (generation {last.number}) |",
        "|---|---|---|",
        *(_line(label, f"{of(first):.2f}", f"{of(last):.2f}") for label, of in _MEASURES.items()),
    ]
    if first.genes is not None and last.genes is not None:
        lines += _gene_lines(first.genes, last.genes)
    return "\n".join(lines)


def _gene_lines(first: GeneStatistics, last: GeneStatistics) -> list[str]:
    """Return lines of the median meta-parameters, the potentials and the selector."""
    modules = " · ".join(module.name for module in MODULES)
    lines = [
        _line(
            f"{SYMBOLS[meta]} ({modules})",
            _joined(first.meta_parameters[:, k, _MEDIAN]),
            _joined(last.meta_parameters[:, k, _MEDIAN]),
        )
        for k, meta in enumerate(META_PARAMETERS)
    ]
    lines.append(
        _line(
            "Φ at its target − far away",
            _joined(first.attraction, "+.2f"),
            _joined(last.attraction, "+.2f"),
        )
    )
    lines += [
        _line(f"selector: {name}", f"{before:+.2f}", f"{after:+.2f}")
        for name, before, after in zip(INPUTS, first.selector, last.selector, strict=True)
    ]
    return lines


def _joined(values: FloatArray, form: str = ".2f") -> str:
    return " · ".join(f"{value:{form}}" for value in values)


def _line(label: str, before: str, after: str) -> str:
    return f"| {label} | {before} | {after} |"
