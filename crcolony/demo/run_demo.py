"""Evolves a colony in this process for some seconds, then lets its robots live as processes, with a dashboard.

Ctrl-C ends either part; what there is by then is kept, and the end says in three sentences what it is.
"""

import importlib.util
import shlex
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from crcolony.compile_progress import compile_progress
from crcolony.config import Config
from crcolony.demo.closing import EVOLVED, LIVE, say_what_evolved, say_where, say_who_mated
from crcolony.demo.evolution_display import EvolutionDisplay
from crcolony.errors import EXIT_OK
from crcolony.in_process.colony import InProcessColony, run_ticks
from crcolony.in_process.run import run_until_done, start_run
from crcolony.results.colony_folder import open_colony_folder
from crcolony.results.earlier_run import read_earlier_run
from crcolony.results.merged_history import MergedHistory
from crcolony.results.plots import draw_generations_of
from crcolony.results.plots.conditions import PlotError
from crcolony.results.run_folder import RunFolder
from crcolony.results.run_report import write_results
from crcolony.runtime.forked_process import ForkServer
from crcolony.runtime.launch import run_processes
from crcolony.runtime.launch_plan import LaunchOptions
from crcolony.shutdown import ShutdownSignal
from crcolony.storage.claimed_folder import begin_demo_folder
from crcolony.storage.sql import StorageError
from crcolony.terminal import plain_console

_MIN_GENERATIONS = 2
"""With fewer nothing can be compared: a slow machine evolves for longer."""
_MOST_TIMES_LONGER = 6.0
"""But for at most so many times longer."""


@dataclass(frozen=True)
class DemoOptions:
    """What a demo does."""

    config: Config
    """Of the evolution"""
    live_config: Config
    """Of the robots that live as processes"""
    folder: Path | None
    """None: the next free runs/N"""
    seconds: float
    """Of evolution"""
    minutes: float | None
    """From the first control period on; None: until it is stopped"""
    hz: float
    """Control periods a second of the robots that live as processes"""
    has_dashboard: bool


def run_demo(options: DemoOptions) -> int:
    """Run both parts until stopped, and say what happened; return the exit code. Raises CrcolonyError."""
    console = plain_console()
    wake = threading.Event()
    stop = ShutdownSignal(wake=wake.set)
    display = EvolutionDisplay(console)
    with begin_demo_folder(options.folder) as claimed:
        folder = claimed.path
        try:
            results, colony = start_run(folder / EVOLVED, options.config)
        except BaseException:
            claimed.discard()
            raise
        _print(console, f"first {options.seconds:g} s of evolution in this process, into {folder}")
        _evolve(options, results, colony, display, stop)
        merged: MergedHistory | None = None
        lived_s = 0.0
        if not stop():
            _print(console, "now they live, newborn, each its own process; Ctrl-C ends it")
            merged, lived_s = _live(options, folder, console, stop, wake)
        _print(console, say_what_evolved(display.matings))
        _print(console, say_who_mated(merged, lived_s))
        _print(console, say_where(folder, merged is not None))
        _print_figure(console, folder / EVOLVED, stop)
    return EXIT_OK


def _evolve(
    options: DemoOptions,
    results: RunFolder,
    colony: InProcessColony,
    display: EvolutionDisplay,
    stop: ShutdownSignal,
) -> None:
    """Evolve for the given time, from the first control period on."""
    try:
        with display.show():
            with stop.interruptible(), compile_progress(display.show_compiling, run_ticks):
                colony.compile()
            stop.end_after(options.minutes)
            begun_s = time.monotonic()

            def left_s() -> float:
                return begun_s + options.seconds - time.monotonic()

            def is_enough() -> bool:
                is_slow = colony.generation < _MIN_GENERATIONS
                return stop() or left_s() < -is_slow * _MOST_TIMES_LONGER * options.seconds

            def show(colony: InProcessColony) -> None:
                display.show_progress(colony, left_s())

            run_until_done(results, colony, is_enough, show)
            display.show_end(colony)
    finally:
        results.close()


def _live(
    options: DemoOptions,
    folder: Path,
    console: Console,
    stop: ShutdownSignal,
    wake: threading.Event,
) -> tuple[MergedHistory | None, float]:
    """Let the robots that evolved live as processes until stopped; return their history, and for how long (s).

    The history is None if it cannot be read.
    """
    config = options.live_config
    earlier = read_earlier_run(folder / EVOLVED)
    beginning = earlier.beginning(config)
    _print(console, earlier.describe(config.robots, config.life.agents))
    has_dashboard = options.has_dashboard and importlib.util.find_spec("rerun") is not None
    if options.has_dashboard and not has_dashboard:
        _print(console, "without a dashboard: pip install 'crcolony[viz]' adds it")
    with open_colony_folder(folder / LIVE, "launch", config, beginning) as live_folder:
        launch = LaunchOptions(
            config=config,
            count=config.robots,
            folder=live_folder.path,
            colony="colony",
            arena="arena",
            network=None,
            wall_period_s=1.0 / options.hz,
            robots_only=False,
            minutes=None,
            has_dashboard=has_dashboard,
        )
        with ForkServer() as server:
            outcome = run_processes(console, launch, live_folder, server, stop, wake)
        try:
            return write_results(live_folder.path, config).merged, outcome.lived_s
        except StorageError as error:
            _print(console, str(error))
            return None, outcome.lived_s


def _print_figure(console: Console, folder: Path, stop: ShutdownSignal) -> None:
    """Draw the figure of the evolution, and print its path; a further signal leaves it out."""
    line = f"no figure was drawn: crcolony plot {shlex.quote(str(folder))} draws it"
    with stop.interruptible():
        try:
            if not stop.is_urgent:
                line = f"figure: {draw_generations_of(folder)}"
        except PlotError as error:
            line = f"no figure: {error}"
    _print(console, line)


def _print(console: Console, line: str) -> None:
    console.print(line, soft_wrap=True)
