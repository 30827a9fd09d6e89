"""Turns the telemetry of colonies into metrics: a collector of prometheus-client that any of its outputs can ask."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from crcolony.protocol.encounters import Outcome
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import EncounterOutcome
from crcolony.telemetry.colony_monitor import ColonyMonitor
from crcolony.telemetry.status_changes import EventReceived, StatusChange
from crcolony_deploy.exported_series import MAX_ARENAS, MAX_ROBOTS, ExportedSeries
from crcolony_deploy.metric_families import (
    Exported,
    families_of_arenas,
    families_of_exporter,
    families_of_robots,
)


class MetricsExporter(Collector):
    """The metrics of what a monitor knows; with `expected` robots, of those alone, online or not.

    `handle_changes` and `collect` may be called from several threads, all else of the monitor only inside `lock`.
    """

    def __init__(
        self,
        monitor: ColonyMonitor,
        expected: Iterable[RobotId] | None = None,
        dropped: Callable[[], int] = lambda: 0,
        problems: Callable[[], Sequence[str]] = lambda: (),
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.lock = threading.RLock()
        """Held while the monitor is read or written"""
        self._monitor, self._dropped, self._problems = monitor, dropped, problems
        self._clock = clock
        self._robots = ExportedSeries[RobotId](
            MAX_ROBOTS, lambda robot: robot.hex()[:8], sorted(expected) if expected else None
        )
        self._arenas = ExportedSeries[str](MAX_ARENAS, lambda name: name)
        self._colonies: dict[RobotId, str] = {}
        self._encounters: dict[RobotId, Counter[Outcome]] = {}

    def handle_changes(self, changes: Iterable[StatusChange]) -> None:
        """Count what has happened, for robots that have series."""
        with self.lock:
            self._update()
            for change in changes:
                if not isinstance(change, EventReceived):
                    continue
                event, robot = change.message.event, change.message.robot
                if isinstance(event, EncounterOutcome) and robot in self._colonies:
                    self._encounters.setdefault(robot, Counter())[event.outcome] += 1

    def collect(self) -> Iterable[Metric]:
        """Return all families, as they are now."""
        with self.lock:
            self._update()
            exported = Exported(
                self._robots.labels, self._arenas.labels, self._colonies, self._encounters
            )
            omitted = len(self._robots.omitted) + len(self._arenas.omitted)
            now_s, monitor = self._clock(), self._monitor
            return [
                *families_of_robots(monitor, exported, now_s),
                *families_of_arenas(monitor, exported, now_s),
                *families_of_exporter(monitor, self._dropped(), omitted, len(self._problems())),
            ]

    def describe(self) -> Iterable[Metric]:
        """Return nothing: a registry need not collect to learn the names."""
        return []

    def _update(self) -> None:
        monitor, now_s = self._monitor, self._clock()
        self._robots.update([s.robot for s in monitor.robots.values() if s.is_alive], now_s)
        self._arenas.update([a.name for a in monitor.arenas.values() if a.is_alive], now_s)
        labels = self._robots.labels
        for robot in labels.keys() - self._colonies.keys():
            status = monitor.robots.get(robot)
            if status is not None and status.is_alive:
                self._colonies[robot] = status.colony
        for robot in self._colonies.keys() - labels.keys():
            del self._colonies[robot]
            self._encounters.pop(robot, None)
