"""Deterministic simulation: whole colonies in one thread and in virtual time, with everything going wrong by seed.

As FoundationDB's and TigerBeetle's: what runs is what robots and arenas run (`embodied_robot.py`, `reception.py` and
all below them, real signatures, SQLite files, the compiled world); only clock, network and disks are simulated. A seed
decides everything, so every failure can be repeated. The faults end after a while, then the colony lives in peace, then
the world stands still, and after that nothing may be left open.
"""

import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random

from crcolony.config import Config, load
from crcolony.evolution.genotype import Schema
from crcolony.evolution.history import Mated
from crcolony.fault_simulation.faults import Faults, Forger, draw_faults
from crcolony.fault_simulation.final_audit import audit_colony
from crcolony.fault_simulation.invariants import InvariantChecker, short
from crcolony.fault_simulation.simulated_arena import SimulatedArena
from crcolony.fault_simulation.simulated_network import (
    ARENA,
    Link,
    Schedule,
    SimulatedNetwork,
    TimeStandsStillError,
)
from crcolony.fault_simulation.simulated_robot import COLONY, SharedContext, SimulatedRobot
from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.identity import seeded
from crcolony.robot.factory import make_robots, numbered_streams

FAULTY_S, PEACEFUL_S, SETTLING_S = 36.0, 6.0, 12.0
"""The three parts of a simulation, in virtual time"""
_BETWEEN_FAULTS_S = 1.5

_SETTINGS = (
    "life.agents=4",
    "life.slices=2",
    "life.slice_steps=8",
    "life.initial_energy=1.0",
    "life.refractory_steps=2",
    "arena.area_per_robot_m2=0.2",
    "body.encounter_range_m=2.0",
    "body.encounter_half_angle_rad=2.5",
    "learning.tilings=1",
    "learning.distance_tiles=2",
    "learning.bearing_tiles=2",
    "learning.potential_distances=2",
    "learning.potential_bearings=2",
)
"""Crowded, well fed and short-lived: matings and turnovers all the time. What is learnt does not matter here."""


@dataclass(frozen=True)
class Report:
    """What happened in one simulated colony."""

    seed: int
    robots: int
    faults: Faults
    matings: int = 0
    """That both sides have"""
    one_sided: int = 0
    conceptions: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    """Outcomes of encounters, letters that were not believed, and what went wrong, by name"""
    history: str = ""
    """The hash of the colony's history"""
    log: str = ""
    """The hash of everything that was said"""
    violations: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        counts = ", ".join(
            f"{count} {name}" for name, count in sorted(self.counts.items()) if count
        )
        lines = [
            f"seed {self.seed}: {self.matings} matings, {self.conceptions} conceptions; {counts}",
            f"  faults: {self.faults or 'none'}",
            *(f"  VIOLATION {text}" for text in self.violations),
        ]
        if self.violations and self.faults == draw_faults(Random(self.seed)):
            command = f"crcolony simulate --seeds 1 --seed {self.seed} --robots {self.robots}"
            lines.append(f"  repeat it with: {command}")
        return "\n".join(lines)


def simulate(
    seed: int, robots: int = 5, faults: Faults | None = None, faulty_s: float = FAULTY_S
) -> Report:
    """Let one colony live through the faults of a seed, or through given ones, for so long in virtual time.

    The same arguments are the same colony. Raises ConfigError for less than one robot.
    """
    rng = Random(seed)
    drawn = draw_faults(rng)
    shared = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=shared if shared.is_dir() else None) as folder:
        return _Simulation(seed, robots, faults or drawn, rng, Path(folder)).run(faulty_s)


class _Simulation:
    def __init__(self, seed: int, robots: int, faults: Faults, rng: Random, folder: Path) -> None:
        self._seed, self._faults, self._rng = seed, faults, rng
        self._mutates = rng.random() < 0.3
        config = load(
            None,
            [
                *_SETTINGS,
                f"seed={seed}",
                f"robots={robots}",
                f"heredity.mutation_probability={0.1 if self._mutates else 0.0}",
            ],
        )
        limits = MatingLimits(orphan_s=3.0, max_retry_s=1.0, open=rng.choice([2, 256]))
        identities = [seeded(COLONY, seed, number) for number in range(robots)]
        self._schedule = schedule = Schedule()
        forger = Forger(rng, _schema(config), {key.id: key for key in identities})
        self._network = SimulatedNetwork(schedule, rng, faults, forger.forge)
        self._checker = InvariantChecker(robots, limits)
        context = SharedContext(
            config, limits, faults, folder, schedule, self._network, self._checker, rng
        )
        self._robots = [SimulatedRobot(k, key, context) for k, key in enumerate(identities)]
        self._arena = SimulatedArena(config, schedule, self._network, rng)
        self._injector = _FaultInjector(
            schedule, self._network, self._robots, self._arena, faults, rng
        )

    def run(self, faulty_s: float) -> Report:
        """Live through all of it."""
        schedule = self._schedule
        self._arena.start()
        for robot in self._robots:
            schedule.after(self._rng.uniform(0.0, 0.5), robot.start)
        schedule.after(0.0, self._injector.act)
        try:
            schedule.run_until(faulty_s)
            self._make_peace()
            schedule.run_until(faulty_s + PEACEFUL_S)
            for robot in self._robots:
                self._checker.demand(robot.is_living, f"{short(robot.id)}: does not live in peace")
            self._arena.close()
            schedule.run_until(faulty_s + PEACEFUL_S + SETTLING_S)
        except TimeStandsStillError as error:
            self._checker.complain(f"time stands still: {error}")
            self._make_peace()
        return self._report()

    def _make_peace(self) -> None:
        self._network.calm_down()
        self._arena.start()
        for robot in self._robots:
            robot.be_spared()

    def _report(self) -> Report:
        checker = self._checker
        merged = audit_colony(self._robots, checker, self._mutates)
        matings = [event for event in merged.events if isinstance(event, Mated)]
        return Report(
            self._seed,
            len(self._robots),
            self._faults,
            len(matings),
            len(merged.one_sided),
            sum(mated.conceived + mated.partner_conceived for mated in matings),
            checker.counts + self._network.counts + self._injector.counts,
            str(merged.hash),
            checker.hash,
            checker.violations,
        )


def _schema(config: Config) -> Schema:
    _, _, (robot,) = make_robots(config, ["0"], numbered_streams(0, 0, 1))
    return robot.subpopulation.schema


class _FaultInjector:
    """Makes things go wrong, one after the other, each for a while."""

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
        self._schedule, self._network, self._rng = schedule, network, rng
        self._robots, self._arena = robots, arena
        kinds: dict[str, Callable[[], None]] = {
            "kills": self._kill,
            "stops": self._stop,
            "pauses": self._pause,
            "partitions": self._partition,
            "clogs": self._clog,
            "full_disks": self._fill,
            "clock_jumps": self._turn_clock,
            "arena_restarts": self._restart_arena,
        }
        self._kinds = {name: kind for name, kind in kinds.items() if getattr(faults, name)}

    def act(self) -> None:
        """Let one thing go wrong, and another later."""
        if self._network.is_calm or not self._kinds:
            return
        name = self._rng.choice(list(self._kinds))
        self.counts[name.replace("_", " ")] += 1
        self._kinds[name]()
        self._schedule.after(self._rng.expovariate(1.0 / _BETWEEN_FAULTS_S), self.act)

    def _later(self, do: Callable[[], None]) -> None:
        """Nothing comes and goes faster than this, and some things take longer than partners wait for each other."""
        is_long = self._rng.random() < 0.2
        self._schedule.after(self._rng.uniform(*((4.0, 9.0) if is_long else (0.3, 4.0))), do)

    def _any(self) -> SimulatedRobot:
        return self._rng.choice(self._robots)

    def _kill(self) -> None:
        self._any().crash(says_goodbye=self._rng.random() < 0.5)

    def _stop(self) -> None:
        self._any().stop()

    def _pause(self) -> None:
        robot = self._any()
        if robot.robot is not None and not robot.is_paused:
            robot.is_paused = True
            self._later(robot.resume)

    def _partition(self) -> None:
        """Cut the colony in two, or only what goes from the one half to the other."""
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

    def _fill(self) -> None:
        disk = self._any().disk
        disk.fill()
        self._later(disk.clear)

    def _turn_clock(self) -> None:
        self._any().clock_error_s = self._rng.choice(
            [self._rng.gauss(0.0, 1e5), self._rng.gauss(0.0, 10.0), -1.9e9, 1e9]
        )

    def _restart_arena(self) -> None:
        self._arena.crash(says_goodbye=self._rng.random() < 0.7)
        self._later(self._arena.start)
