"""Injects faults into a simulated colony: crashes, pauses, partitions, clogged links, full disks and wrong clocks."""

from collections import Counter
from collections.abc import Callable
from functools import partial
from random import Random

from crcolony.fault_simulation.faults import Faults
from crcolony.fault_simulation.simulated_arena import SimulatedArena
from crcolony.fault_simulation.simulated_network import ARENA, Link, Schedule, SimulatedNetwork
from crcolony.fault_simulation.simulated_robot import SimulatedRobot

_MEAN_PERIOD_S = 1.5
"""Mean time between two faults."""


class FaultInjector:
    """Injects one fault after another, each for a while."""

    def __init__(
        self,
        schedule: Schedule,
        network: SimulatedNetwork,
        robots: list[SimulatedRobot],
        arena: SimulatedArena,
        faults: Faults,
        rng: Random,
    ) -> None:
        self.counts: Counter[str] = Counter()
        """Faults by kind"""
        self._schedule, self._network, self._rng = schedule, network, rng
        self._robots, self._arena = robots, arena
        kinds: dict[str, Callable[[], None]] = {
            "kills": self._kill,
            "stops": self._stop,
            "pauses": self._pause,
            "partitions": self._partition,
            "clogs": self._clog,
            "full_disks": self._fill_disk,
            "clock_jumps": self._set_clock,
            "arena_restarts": self._restart_arena,
        }
        self._kinds = {name: kind for name, kind in kinds.items() if getattr(faults, name)}

    def inject(self) -> None:
        """Inject one fault, and schedule the next."""
        if self._network.is_fault_free or not self._kinds:
            return
        name = self._rng.choice(list(self._kinds))
        self.counts[name.replace("_", " ")] += 1
        self._kinds[name]()
        self._schedule.after(self._rng.expovariate(1.0 / _MEAN_PERIOD_S), self.inject)

    def _later(self, action: Callable[[], None]) -> None:
        """Schedule the end of a fault; some last longer than partners wait for each other."""
        is_long = self._rng.random() < 0.2
        self._schedule.after(self._rng.uniform(*((4.0, 9.0) if is_long else (0.3, 4.0))), action)

    def _random_robot(self) -> SimulatedRobot:
        return self._rng.choice(self._robots)

    def _kill(self) -> None:
        self._random_robot().crash(closes_links=self._rng.random() < 0.5)

    def _stop(self) -> None:
        self._random_robot().stop()

    def _pause(self) -> None:
        robot = self._random_robot()
        if robot.robot is not None and not robot.is_paused:
            robot.is_paused = True
            self._later(robot.resume)

    def _partition(self) -> None:
        """Cut all links between two halves of the colony, or only those of one direction."""
        if self._network.cut:
            return
        endpoints = [*(robot.id for robot in self._robots), ARENA]
        self._rng.shuffle(endpoints)
        half = self._rng.randrange(1, len(endpoints))
        is_one_way = self._rng.random() < 0.4
        for one in endpoints[:half]:
            for other in endpoints[half:]:
                self._network.cut.add((one, other))
                if not is_one_way:
                    self._network.cut.add((other, one))
        self._later(self._network.cut.clear)

    def _clog(self) -> None:
        ends = self._rng.sample([*(robot.id for robot in self._robots), ARENA], 2)
        link: Link = (ends[0], ends[1])
        self._network.clog(link)
        self._later(partial(self._network.unclog, link))

    def _fill_disk(self) -> None:
        disk = self._random_robot().disk
        disk.fill()
        self._later(disk.clear)

    def _set_clock(self) -> None:
        self._random_robot().clock_error_s = self._rng.choice(
            [self._rng.gauss(0.0, 1e5), self._rng.gauss(0.0, 10.0), -1.9e9, 1e9]
        )

    def _restart_arena(self) -> None:
        self._arena.crash(closes_links=self._rng.random() < 0.7)
        self._later(self._arena.start)
