"""Shows the progress of a run: a live display in a terminal, plain lines elsewhere."""

import contextlib
import shlex
import shutil
import sys
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.table import Table

from crcolony.compile_progress import compile_progress
from crcolony.errors import EXIT_OK
from crcolony.in_process.colony import InProcessColony, run_ticks
from crcolony.in_process.run import is_finished, run_until_done
from crcolony.results.run_folder import RunFolder
from crcolony.results.run_report import print_plots
from crcolony.shutdown import ShutdownSignal
from crcolony.terminal import plain_console

_REFRESH_S = 0.25
"""Time between two refreshes of the live display."""
_PLAIN_LINE_S = 5.0
"""Time between two plain lines."""
_LABEL_WIDTH = 12
"""Columns of the names of the rows."""
_BAR_WIDTH = 10
"""Columns of the bar of an energy."""
_SPEED_POINTS = 12
"""The shown speed is the mean over so many refreshes."""


def run_in_terminal(
    results: RunFolder, colony: InProcessColony, minutes: float | None, has_plots: bool
) -> int:
    """Run a colony and show its progress until it is finished, Ctrl-C, or the time is over; return the exit code.

    Its figures are drawn at the end if `has_plots`.
    """
    console = plain_console()
    stop = ShutdownSignal()
    display = ProgressDisplay(colony)
    config = colony.config
    length = f"{config.generations} generations" if config.generations else "until Ctrl-C"
    console.print(
        f"{config.robots} robots, {length}, {config.selection} selection, seed {config.seed},"
        f" into {results.folder}",
        soft_wrap=True,
    )
    if is_finished(colony):
        console.print("it is finished; a larger --generations goes on with it", soft_wrap=True)
    try:
        with stop.interruptible(), shown_compiling(console):
            colony.compile()
        stop.end_after(minutes)
        if console.is_terminal:
            with Live(display.table(console.width), console=console, refresh_per_second=4) as live:
                is_over = run_until_done(results, colony, stop, lambda _: display.refresh(live))
                live.update(display.table(console.width))
        else:
            is_over = run_until_done(results, colony, stop, lambda _: display.print_line())
    finally:
        results.close()
    if colony.generation > 0 and has_plots:
        print_plots(console, results.folder, stop)
    _print_end(console, results, colony, is_over)
    return EXIT_OK


@contextlib.contextmanager
def shown_compiling(console: Console) -> Iterator[None]:
    """Show inside the context how far the compiler is: nothing if all is compiled already."""
    with Live(console=console, auto_refresh=False, transient=True) as live:

        def show(done: int, total: int) -> None:
            if console.is_terminal:
                live.update(
                    f"compiling, which is done once: {done / max(total, 1):.0%}", refresh=True
                )
            elif done == 0:
                print("compiling, which is done once and takes about a minute", flush=True)

        with compile_progress(show, run_ticks):
            yield


def _print_end(
    console: Console,
    results: RunFolder,
    colony: InProcessColony,
    is_over: bool,
) -> None:
    if not is_over:
        console.print(
            f"stopped in generation {colony.generation};"
            f" resume with: {_command()} evolve --resume --out {shlex.quote(str(results.folder))}",
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
        self._ticks: deque[tuple[float, int]] = deque(maxlen=_SPEED_POINTS)

    def refresh(self, live: Live) -> None:
        """Refresh the live display if it is due."""
        if self._note_progress():
            live.update(self.table(live.console.width))

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
                f" {self._speed() / 1e6:.2f} million robot-steps/s{self._format_rest(', ')}",
                flush=True,
            )

    def table(self, width: int) -> Table:
        """Return the present state as a table; `width` are the columns of the terminal."""
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
        bars = max(1, (width - _LABEL_WIDTH) // _BAR_WIDTH)
        table.add_row("energy now", _format_bars(energies[: min(bars, 8)].tolist()))
        table.add_row(
            "speed", f"{self._speed() / 1e6:.2f} million robot-steps/s{self._format_rest('; ')}"
        )
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
        if not self._ticks:  # nothing has run yet; the first ticks may wait for the compiler
            return 0.0
        since_s, since_tick = self._ticks[0]
        ran = (self._colony.tick - since_tick) * self._colony.config.robots
        return ran / max(time.monotonic() - since_s, 1e-9)

    def _format_rest(self, separator: str) -> str:
        """Return when the run will have ended, at the present speed; "" if it has no end, or no speed yet."""
        config, life, speed = self._colony.config, self._colony.config.life, self._speed()
        ticks = config.generations * life.agents * life.slices * life.slice_steps
        rest = (ticks - self._colony.tick) * config.robots
        if rest <= 0 or speed <= 0.0:
            return ""
        return f"{separator}{format_end(rest / speed, time.time())}"


def format_end(rest_s: float, unix_s: float) -> str:
    """Return how long something takes from now on, and when it will have ended, as text."""
    minutes, seconds = divmod(round(rest_s), 60)
    if minutes < 1:
        return f"{seconds} s left"
    if minutes < 60:
        return f"{minutes} min {seconds} s left"
    day = "" if minutes < 24 * 60 else "%d %b "
    ends = time.strftime(f"{day}%H:%M", time.localtime(unix_s + rest_s))
    return f"{minutes // 60} h {minutes % 60} min left, ends {ends}"


def _format_bars(energies: list[float]) -> str:
    return "  ".join(f"{'█' * round(8 * energy):░<8}" for energy in energies)
