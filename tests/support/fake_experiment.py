"""An experiment of no time: a number for each condition and seed, and claims about it."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from crcolony.experiments.framework.experiment import (
    Column,
    Experiment,
    Job,
    Measured,
    Plan,
    Row,
    pairs_of,
    verdict_of,
)
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.pools.worker_pool import WorkerPool

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REGISTRATION = """
summary = "Numbers against larger numbers"
source = "nobody"
seeds = 4

[[claim]]
id = "larger"
claim = "The treated are larger."
thesis = "They are larger."
quantity = "Difference of means"
test = "Above the threshold"
threshold = 0.5
seeds = 4
"""


def number(condition: str, seed: int) -> Row:
    return {"number": seed + (1.5 if condition == "treated" else 0.0), "word": f"{condition}!"}


def slow_number(folder: Path, condition: str, seed: int) -> Row:
    """Write a file when it begins; go on when a file `go` is there."""
    (folder / f"{condition}-{seed}").write_text(str(os.getpid()))
    while not (folder / "go").exists():
        time.sleep(0.01)
    return number(condition, seed)


def treated_wait(folder: Path, condition: str, seed: int) -> Row:
    """Let one condition finish at once, and the other wait."""
    return (
        slow_number(folder, condition, seed) if condition == "treated" else number(condition, seed)
    )


def _larger(claim: Claim, rows: Sequence[Row]) -> Measured:
    treated, control = pairs_of(rows, "number", "treated", "control")
    difference = float((treated - control).mean())
    return Measured(
        estimate=difference,
        statistic="by eye",
        p=0.01,
        effect="d",
        effect_size=difference,
        runs=2 * treated.size,
        verdict=verdict_of(difference > claim.threshold),
    )


def _draw(rows: Sequence[Row]) -> "Figure":
    from matplotlib.figure import Figure

    figure = Figure(figsize=(1.0, 1.0))
    figure.subplots().plot([row["number"] for row in rows])
    return figure


def fake_experiment(run: Callable[[str, int], Row] = number, name: str = "fake") -> Experiment:
    def jobs(plan: Plan) -> list[Job]:
        return [
            Job(condition, seed, partial(run, condition, seed))
            for seed in plan.seeds
            for condition in ("control", "treated")
        ]

    columns = {"number": Column("a number", "m"), "word": Column("a word")}
    return Experiment(name, columns, jobs, {"larger": _larger}, _draw)


class HereAndNow(Executor):
    """Runs a job in this process when it is submitted."""

    def submit(self, function: Any, /, *args: Any, **_: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*args))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def here_and_now(jobs: int, is_stopped: Callable[[], bool]) -> Iterator[WorkerPool]:
    """Provide one worker: this process."""
    yield WorkerPool(HereAndNow(), 1)
