"""The report at the end of a colony of processes: who mated with whom, what evolved, and where the results are."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from crcolony.config import Config
from crcolony.evolution.history import Mated
from crcolony.results.generation_summary import summarise_events
from crcolony.results.generation_table import GENERATION_TABLE, write_table
from crcolony.results.history_database import HISTORY_DATABASE, write_history
from crcolony.results.merged_history import MergedHistory, merge_robot_files
from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import PlotError
from crcolony.robot.genes import agent_schema
from crcolony.storage.files import ROBOT_FILE, FolderError, replace_file, robot_files_of_run
from crcolony.storage.sql import StorageError

_MAX_PAIRS = 6
"""Pairs of robots that are named in the report."""


def print_run_report(console: Console, folder: Path, config: Config) -> None:
    """Merge the files of all robots of a folder, write the results there, and print a report."""
    try:
        merged = merge_robot_files(robot_files_of_run(folder))
    except StorageError as error:
        console.print(f"no report: {error}", soft_wrap=True)
        return
    genes = [gene.name for gene in agent_schema(config.learning, config.heredity).genes]
    rows = list(summarise_events(merged.events, genes))
    for line in [*_format_matings(merged), *_format_evolution(rows)]:
        console.print(line, soft_wrap=True)
    _write(console, folder, merged, rows)
    console.print(f"history hash: {merged.hash}", soft_wrap=True)


def _format_matings(merged: MergedHistory) -> list[str]:
    """Return lines that name the pairs that mated, and the number of offspring."""
    matings = [event for event in merged.events if isinstance(event, Mated)]
    if not matings:
        return ["no robots have mated yet"]
    pairs = Counter((mated.robot, mated.partner_robot) for mated in matings)
    conceptions = sum(mated.conceived + mated.partner_conceived for mated in matings)
    named = ", ".join(
        f"robots {one} and {other} {times} times" if times > 1 else f"robots {one} and {other} once"
        for (one, other), times in pairs.most_common(_MAX_PAIRS)
    )
    others = len(pairs) - _MAX_PAIRS
    lines = [
        f"{len(matings)} matings led to {conceptions} offspring: {named}"
        + (f", and {others} other pairs" if others > 0 else "")
    ]
    if merged.one_sided:
        lines.append(
            f"{len(merged.one_sided)} matings are in the file of one robot only: the partner is from"
            " another machine, or has not come back"
        )
    return lines


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


def _write(
    console: Console, folder: Path, merged: MergedHistory, rows: Sequence[dict[str, float]]
) -> None:
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
            draw_plots(folder)
            console.print(f"plots: {folder / 'plots'}", soft_wrap=True)
    except OSError as error:
        console.print(f"{folder}: {error.strerror}", soft_wrap=True)
    except (PlotError, FolderError) as error:
        console.print(str(error), soft_wrap=True)
    console.print(
        f"results: {folder}; files of robots: {folder}/robots/*/{ROBOT_FILE} (crcolony inspect)",
        soft_wrap=True,
    )
