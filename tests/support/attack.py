"""A colony of four robots in real time, with and without an attack: its matings, control period, and memory."""

import contextlib
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
import zenoh
from zenoh.handlers import Callback

from crcolony.protocol.key_expressions import ArenaKeys
from crcolony.storage.files import KEY_FILE
from crcolony.transport.close_session import closing
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import open_session
from tests.support.process import Process
from tests.support.process_colony import Colony, View, colony, settle
from tests.support.secured_colony import secured_colony

HZ, ROBOTS = 20.0, 4
MIB = 2**20
ENDS = ("mated", "refused", "expired", "aborted", "orphaned", "storage")
"""Final outcomes of encounters; one that was in doubt for a while has one of these, too."""


@dataclass(frozen=True)
class Figures:
    """Measurements of a colony over some seconds."""

    matings_per_s: float
    """How often robots meet is random, and depends on the agents: compare it over long periods only"""
    mated_share: float
    """Of the encounters with a final outcome, where each robot counts for itself"""
    period_ms: tuple[float, float]
    """Median and 99th percentile, over all robots"""
    grown_mib: float
    """The largest growth in memory of a process"""


class Siege:
    """A colony, and a hostile peer that attacks it."""

    def __init__(
        self,
        made: Colony,
        view: View,
        session: zenoh.Session,
        folder: Path,
        insider: Sequence[Path] = (),
    ) -> None:
        self.made, self.view, self._folder = made, view, folder
        self.session, self.insider = session, insider
        self._actions: defaultdict[str, list[float]] = defaultdict(list)
        self._subscriber = session.declare_subscriber(
            ArenaKeys("arena").all_actions, Callback(self._on_action, indirect=False)
        )

    def _on_action(self, sample: zenoh.Sample) -> None:
        self._actions[str(sample.key_expr)].append(time.monotonic())

    def monitor(self, seconds: float) -> Figures:
        """Measure the colony for some seconds."""
        before, size, started_s = self.made.outcomes(), self._sizes(), time.monotonic()
        time.sleep(seconds)
        took_s = time.monotonic() - started_s
        periods = np.concatenate(
            [
                np.diff([at_s for at_s in times if at_s >= started_s])
                for times in self._actions.values()
            ]
        )
        half, most = np.quantile(1000.0 * periods, (0.5, 0.99)) if periods.size else (np.inf,) * 2
        grown = max(later - earlier for earlier, later in zip(size, self._sizes(), strict=True))
        outcomes = self.made.outcomes() - before
        ended = sum(outcomes[outcome] for outcome in ENDS)
        return Figures(
            matings_per_s=outcomes["mated"] / 2.0 / took_s,
            mated_share=outcomes["mated"] / ended if ended else 0.0,
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
        """Run a hostile peer inside the context, with one attack or several, with commas between them."""
        robots = [robot.id.hex() for robot in self.made.robots]
        arguments = [
            "-m",
            "tests.support.hostile_peer",
            attack,
            "--connect",
            self.made.endpoint,
            *robots,
        ]
        if self.insider:
            arguments += ["--insider", *map(str, self.insider)]
        hostile = Process([sys.executable, *arguments], self._folder / f"{attack}.log").start()
        try:
            hostile.wait_for("attacking")
            yield hostile
            assert hostile.is_running, hostile.output
        finally:
            if hostile.is_running:
                hostile.kill()


@contextlib.contextmanager
def siege(folder: Path) -> Iterator[Siege]:
    """A settled colony, whose processes are killed at the end of the context."""
    with colony(folder) as made:
        made.arena(ROBOTS, "--hz", f"{HZ:g}")
        for _ in range(ROBOTS):
            made.robot("--snapshot", "5", "--no-shared-memory")
        view = made.observer()
        settle(made, view)
        with open_session(NetworkSettings(connect=(made.endpoint,))) as session:
            yield Siege(made, view, session, folder)


@contextlib.contextmanager
def secured_siege(folder: Path) -> Iterator[Siege]:
    """The same of a colony with certificates, whose attacker is a robot of its own, with a certificate."""
    with secured_colony(folder, ROBOTS, HZ) as secured:
        made = secured.made
        key, credentials = secured.deployment.robot("insider")
        spying = secured.insider("router", "spy")
        settle(made, secured.view)
        with closing(secured.open_session(spying)) as session:
            insider = (key / KEY_FILE, credentials, spying)
            yield Siege(made, secured.view, session, folder, insider)
