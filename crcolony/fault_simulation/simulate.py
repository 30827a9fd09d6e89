"""Deterministic simulation testing: whole colonies in one thread and in virtual time, with faults injected by seed.

As FoundationDB's and TigerBeetle's: the code under test is what real processes run (`EmbodiedRobot`, `BodyServer` and
all below them, real signatures, SQLite files, the compiled world); only clock, network and disks are simulated. A seed
determines everything, so that every failure can be repeated. The faults end after a while; the colony then runs without
them, then the arena stops, and after that no encounter may be open.
"""

import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from crcolony.config import Config, load
from crcolony.evolution.genotype import Schema
from crcolony.evolution.history import Mated
from crcolony.fault_simulation.fault_injector import FaultInjector
from crcolony.fault_simulation.faults import Faults, Forger, draw_faults
from crcolony.fault_simulation.final_audit import audit_colony
from crcolony.fault_simulation.invariants import InvariantChecker, format_robot
from crcolony.fault_simulation.simulated_arena import SimulatedArena
from crcolony.fault_simulation.simulated_network import (
    NoProgressError,
    Schedule,
    SimulatedNetwork,
)
from crcolony.fault_simulation.simulated_robot import COLONY, SharedContext, SimulatedRobot
from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.identity import seeded
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.storage.files import FolderError

FAULTY_S = 36.0
"""The first part of a simulation, in virtual time: faults are injected."""
FAULT_FREE_S = 6.0
"""The second part: the colony runs without faults."""
SETTLING_S = 12.0
"""The third part: the arena has stopped, and open encounters come to an end."""

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
"""Crowded, well fed and short-lived: matings and turnovers are frequent. What is learnt does not matter here."""


@dataclass(frozen=True)
class Report:
    """The result of one simulated colony."""

    seed: int
    robots: int
    faults: Faults
    matings: int = 0
    """Matings that both sides have recorded"""
    one_sided: int = 0
    """Matings that only one side has recorded"""
    conceptions: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    """Outcomes of encounters, refused envelopes, and faults, by name"""
    history: str = ""
    """The hash of the colony's history"""
    log: str = ""
    """The hash of everything that was published or sent"""
    violations: list[str] = field(default_factory=list)
    """Invariants that did not hold"""

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
    """Simulate one colony with the faults of a seed, or with given ones, for `faulty_s` of virtual time.

    The same arguments give the same report. Raises ConfigError for less than one robot.
    """
    rng = Random(seed)
    drawn = draw_faults(rng)
    with _temporary_folder() as folder:
        return _Simulation(seed, robots, faults or drawn, rng, Path(folder)).run(faulty_s)


def _temporary_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a folder that is deleted after its use, in memory if that can be written."""
    try:
        return tempfile.TemporaryDirectory(dir="/dev/shm")
    except OSError:
        pass
    try:
        return tempfile.TemporaryDirectory()
    except OSError as error:
        raise FolderError(f"no folder for temporary files: {error.strerror}") from None


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
        self._injector = FaultInjector(
            schedule, self._network, self._robots, self._arena, faults, rng
        )

    def run(self, faulty_s: float) -> Report:
        """Run the three parts of the simulation, and audit the colony."""
        schedule = self._schedule
        self._arena.start()
        for robot in self._robots:
            schedule.after(self._rng.uniform(0.0, 0.5), robot.start)
        schedule.after(0.0, self._injector.inject)
        try:
            schedule.run_until(faulty_s)
            self._end_faults()
            schedule.run_until(faulty_s + FAULT_FREE_S)
            for robot in self._robots:
                self._checker.require(
                    robot.is_operating, f"{format_robot(robot.id)}: does not operate without faults"
                )
            self._arena.close()
            schedule.run_until(faulty_s + FAULT_FREE_S + SETTLING_S)
        except NoProgressError as error:
            self._checker.report(f"no progress: {error}")
            self._end_faults()
        return self._report()

    def _end_faults(self) -> None:
        self._network.end_faults()
        self._arena.start()
        for robot in self._robots:
            robot.end_faults()

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
