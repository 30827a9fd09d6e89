"""A run as a person sees it in the terminal: a live display, or plain lines where the output is no terminal."""

import signal
import sys
import time
from types import FrameType

from rich.console import Console
from rich.live import Live
from rich.table import Table

from crcolony.colony.embedded import EmbeddedColony
from crcolony.colony.evolve import evolve
from crcolony.colony.plots import PlotsError, draw_plots
from crcolony.colony.results import Results

_REFRESH_S = 0.25
_PLAIN_LINE_S = 5.0


def run_in_terminal(results: Results, colony: EmbeddedColony, minutes: float | None) -> int:
    """Run a colony with a display until it is done, Ctrl-C, or the time is over; return the exit code."""
    console = Console()
    stop = _Stop(minutes)
    watch = Watch(colony, results.hash)
    console.print(
        f"{colony.config.robots} robots, {colony.config.generations} generations,"
        f" {colony.config.selection} selection, seed {colony.config.seed}, into {results.folder}",
        highlight=False,
    )
    if console.is_terminal:
        with Live(watch.display(), console=console, refresh_per_second=4) as live:
            is_done = evolve(results, colony, stop, lambda _: watch.show(live))
            live.update(watch.display())
    else:
        is_done = evolve(results, colony, stop, lambda _: watch.say())
    results.close()
    _finish(console, results, colony, is_done)
    return 0


def _finish(console: Console, results: Results, colony: EmbeddedColony, is_done: bool) -> None:
    if colony.generation > 0:
        try:
            draw_plots(results.folder)
            console.print(f"plots: {results.folder / 'plots'}", highlight=False)
        except PlotsError as error:
            console.print(str(error), highlight=False)
    if not is_done:
        console.print(
            f"stopped in generation {colony.generation};"
            f" go on with: crcolony evolve --resume --out {results.folder}",
            highlight=False,
            soft_wrap=True,
        )
    console.print(f"history hash: {results.hash}", highlight=False)
    sys.stdout.flush()


class _Stop:
    """Tells whether to stop: after Ctrl-C (or SIGTERM), or when the time is over."""

    def __init__(self, minutes: float | None) -> None:
        self._deadline_s = time.monotonic() + 60.0 * minutes if minutes else None
        self._asked = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)

    def _ask(self, number: int, _frame: FrameType | None) -> None:
        self._asked = True
        signal.signal(number, signal.default_int_handler)

    def __call__(self) -> bool:
        if self._deadline_s is not None and time.monotonic() > self._deadline_s:
            return True
        return self._asked


class Watch:
    """What is shown of a running colony."""

    def __init__(self, colony: EmbeddedColony, history_hash: object) -> None:
        self._colony = colony
        self._hash = history_hash
        self._shown_at_s = self._began_s = time.monotonic()
        self._began_tick = colony.tick
        self._told = -1

    def show(self, live: Live) -> None:
        """Refresh the live display, now and then."""
        now = time.monotonic()
        if now - self._shown_at_s >= _REFRESH_S:
            self._shown_at_s = now
            live.update(self.display())

    def say(self) -> None:
        """Print a plain line about the last generation, now and then."""
        now, colony = time.monotonic(), self._colony
        is_last = colony.generation == colony.config.generations
        is_due = now - self._shown_at_s >= _PLAIN_LINE_S or is_last or self._told < 0
        if colony.generation > max(self._told, 0) and is_due:
            self._shown_at_s, self._told = now, colony.generation
            row = colony.summary
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
        table.add_row("generation", f"{colony.generation} of {colony.config.generations}")
        if row:
            table.add_row("matings", f"{row['matings']:.2f} per agent, last generation")
            table.add_row("batteries", f"{row['captures']:.2f} per agent")
            table.add_row("starved", f"{row['starved']:.0%} of the agents")
        table.add_row("energy", _bars(energies[:8].tolist()))
        table.add_row("speed", f"{self._speed() / 1e6:.2f} million robot-steps/s")
        return table

    def _speed(self) -> float:
        elapsed_s = max(time.monotonic() - self._began_s, 1e-9)
        return (self._colony.tick - self._began_tick) * self._colony.config.robots / elapsed_s


def _bars(energies: list[float]) -> str:
    return "  ".join(f"{'█' * round(8 * energy):░<8}" for energy in energies)
