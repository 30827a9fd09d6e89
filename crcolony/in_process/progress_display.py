"""A run as a person sees it in the terminal: a live display, or plain lines where the output is no terminal."""

import shutil
import sys
import time
from collections import deque
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.table import Table

from crcolony.in_process.colony import InProcessColony
from crcolony.in_process.run import is_finished, run_until_done
from crcolony.results.plots import draw_plots
from crcolony.results.plots.conditions import PlotError
from crcolony.results.run_folder import RunFolder
from crcolony.shutdown import ShutdownSignal

_REFRESH_S = 0.25
_PLAIN_LINE_S = 5.0
_SPEED_POINTS = 12
"""Looks at the clock that the shown speed covers."""


def run_in_terminal(results: RunFolder, colony: InProcessColony, minutes: float | None) -> int:
    """Run a colony with a display until it is done, Ctrl-C, or the time is over; return the exit code."""
    console = Console()
    stop = ShutdownSignal(minutes)
    monitor = ProgressDisplay(colony)
    config = colony.config
    length = f"{config.generations} generations" if config.generations else "until Ctrl-C"
    console.print(
        f"{config.robots} robots, {length}, {config.selection} selection, seed {config.seed},"
        f" into {results.folder}",
        highlight=False,
        soft_wrap=True,
    )
    try:
        if console.is_terminal:
            with Live(monitor.display(), console=console, refresh_per_second=4) as live:
                is_over = run_until_done(results, colony, stop, lambda _: monitor.refresh(live))
                live.update(monitor.display())
        else:
            is_over = run_until_done(results, colony, stop, lambda _: monitor.print_line())
    finally:
        results.close()
    _finish(console, results, colony, is_over)
    return 0


def _finish(console: Console, results: RunFolder, colony: InProcessColony, is_over: bool) -> None:
    if colony.generation > 0:
        try:
            draw_plots(results.folder)
            console.print(f"plots: {results.folder / 'plots'}", highlight=False)
        except PlotError as error:
            console.print(str(error), highlight=False)
    if not is_over:
        console.print(
            f"stopped in generation {colony.generation};"
            f" go on with: {_command()} evolve --resume --out {results.folder}",
            highlight=False,
            soft_wrap=True,
        )
    console.print(f"history hash: {results.hash}", highlight=False)
    sys.stdout.flush()


def _command() -> str:
    """Return how to call this program again as it was called now."""
    path = Path(sys.argv[0])
    if path.name != "crcolony":
        return "python -m crcolony"
    return path.name if shutil.which(path.name) == str(path) else str(path)


class ProgressDisplay:
    """What is shown of a running colony."""

    def __init__(self, colony: InProcessColony) -> None:
        self._colony = colony
        self._said_at_s = -1.0
        self._published = -1
        self._passed = deque([(time.monotonic(), colony.tick)], maxlen=_SPEED_POINTS)

    def refresh(self, live: Live) -> None:
        """Refresh the live display, now and then."""
        if self._look_at_the_clock():
            live.update(self.display())

    def print_line(self) -> None:
        """Print a plain line about the last generation: the first, the last, and one now and then."""
        self._look_at_the_clock()
        now_s, colony, row = time.monotonic(), self._colony, self._colony.summary
        is_last = is_finished(colony)
        is_due = now_s - self._said_at_s >= _PLAIN_LINE_S or is_last or self._published < 0
        if row and is_due and colony.generation > self._published:
            self._said_at_s, self._published = now_s, colony.generation
            print(
                f"generation {colony.generation}: matings {row['matings']:.2f},"
                f" batteries {row['captures']:.2f}, energy {row['energy']:.2f},"
                f" {self._speed() / 1e6:.2f} million robot-steps/s",
                flush=True,
            )

    def display(self) -> Table:
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
        table.add_row("energy now", _bars(energies[:8].tolist()))
        table.add_row("speed", f"{self._speed() / 1e6:.2f} million robot-steps/s")
        return table

    def _look_at_the_clock(self) -> bool:
        """Note how far the colony is; return whether it is time for a refresh."""
        now_s = time.monotonic()
        is_time = not self._passed or now_s - self._passed[-1][0] >= _REFRESH_S
        if is_time:
            self._passed.append((now_s, self._colony.tick))
        return is_time

    def _speed(self) -> float:
        """Return robot-steps a second over the last few seconds."""
        since_s, since_tick = self._passed[0]
        ran = (self._colony.tick - since_tick) * self._colony.config.robots
        return ran / max(time.monotonic() - since_s, 1e-9)


def _bars(energies: list[float]) -> str:
    return "  ".join(f"{'█' * round(8 * energy):░<8}" for energy in energies)
