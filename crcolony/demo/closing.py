"""What a demo ends with: what evolved, who mated with whom, and where it is, in three sentences."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from crcolony.demo.evolution_display import evolved
from crcolony.results.merged_history import MergedHistory
from crcolony.results.run_report import format_pairs, format_times, matings_of

EVOLVED, LIVE = "evolved", "live"
"""The folders of the evolution, and of the robots that live, in the folder of a demo."""


def say_what_evolved(matings: Sequence[float]) -> str:
    """Return the sentence about the evolution; `matings` are per agent, by generation."""
    if len(matings) < 2:
        return "Evolution had no time: not even two generations ended."
    return (
        f"In {len(matings)} generations matings an agent went from {matings[0]:.1f} to"
        f" {evolved(matings):.1f}."
    )


def say_who_mated(merged: MergedHistory | None, seconds: float) -> str:
    """Return the sentence about the robots that lived as processes for so long; None: none did."""
    if merged is None:
        return "No robot has lived as a process of its own yet."
    lived = f"{len(merged.robots)} robots, each its own process, lived on for {seconds:.0f} s"
    matings = matings_of(merged)
    if not matings:
        return f"{lived} and have not mated yet."
    return f"{lived} and mated {format_times(len(matings))}: {format_pairs(matings)}."


def say_where(folder: Path, has_lived: bool) -> str:
    """Return the sentence about the folder of a demo."""
    own = shlex.quote(str(folder / (LIVE if has_lived else EVOLVED)))
    command = f"launch --out {own}" if has_lived else f"launch --from {own}"
    return f"All of it is in {folder}; its robots live on with: crcolony {command}"
