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

from crcolony.colony.keys import ArenaKeys
from crcolony.colony.network import Network, open_session
from tests.system.colony import Colony, Process, View, colony, settle

HZ, ROBOTS = 20.0, 4
MIB = 2**20


@dataclass(frozen=True)
class Figures:
    """What a while of a colony's life was like."""

    matings_per_s: float
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

    def watch(self, seconds: float) -> Figures:
        """Let the colony live for a while, and tell what it was like."""
        mated, size, begun_s = self._mated(), self._sizes(), time.monotonic()
        time.sleep(seconds)
        took_s = time.monotonic() - begun_s
        periods = np.concatenate(
            [
                np.diff([at_s for at_s in times if at_s >= begun_s])
                for times in self._actions.values()
            ]
        )
        half, most = np.quantile(1000.0 * periods, (0.5, 0.99)) if periods.size else (np.inf,) * 2
        grown = max(after - before for before, after in zip(size, self._sizes(), strict=True))
        return Figures((self._mated() - mated) / took_s, (float(half), float(most)), grown / MIB)

    def _mated(self) -> float:
        """Return matings as the robots' own logs tell them: nothing on the network is believed."""
        return sum(robot.said.count("mated with") for robot in self.made.robots) / 2.0

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
        words = ["-m", "tests.system.hostile", attack, "--connect", self.made.endpoint, *robots]
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
        with open_session(Network(connect=(made.endpoint,))) as session:
            yield Siege(made, view, session, folder)
