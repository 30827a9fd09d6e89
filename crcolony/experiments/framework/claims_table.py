"""The table of all claims (`docs/claims.md`), measured again from the published rows of results folders alone.

p values are corrected for the number of tests in the table (Holm 1979): what is not significant then is reproduced only
in part. What is registered is what the folder holds from before its first run.
"""

import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from crcolony.experiments.framework.catalogue import find_experiment, summaries
from crcolony.experiments.framework.experiment import CONDITION, SEED, Measured
from crcolony.experiments.framework.experiment_folder import Description, ExperimentFolder
from crcolony.experiments.framework.measured_claims import (
    estimate_text,
    measure_claims,
    verdict_text,
)
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import LEVEL, holm
from crcolony.experiments.framework.tidy_table import check_needed_packages, read_rows
from crcolony.storage.files import FolderError

_HEADER = ("claim", "thesis", "measured", "runs", "effect size", "p", "p, corrected", "verdict")


@dataclass(frozen=True)
class TableRow:
    """A claim in the table; its verdict holds after the correction."""

    description: Description
    claim: Claim
    measured: Measured
    corrected_p: float
    tried: str
    """What was tried to reproduce it, written afterwards; empty: nothing"""


def read_table(folders: Sequence[Path]) -> list[TableRow]:
    """Return the claims of results folders; raises FolderError for one whose results are no claims.

    Those are folders of something else, of runs that are not complete, quick, or of too few seeds, and two of one
    experiment. Raises ImportError if a package is missing.
    """
    check_needed_packages()
    found: list[tuple[Description, Claim, Measured]] = []
    measured_in: dict[str, Path] = {}
    for path in folders:
        description = ExperimentFolder(path).description()
        other = measured_in.setdefault(description.experiment, path)
        if other is not path:
            raise FolderError(f"{path}: the experiment {description.experiment} is in {other}, too")
        found += [(description, *one) for one in _measured(path, description)]
    corrected = holm([measured.p for _, _, measured in found])
    tried = {
        (name, claim.id): claim.tried
        for name, registration in summaries().items()
        for claim in registration.claims
    }
    return [
        TableRow(
            description,
            claim,
            _corrected(measured, p),
            p,
            tried.get((description.experiment, claim.id), ""),
        )
        for (description, claim, measured), p in zip(found, corrected, strict=True)
    ]


def _measured(path: Path, description: Description) -> Iterator[tuple[Claim, Measured]]:
    """Yield what the rows of a folder show of each claim that it holds; raises FolderError and ExperimentError."""
    name = description.experiment
    experiment = find_experiment(name)
    if description.is_quick:
        raise FolderError(f"{path}: a quick run, whose results are no claims")
    if not description.is_complete:
        raise FolderError(
            f"{path}: not complete; crcolony experiment {name} --resume --out {shlex.quote(str(path))}"
        )
    registration = ExperimentFolder(path).registration()
    rows = read_rows(path)
    if len({(row[CONDITION], row[SEED]) for row in rows}) != description.jobs:
        raise FolderError(f"{path}: not the rows of all {description.jobs} runs of {name}")
    for claim in registration.claims:
        if description.seeds < claim.seeds:
            raise FolderError(
                f"{path}: has {description.seeds} seeds, the claim {claim.id!r} asks for {claim.seeds}"
            )
        if claim.id not in experiment.measures:
            raise FolderError(f"{path}: the claim {claim.id!r} is not one of {name} any more")
    try:
        for one in measure_claims(experiment, registration, rows):
            yield one.claim, one.measured
    except KeyError as error:
        raise FolderError(
            f"{path}: rows of another version of {name}: no {error.args[0]}"
        ) from None


def _corrected(measured: Measured, p: float) -> Measured:
    if measured.verdict == "reproduced" and p >= LEVEL:
        return msgspec.structs.replace(measured, verdict="partly")
    return measured


def format_table(rows: Sequence[TableRow]) -> list[str]:
    """Return the page as lines of Markdown: a table for each experiment, and how each claim was judged."""
    lines = [
        "# Claims",
        "",
        f"{len(rows)} claims: {count_verdicts(rows)}. Made by `crcolony claims` from the rows of the runs alone"
        " (see [experiments.md](experiments.md)); estimates with 95 % intervals. Tests and thresholds were written"
        " down before the runs; p is corrected for the number of tests on this page (Holm), and what is not"
        " significant then is at most reproduced in part.",
    ]
    for name, own in by_experiment(rows).items():
        registration = summaries()[name]
        lines += [
            "",
            f"## {name}",
            "",
            f"{registration.summary} ({registration.source}). {own[0].description.seeds} seeds:"
            f" `{command_of(own[0].description)}`",
            "",
            f"| {' | '.join(_HEADER)} |",
            f"|{'---|' * len(_HEADER)}",
            *(f"| {' | '.join(map(_escaped, _cells(row)))} |" for row in own),
            "",
            *map(_judged, own),
        ]
    return lines


def by_experiment(rows: Sequence[TableRow]) -> dict[str, list[TableRow]]:
    """Return the rows of each experiment by its name, in their order."""
    found: dict[str, list[TableRow]] = {}
    for row in rows:
        found.setdefault(row.description.experiment, []).append(row)
    return found


def count_verdicts(rows: Sequence[TableRow]) -> str:
    """Return how many claims have which verdict, in words."""
    counts = Counter(row.measured.verdict for row in rows)
    return f"{counts['reproduced']} reproduced, {counts['partly']} in part, {counts['not']} not"


def _judged(row: TableRow) -> str:
    tried = f" Tried: {row.tried}" if row.tried and row.measured.verdict != "reproduced" else ""
    return (
        f"- *{row.claim.id}.* {row.claim.quantity}. {row.claim.test}."
        f" Measured: {row.measured.statistic}.{tried}"
    )


def _cells(row: TableRow) -> tuple[str, ...]:
    measured = row.measured
    effect = f"{measured.effect} {measured.effect_size:.2f}" if measured.effect else "–"
    return (
        row.claim.claim,
        row.claim.thesis,
        estimate_text(measured),
        str(measured.runs),
        effect,
        _format_p(measured.p),
        _format_p(row.corrected_p),
        verdict_text(measured),
    )


def command_of(description: Description) -> str:
    """Return the command that runs this again, with what is not the default."""
    default = summaries()[description.experiment].seeds
    words = f"crcolony experiment {description.experiment}"
    if description.seeds != default:
        words += f" --seeds {description.seeds}"
    if description.first_seed != 1:
        words += f" --seed {description.first_seed}"
    return words


def _format_p(p: float) -> str:
    return "–" if np.isnan(p) else f"{p:.2g}"


def _escaped(cell: str) -> str:
    return cell.replace("|", "\\|")
