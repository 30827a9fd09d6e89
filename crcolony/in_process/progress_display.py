"""Shows the progress of a run: a live display in a terminal, plain lines elsewhere."""

import shutil
import sys
import time
from collections import deque
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.table import Table

from crcolony.errors import EXIT_OK
from crcolony.in_process.colony import InProcessColony
from crcolony.in_process.run import is_finished, run_until_done
from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import PlotError
from crcolony.results.run_folder import RunFolder
from crcolony.shutdown import ShutdownSignal

_REFRESH_S = 0.25
"""Time between two refreshes of the live display."""
_PLAIN_LINE_S = 5.0
"""Time between two plain lines."""
_SPEED_POINTS = 12
"""The shown speed is the mean over so many refreshes."""


def run_in_terminal(results: RunFolder, colony: InProcessColony, minutes: float | None) -> int:
    """Run a colony and show its progress until it is finished, Ctrl-C, or the time is over; return the exit code."""
    console = Console(markup=False, highlight=False)
    stop = ShutdownSignal(minutes)
    display = ProgressDisplay(colony)
    config = colony.config
    length = f"{config.generations} generations" if config.generations else "until Ctrl-C"
    console.print(
        f"{config.robots} robots, {length}, {config.selection} selection, seed {config.seed},"
        f" into {results.folder}",
        soft_wrap=True,
    )
    try:
        if console.is_terminal:
            with Live(display.table(), console=console, refresh_per_second=4) as live:
                is_over = run_until_done(results, colony, stop, lambda _: display.refresh(live))
                live.update(display.table())
        else:
            is_over = run_until_done(results, colony, stop, lambda _: display.print_line())
    finally:
        results.close()
    _print_end(console, results, colony, is_over)
    return EXIT_OK


def _print_end(
    console: Console, results: RunFolder, colony: InProcessColony, is_over: bool
) -> None:
    if colony.generation > 0:
        try:
            draw_plots(results.folder)
            console.print(f"plots: {results.folder / 'plots'}", soft_wrap=True)
        except PlotError as error:
            console.print(str(error), soft_wrap=True)
    if not is_over:
        console.print(
            f"stopped in generation {colony.generation};"
            f" resume with: {_command()} evolve --resume --out {results.folder}",
            soft_wrap=True,
        )
    console.print(f"history hash: {results.hash}")
    sys.stdout.flush()


def _command() -> str:
    """Return the command that starts this program as it was started now."""
    path = Path(sys.argv[0])
    if path.name != "crcolony":
        return "python -m crcolony"
    return path.name if shutil.which(path.name) == str(path) else str(path)


class ProgressDisplay:
    """The display of a running colony."""

    def __init__(self, colony: InProcessColony) -> None:
        self._colony = colony
        self._printed_at_s = -1.0
        self._printed_generation = -1
        self._ticks = deque([(time.monotonic(), colony.tick)], maxlen=_SPEED_POINTS)

    def refresh(self, live: Live) -> None:
        """Refresh the live display if it is due."""
        if self._note_progress():
            live.update(self.table())

    def print_line(self) -> None:
        """Print a plain line about the last generation: for the first, the last, and every few seconds."""
        self._note_progress()
        now_s, colony, row = time.monotonic(), self._colony, self._colony.summary
        is_last = is_finished(colony)
        is_due = (
            now_s - self._printed_at_s >= _PLAIN_LINE_S or is_last or self._printed_generation < 0
        )
        if row and is_due and colony.generation > self._printed_generation:
            self._printed_at_s, self._printed_generation = now_s, colony.generation
            print(
                f"generation {colony.generation}: matings {row['matings']:.2f},"
                f" batteries {row['captures']:.2f}, energy {row['energy']:.2f},"
                f" {self._speed() / 1e6:.2f} million robot-steps/s",
                flush=True,
            )

    def table(self) -> Table:
        """Return the present state as a table."""
        colony, row = self._colony, self._colony.summary
        energies = colony.batch.energies[range(len(colony.robots)), colony.batch.agent]
        table = Table(box=None, show_header=False, pad_edge=False)
        table.add_column(style="bold")
        table.add_column()
        last = f" of {colony.config.generations}" if colony.config.generations else ""
        table.add_row("generation", f"{colony.generation}{last}")
        if row:
            table.add_row("matings", f"{row['matings']:.2f} per agent, last generation")
            table.add_row("batteries", f"{row['captures']:.2f} per agent")
            table.add_row(
                "energy", f"{row['energy']:.2f} while alive; {row['starved']:.0%} of agents starved"
            )
        table.add_row("energy now", _format_bars(energies[:8].tolist()))
        table.add_row("speed", f"{self._speed() / 1e6:.2f} million robot-steps/s")
        return table

    def _note_progress(self) -> bool:
        """Record time and tick if a refresh is due, and return whether it is."""
        now_s = time.monotonic()
        is_due = not self._ticks or now_s - self._ticks[-1][0] >= _REFRESH_S
        if is_due:
            self._ticks.append((now_s, self._colony.tick))
        return is_due

    def _speed(self) -> float:
        """Return robot-steps per second over the last few seconds."""
        since_s, since_tick = self._ticks[0]
        ran = (self._colony.tick - since_tick) * self._colony.config.robots
        return ran / max(time.monotonic() - since_s, 1e-9)


def _format_bars(energies: list[float]) -> str:
    return "  ".join(f"{'█' * round(8 * energy):░<8}" for energy in energies)
