"""Shows what evolves, as it evolves: matings an agent by generation, as a line of bars."""

import contextlib
import time
from collections.abc import Iterator, Sequence

import numpy as np
from rich.console import Console
from rich.live import Live

from crcolony.in_process.colony import InProcessColony

_BARS = "▁▂▃▄▅▆▇█"
_MAX_BARS = 40
_REFRESH_S = 0.25
"""Time between two refreshes in a terminal."""
_LINE_S = 5.0
"""Time between two lines elsewhere."""
LAST_GENERATIONS = 5
"""What has evolved is the mean over so many last generations."""


class EvolutionDisplay:
    """One line that changes in a terminal, and plain lines elsewhere; inside the context `show`."""

    def __init__(self, console: Console) -> None:
        self.matings: list[float] = []
        """Per agent, in every generation that has ended"""
        self._console = console
        self._live: Live | None = None
        self._due_s = 0.0

    @contextlib.contextmanager
    def show(self) -> Iterator[None]:
        """Show inside the context what is reported; the last line stays."""
        if not self._console.is_terminal:
            yield
            return
        with Live(console=self._console, refresh_per_second=4) as self._live:
            yield

    def show_compiling(self, done: int, total: int) -> None:
        """Show how many functions are compiled."""
        self._show(f"compiling, which is done once: {done / max(total, 1):.0%}", done == total)

    def show_progress(self, colony: InProcessColony, left_s: float) -> None:
        """Show how far the evolution of a colony is, with `left_s` to go."""
        is_next = colony.generation > len(self.matings)
        if is_next:
            self.matings.append(colony.summary["matings"])
        text = f"generation {colony.generation}: {format_matings(self.matings)}"
        self._show(f"{text}  {max(left_s, 0.0):.0f} s to go", is_next and len(self.matings) == 1)

    def show_end(self, colony: InProcessColony) -> None:
        """Show what has evolved."""
        self._show(f"generation {colony.generation}: {format_matings(self.matings)}", True)

    def _show(self, text: str, is_important: bool) -> None:
        now_s = time.monotonic()
        if not is_important and now_s < self._due_s:
            return
        if self._live is not None:
            self._due_s = now_s + _REFRESH_S
            self._live.update(text, refresh=True)  # the compiler leaves other threads no time
        else:
            self._due_s = now_s + _LINE_S
            self._console.print(text, soft_wrap=True)


def format_matings(matings: Sequence[float]) -> str:
    """Return the matings an agent in the first and in the last generations, and bars of all between."""
    if not matings:
        return "no generation has ended yet"
    return f"matings an agent {matings[0]:.1f} → {evolved(matings):.1f}  {sparkline(matings)}"


def evolved(matings: Sequence[float]) -> float:
    """Return the mean over the last generations."""
    return float(np.mean(matings[-LAST_GENERATIONS:]))


def sparkline(values: Sequence[float], width: int = _MAX_BARS) -> str:
    """Return a bar for each value from 0 to the highest, or for the mean of several if there are more than `width`."""
    parts = np.array_split(np.asarray(values, dtype=float), min(len(values), width))
    means = [float(part.mean()) for part in parts]
    highest = max(means) or 1.0
    return "".join(_BARS[round((len(_BARS) - 1) * mean / highest)] for mean in means)
