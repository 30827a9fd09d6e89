"""Colonies in one process whose matings fail: by a lossy network and killed processes, or at random.

World, learning and evolution are those of `in_process/colony.py`. In a `FaultyColony` an encounter does no more than to
start the real protocol at both robots (`mating_process.py`), whose messages take their time and get lost while all live
on. A robot that is killed stands still, dark and deaf, until it starts again from its last snapshot: what its agents
have learnt since is lost, and its generation ends later. That peers come and go is noticed at once. Observations and
actions are never lost, since a robot has its own link to its body.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from random import Random

import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray, IntArray
from crcolony.config import Config
from crcolony.evolution.history import Event
from crcolony.experiments.colonies.mating_process import MatingProcess
from crcolony.fault_simulation.simulated_network import DELAY_S, Schedule
from crcolony.in_process.colony import InProcessColony, run_ticks
from crcolony.protocol.encounters import EncounterRecord
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import MatingMessage
from crcolony.robot.modules import MATING, MODULES
from crcolony.robot.robot import Robot
from crcolony.storage.rows import Decision

SNAPSHOT_S = 10.0
"""Between two snapshots of a robot, as by default."""
DOWN_S = 5.0
"""From a kill until the robot runs again: a supervisor waits 2 s, and a process needs some to start."""
_HOUR_S = 3600.0


@dataclass(frozen=True)
class FaultRates:
    """How often what fails."""

    loss: float = 0.0
    """Share of messages between robots that get lost, each by itself"""
    kills_per_h: float = 0.0
    """Mean number of times in an hour that each robot's process is killed, at any moment"""


@dataclass(frozen=True, eq=False)
class Generation:
    """A generation of one robot that has ended: sums over its agents where nothing else is said."""

    generation: int
    genotypes: FloatArray
    """(agents, genes)"""
    matings: int
    mating_energy: float
    """The robot's energy summed over encounters"""
    captures: int
    starved: int
    steps: int
    energy: float
    """Summed over the steps"""
    mating_steps: int
    """Steps in the mating module"""
    conceptions: int


class RecordingColony(InProcessColony):
    """A colony that keeps what every robot did in a generation, also where robots do not end it at the same time."""

    def __init__(self, config: Config, on_event: Callable[[Event], None]) -> None:
        super().__init__(config, on_event)
        self.ended: list[Generation] = []
        self.encounters = 0
        """Pairs of robots that have met"""

    def _turn_over(self, waiting: list[Robot]) -> None:
        self.ended += [self._generation_of(robot) for robot in waiting]
        super()._turn_over(waiting)

    def _generation_of(self, robot: Robot) -> Generation:
        batch, row = self.batch, robot.row
        return Generation(
            robot.generation,
            batch.genotypes[row].copy(),
            int(batch.matings[row].sum()),
            float(batch.mating_energy_sum[row].sum()),
            int(batch.captures[row].sum()),
            int((batch.energies[row] <= 0.0).sum()),
            int(batch.steps_alive[row].sum()),
            float(batch.energy_sum[row].sum()),
            int(batch.module_steps[row, :, MODULES.index(MATING)].sum()),
            robot.subpopulation.conceived,
        )


class RandomLossColony(RecordingColony):
    """A colony in which a share of the encounters, drawn at random, leads to nothing in either robot."""

    def __init__(self, config: Config, on_event: Callable[[Event], None], share: float) -> None:
        super().__init__(config, on_event)
        self._share, self._rng = share, Random(config.seed)
        self.failed = 0

    def _mate(self, rows: IntArray) -> None:
        partners = self.arena.world.observations[-1][:, contract.ENCOUNTER_ROBOT].astype(int)
        lost: set[int] = set()
        for row in rows.tolist():
            if row < partners[row]:
                self.encounters += 1
                if self._rng.random() < self._share:
                    self.failed += 1
                    lost |= {row, int(partners[row])}
        super()._mate(np.array([row for row in rows.tolist() if row not in lost], dtype=np.int64))


class FaultyColony(RecordingColony):
    """A colony that mates by the protocol, over a network and in processes that fail by the seed of its config."""

    def __init__(
        self, config: Config, on_event: Callable[[Event], None], rates: FaultRates
    ) -> None:
        super().__init__(config, on_event)
        self.messages = self.kills = 0
        self.decided = self.too_late = 0
        """Sides of encounters that became matings, and those of them whose agents had died with their generation"""
        self.waited_s = 0.0
        """From encounters to these, in all"""
        self._rates, self._rng, self._schedule = rates, Random(config.seed), Schedule()
        self._processes = [
            MatingProcess(robot, self.batch, self._schedule, self._post, self._on_decided)
            for robot in self.robots
        ]
        self._by_id = {process.id: process for process in self._processes}
        self._period_s = config.arena.control_period_s

    def start(self) -> None:
        """Give every robot its first generation, and start its process."""
        super().start()
        for row in range(len(self.robots)):
            self._start_process(row)

    def run(self, most_ticks: int) -> None:
        """Run `most_ticks` ticks, or until all have ended a generation, whichever is first."""
        end, generation = self.tick + most_ticks, self.generation
        schedule, period_s = self._schedule, self._period_s
        while self.tick < end and self.generation == generation:
            schedule.run_until((self.tick + 1) * period_s)
            busy_s = min(schedule.next_s, (end + 1) * period_s)
            most = max(math.ceil(busy_s / period_s) - 1 - self.tick, 1)
            self.tick += run_ticks(
                self.arena.world, self.batch, self.parameters, self.actions, most
            )
            schedule.run_until(self.tick * period_s)
            for row, process in enumerate(self._processes):
                if not process.is_running:
                    self.batch.events[row] = 0
            if self.batch.events.any():
                self._handle_events(self.batch.events)

    def _mate(self, rows: IntArray) -> None:
        observations = self.arena.world.observations[-1]
        for row in rows.tolist():
            partner = int(observations[row, contract.ENCOUNTER_ROBOT])
            nonce = int(observations[row, contract.ENCOUNTER_NONCE])
            self.encounters += row < partner
            self._processes[row].handle_contact(self._processes[partner].id, nonce, self.tick)

    def _turn_over(self, waiting: list[Robot]) -> None:
        super()._turn_over(waiting)
        for robot in waiting:
            self._processes[robot.row].save()

    # The network -----------------------------------------------------------------------------------------------

    def _post(self, to: RobotId, message: MatingMessage) -> None:
        self.messages += 1
        if self._rng.random() >= self._rates.loss:
            delay_s = self._rng.expovariate(1.0 / DELAY_S)
            self._schedule.after(delay_s, partial(self._by_id[to].handle_message, message))

    def _on_decided(self, record: EncounterRecord, decision: Decision) -> None:
        self.decided += 1
        self.too_late += decision.too_late
        self.waited_s += self._schedule.now_s - record.tick * self._period_s

    # Kills -----------------------------------------------------------------------------------------------------

    def _start_process(self, row: int) -> None:
        """Start a process, and plan its end: of its regular snapshots only the last before that is made."""
        own = self._processes[row]
        own.start()
        for other in self._processes:
            if other is not own:
                other.handle_peer_online(own.id)
                if other.is_running:
                    own.handle_peer_online(other.id)
        if self._rates.kills_per_h == 0.0:
            return
        life_s = self._rng.expovariate(self._rates.kills_per_h / _HOUR_S)
        if life_s >= SNAPSHOT_S:
            self._schedule.after(life_s // SNAPSHOT_S * SNAPSHOT_S, own.save)
        self._schedule.after(life_s, partial(self._kill, row))

    def _kill(self, row: int) -> None:
        """Kill a process: its agent in control is as one without energy, until the snapshot is restored."""
        self.kills += 1
        own = self._processes[row]
        own.kill()
        self.batch.energies[row, self.robots[row].agent] = 0.0
        self.actions[row] = 0.0
        for other in self._processes:
            other.handle_peer_offline(own.id)
        self._schedule.after(DOWN_S, partial(self._start_process, row))
