"""Shows how far an experiment is, and when it will have ended: a bar in a terminal, plain lines elsewhere."""

import contextlib
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from crcolony.experiments.framework.experiment_folder import JobKey
from crcolony.in_process.progress_display import format_end

_LINE_S = 5.0
"""Time between two plain lines."""


class JobProgress:
    """Counts jobs as they finish; `clock` gives seconds, from any beginning."""

    def __init__(
        self,
        console: Console,
        total: int,
        done: int = 0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.total = total
        self.done = done
        """Of them, those that were finished before are not timed"""
        self._console = console
        self._before = done
        self._clock = clock
        self._start_s = clock()
        self._due_s = self._start_s
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[end]}"),
            console=console,
        )
        self._task = self._bar.add_task("runs", total=total, completed=done, end="")

    @contextlib.contextmanager
    def show(self) -> Iterator[None]:
        """Show the bar inside the context, in a terminal."""
        if not self._console.is_terminal:
            yield
            return
        with self._bar:
            yield

    def add(self, key: JobKey) -> None:
        """Show that a job is finished."""
        self.done += 1
        end = self._format_end()
        if self._console.is_terminal:
            self._bar.update(self._task, completed=self.done, end=end)
        elif self._clock() >= self._due_s or self.done == self.total:
            self._due_s = self._clock() + _LINE_S
            condition, seed = key
            self._console.print(
                f"{self.done} of {self.total}: {condition}, seed {seed}{end and f'; {end}'}",
                soft_wrap=True,
            )

    def _format_end(self) -> str:
        """Return when all will have finished, at the pace of those that have finished since the start."""
        passed_s = self._clock() - self._start_s
        rest = self.total - self.done
        return format_end(rest * passed_s / (self.done - self._before), time.time()) if rest else ""
