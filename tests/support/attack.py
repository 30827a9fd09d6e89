"""A colony of four robots in real time, calm and under attack: how it mates, keeps its control period, and grows."""

import contextlib
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.key_expressions import ArenaKeys
from crcolony.transport.zenoh_session import NetworkSettings, open_session
from tests.support.process import Process
from tests.support.process_colony import Colony, View, colony, settle

HZ, ROBOTS = 20.0, 4
MIB = 2**20
ENDS = ("mated", "refused", "expired", "aborted", "orphaned", "storage")
"""Of encounters; one that was in doubt for a while ends as one of these, too."""


@dataclass(frozen=True)
class Figures:
    """What a while of a colony's life was like."""

    matings_per_s: float
    """How often robots meet is chance, and depends on who lives: compare it over long whiles only"""
    mated_share: float
    """Of the encounters that came to an end, as each robot counts them"""
    period_ms: tuple[float, float]
    """Median and 99th percentile, over all robots"""
    grown_mib: float
    """How much the largest of the processes has grown"""


class Siege:
    """A colony, and whoever attacks it."""

    def __init__(self, made: Colony, view: View, session: zenoh.Session, folder: Path) -> None:
        self.made, self.view, self._folder = made, view, folder
        self._actions: defaultdict[str, list[float]] = defaultdict(list)
        self._subscriber = session.declare_subscriber(
            ArenaKeys("arena").all_actions, Callback(self._on_action, indirect=False)
        )

    def _on_action(self, sample: zenoh.Sample) -> None:
        self._actions[str(sample.key_expr)].append(time.monotonic())

    def monitor(self, seconds: float) -> Figures:
        """Let the colony live for a while, and tell what it was like."""
        before, size, begun_s = self.made.outcomes(), self._sizes(), time.monotonic()
        time.sleep(seconds)
        took_s = time.monotonic() - begun_s
        periods = np.concatenate(
            [
                np.diff([at_s for at_s in times if at_s >= begun_s])
                for times in self._actions.values()
            ]
        )
        half, most = np.quantile(1000.0 * periods, (0.5, 0.99)) if periods.size else (np.inf,) * 2
        grown = max(then - now for now, then in zip(size, self._sizes(), strict=True))
        became = self.made.outcomes() - before
        ended = sum(became[how] for how in ENDS)
        return Figures(
            matings_per_s=became["mated"] / 2.0 / took_s,
            mated_share=became["mated"] / ended if ended else 0.0,
            period_ms=(float(half), float(most)),
            grown_mib=grown / MIB,
        )

    def _sizes(self) -> list[int]:
        return [psutil.Process(process.pid).memory_info().rss for process in self.honest]

    @property
    def honest(self) -> list[Process]:
        """The arena and the robots."""
        return self.made.processes[: 1 + ROBOTS]

    @contextlib.contextmanager
    def attacked(self, attack: str) -> Iterator[Process]:
        """Let a hostile peer attack."""
        robots = [robot.id.hex() for robot in self.made.robots]
        words = [
            "-m",
            "tests.support.hostile_peer",
            attack,
            "--connect",
            self.made.endpoint,
            *robots,
        ]
        hostile = Process([sys.executable, *words], self._folder / f"{attack}.log").start()
        try:
            hostile.wait_for("attacking")
            yield hostile
            assert hostile.is_running, hostile.said
        finally:
            if hostile.is_running:
                hostile.kill()


@contextlib.contextmanager
def siege(folder: Path) -> Iterator[Siege]:
    """A colony that has settled, and is gone when this is left."""
    with colony(folder) as made:
        made.arena(ROBOTS, "--hz", f"{HZ:g}")
        for _ in range(ROBOTS):
            made.robot("--snapshot", "5")
        view = made.observer()
        settle(made, view)
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            yield Siege(made, view, session, folder)
