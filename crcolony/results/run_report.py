"""The report at the end of a colony of processes: who mated with whom, what evolved, and where the results are."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from crcolony.config import Config
from crcolony.durable_files import replace_file
from crcolony.evolution.history import Mated
from crcolony.results.generation_summary import summarise_events
from crcolony.results.generation_table import GENERATION_TABLE, write_table
from crcolony.results.history_database import HISTORY_DATABASE, write_history
from crcolony.results.merged_history import MergedHistory, merge_robot_files
from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import PlotError
from crcolony.robot.genes import agent_schema
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.files import ROBOT_FILE, FolderError, robot_files_of_run
from crcolony.storage.sql import StorageError

_MAX_PAIRS = 6
"""Pairs of robots that are named in the report."""


@dataclass(frozen=True)
class RunResults:
    """The results of a colony of processes."""

    merged: MergedHistory
    rows: Sequence[dict[str, float]]
    """Of the table of generations"""
    failure: str | None
    """Why they could not be written, in one line"""


def write_results(folder: Path, config: Config) -> RunResults:
    """Merge the files of all robots of a folder, and write the results there; raises StorageError."""
    merged = merge_robot_files(robot_files_of_run(folder))
    genes = [gene.name for gene in agent_schema(config.learning, config.heredity).genes]
    rows = list(summarise_events(merged.events, genes))
    return RunResults(merged, rows, _write(folder, merged, rows))


def print_run_report(
    console: Console,
    folder: Path,
    config: Config,
    stop: ShutdownSignal,
    headline: str = "",
    has_plots: bool = True,
) -> None:
    """Merge the files of all robots of a folder, write the results there, then print a report, and draw figures.

    In this order: the terminal may be gone, and a further signal to `stop` leaves out the figures alone.
    """
    try:
        results = write_results(folder, config)
    except StorageError as error:
        console.print(f"no report: {error}", soft_wrap=True)
        return
    merged, rows = results.merged, results.rows
    lines = [headline, *_format_matings(merged), *_format_evolution(rows), results.failure]
    where = f"results: {folder}; files of robots: {folder}/robots/*/{ROBOT_FILE} (crcolony inspect)"
    for line in filter(None, [*lines, where]):
        console.print(line, soft_wrap=True)
    if rows and results.failure is None and has_plots:
        print_plots(console, folder, stop)
    console.print(f"history hash: {merged.hash}", soft_wrap=True)


def print_plots(console: Console, folder: Path, stop: ShutdownSignal) -> None:
    """Draw the figures of a run, and print where they are; a further signal to `stop` leaves them out."""
    line = f"no plots were drawn: crcolony plot {folder} draws them"
    with stop.interruptible():
        try:
            if not stop.is_urgent:
                draw_plots(folder)
                line = f"plots: {folder / 'plots'}"
        except PlotError as error:
            line = str(error)
    console.print(line, soft_wrap=True)


def _format_matings(merged: MergedHistory) -> list[str]:
    """Return lines that name the pairs that mated, and the number of offspring."""
    matings = matings_of(merged)
    if not matings:
        return ["no robots have mated yet"]
    conceptions = sum(mated.conceived + mated.partner_conceived for mated in matings)
    lines = [f"{len(matings)} matings led to {conceptions} offspring: {format_pairs(matings)}"]
    if merged.one_sided:
        lines.append(
            f"{len(merged.one_sided)} matings are in the file of one robot only: the partner is from"
            " another machine, or has not come back"
        )
    return lines


def matings_of(merged: MergedHistory) -> list[Mated]:
    """Return the matings that both sides hold."""
    return [event for event in merged.events if isinstance(event, Mated)]


def format_pairs(matings: Sequence[Mated]) -> str:
    """Return who mated with whom, and how often; the most frequent pairs are named."""
    pairs = Counter((mated.robot, mated.partner_robot) for mated in matings)
    named = ", ".join(
        f"robots {one} and {other} {format_times(times)}"
        for (one, other), times in pairs.most_common(_MAX_PAIRS)
    )
    others = len(pairs) - _MAX_PAIRS
    return named + (f", and {others} other pairs" if others > 0 else "")


def format_times(times: int) -> str:
    """Return how often something happened: once, twice, 3 times."""
    return {1: "once", 2: "twice"}.get(times, f"{times} times")


def _format_evolution(rows: Sequence[dict[str, float]]) -> list[str]:
    """Return a line that compares the last generation that ended with the first."""
    if len(rows) < 2:
        ended = {0: "no generation has ended yet", 1: "only one generation has ended"}[len(rows)]
        return [f"{ended}: too few to compare"]
    first, last = rows[0], rows[-1]
    message = [
        f"{name} {first[key]:.2f} → {last[key]:.2f}"
        for key, name in (
            ("matings", "matings per agent"),
            ("captures", "batteries"),
            ("energy", "energy"),
            ("mating.tau mean", "τ of mating"),
            ("mating.lambda mean", "λ of mating"),
            ("foraging.tau mean", "τ of foraging"),
        )
        if key in first and key in last
    ]
    return [f"from generation 0 to {last['generation']:.0f}: {', '.join(message)}"]


def _write(folder: Path, merged: MergedHistory, rows: Sequence[dict[str, float]]) -> str | None:
    """Write the results; return in one line why that failed, or None."""
    description = json.dumps(
        {
            "status": "stopped",
            "generations": len(rows),
            "history_hash": str(merged.hash),
            "robots": [robot.hex() for robot in merged.robots],
        },
        indent=2,
    ).encode()
    try:
        write_history(folder / HISTORY_DATABASE, merged.events)
        replace_file(folder / "run.json", lambda file: file.write(description))
        if rows:
            write_table(folder / GENERATION_TABLE, rows)
    except OSError as error:
        return f"{folder}: {error.strerror}"
    except FolderError as error:
        return str(error)
    return None
