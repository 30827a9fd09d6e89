"""The claims of an experiment beside what was measured: as text for people, and as a file for programs."""

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import numpy as np

from crcolony.durable_files import replace_file
from crcolony.experiments.framework.experiment import Experiment, Measured, Row
from crcolony.experiments.framework.registration import Claim, Registration

CLAIMS_FILE = "claims.json"
_INDENT = 14
"""Columns before what is said of a claim"""


class MeasuredClaim(msgspec.Struct, frozen=True):
    """A claim and what was measured of it."""

    claim: Claim
    measured: Measured


def measure_claims(
    experiment: Experiment, registration: Registration, rows: Sequence[Row]
) -> list[MeasuredClaim]:
    """Return what the rows show of every claim that was registered before they were."""
    return [
        MeasuredClaim(claim, experiment.measures[claim.id](claim, rows))
        for claim in registration.claims
    ]


def write_claims(folder: Path, found: Sequence[MeasuredClaim], is_quick: bool) -> None:
    """Write what was measured into a folder; raises OSError."""
    content = msgspec.json.encode({"is_quick": is_quick, "claims": found})
    replace_file(folder / CLAIMS_FILE, lambda file: file.write(msgspec.json.format(content)))


def format_claims(
    found: Sequence[MeasuredClaim], seeds: int, columns: int | None = None
) -> Iterator[str]:
    """Yield lines: each claim beside what the thesis says and what was measured; in so many columns, or as they are."""
    for one in found:
        claim, measured = one.claim, one.measured
        few = f" (of {seeds} seeds; the claim asks for {claim.seeds})" * (seeds < claim.seeds)
        yield f"{claim.id}: {verdict_text(measured)}{few}"
        parts = {
            "claim": claim.claim,
            "thesis": claim.thesis,
            "quantity": claim.quantity,
            "test": claim.test,
            "measured": f"{estimate_text(measured)}; {measured.statistic}{_evidence(measured)}",
        }
        for name, text in parts.items():
            lines = textwrap.wrap(text, max(columns - _INDENT, _INDENT)) if columns else [text]
            yield f"    {name:<{_INDENT - 4}}{lines[0]}"
            yield from (" " * _INDENT + line for line in lines[1:])


def verdict_text(measured: Measured) -> str:
    """Return the verdict in words."""
    words = {"reproduced": "reproduced", "partly": "reproduced in part", "not": "not reproduced"}
    return words[measured.verdict]


def estimate_text(measured: Measured) -> str:
    """Return the estimate with its interval."""
    if np.isnan(measured.low):
        return f"{measured.estimate:.3g}"
    return f"{measured.estimate:.3g} ({measured.low:.3g} to {measured.high:.3g})"


def _evidence(measured: Measured) -> str:
    p = "" if np.isnan(measured.p) else f", p = {measured.p:.2g}"
    return p + (f", {measured.effect} = {measured.effect_size:.2f}" if measured.effect else "")
