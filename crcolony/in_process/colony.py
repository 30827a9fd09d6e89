"""An in-process colony: arena and robots in one process, as fast as possible, with the same history on every run.

A tick applies the robots' actions, advances the world by one control period, lets all robots observe, and steps all
robots. Ticks run in compiled code until a robot has an event. Events are then handled here, in the order of the robots:
first deaths and matings, then hand-overs to the next agent, then turnovers.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray, compiled
from crcolony.config import Config
from crcolony.evolution.founders import Founders
from crcolony.evolution.history import Died, Event, Mated, TurnedOver, birth_event
from crcolony.evolution.lineage import Birth
from crcolony.in_process.central_schemes import make_central_scheme
from crcolony.results.generation_summary import summarise_robots
from crcolony.robot.factory import make_robots, numbered_streams
from crcolony.robot.life_records import lifetimes_of
from crcolony.robot.robot import Robot
from crcolony.robot.state import DIED, MET, SLICE_OVER, Robots, StepParameters
from crcolony.robot.step import step_robots
from crcolony.world.arena import Arena
from crcolony.world.state import World
from crcolony.world.tick import integrate, observe, set_action


@compiled
def tick(world: World, robots: Robots, parameters: StepParameters, actions: FloatArray) -> int:
    """Run one control period for all robots; return the bits of all events."""
    for i in range(actions.shape[0]):
        set_action(world, i, actions[i])
    integrate(world)
    observe(world)
    due = world.observations.shape[0] - 1
    return step_robots(robots, parameters, world.observations[due], actions)


@compiled
def run_ticks(
    world: World, robots: Robots, parameters: StepParameters, actions: FloatArray, most: int
) -> int:
    """Run ticks until a robot has an event, at most `most`; return the number of ticks run."""
    for count in range(most):
        if tick(world, robots, parameters, actions) != 0:
            return count + 1
    return most


class InProcessColony:
    """Robots in an arena, in this process. `on_event` is called with every event of the history, in order.

    The robots begin with `founders`; None: with random genotypes.
    """

    def __init__(
        self,
        config: Config,
        on_event: Callable[[Event], None],
        founders: Founders | None = None,
    ) -> None:
        self.config = config
        self.tick = 0
        self.generation = 0
        self.arena = Arena(config.robots, config.arena, config.body, config.seed)
        self.batch, self.parameters, self.robots = make_robots(
            config,
            [str(row) for row in range(config.robots)],
            numbered_streams(config.seed, 0, config.robots),
            founders,
        )
        self.schema = self.robots[0].subpopulation.schema
        self.actions = np.zeros((config.robots, contract.ACTION_WIDTH))
        self._central = make_central_scheme(config, self.schema)
        self.summary: dict[str, float] = {}
        """The row of the generation that ended last, as `summarise_robots` returns it"""
        self._record = on_event

    def start(self) -> None:
        """Give every robot its first generation."""
        for robot in self.robots:
            self._report_births(robot.row, robot.start())

    def compile(self) -> None:
        """Compile the control step if that has not been done yet, which takes about a minute; nothing else changes."""
        run_ticks(self.arena.world, self.batch, self.parameters, self.actions, 0)

    def run(self, most_ticks: int) -> None:
        """Run `most_ticks` ticks, or until a generation ends, whichever is first."""
        end, generation = self.tick + most_ticks, self.generation
        while self.tick < end and self.generation == generation:
            ran = run_ticks(
                self.arena.world, self.batch, self.parameters, self.actions, end - self.tick
            )
            self.tick += ran
            events = self.batch.events
            if events.any():
                self._handle_events(events)

    def _handle_events(self, events: np.ndarray) -> None:
        for row in np.flatnonzero(events & DIED):
            ids = self.robots[row].subpopulation.ids
            self._record(Died(self.tick, int(row), ids[self.robots[row].agent]))
        if (events & MET).any():
            self._mate(np.flatnonzero(events & MET))
        if (events & SLICE_OVER).any():
            waiting = [
                self.robots[row]
                for row in np.flatnonzero(events & SLICE_OVER)
                if not self.robots[row].hand_over()
            ]
            if waiting:
                self._turn_over(waiting)

    def _mate(self, rows: np.ndarray) -> None:
        """Let every pair that met exchange what they send; each side makes of it what it wants."""
        observations = self.arena.world.observations[-1]
        partners = observations[:, contract.ENCOUNTER_ROBOT].astype(int)
        for row in rows:
            other = partners[row]
            if other < row:
                continue
            one, two = self.robots[row], self.robots[other]
            offered, received = one.mating_offer(), two.mating_offer()
            own_offspring, partner_offspring = one.mate(received), two.mate(offered)
            self._record(
                Mated(
                    tick=self.tick,
                    robot=int(row),
                    partner_robot=int(other),
                    agent=offered.agent,
                    partner=received.agent,
                    energy=one.energy,
                    partner_energy=two.energy,
                    conceived=own_offspring is not None,
                    partner_conceived=partner_offspring is not None,
                )
            )

    def _turn_over(self, waiting: list[Robot]) -> None:
        self.summary = summarise_robots(self.generation, self.tick, self.batch, self.robots)
        for robot in waiting:
            pool = len(robot.subpopulation.pool)
            self._record(TurnedOver(self.tick, robot.row, robot.generation + 1, pool))
            for lifetime in lifetimes_of(robot, self.batch, self.tick, robot.row):
                self._record(lifetime)
        if self._central is None:
            births = [robot.turn_over() for robot in waiting]
        else:
            births = self._central.turn_over(waiting, self.batch)
        for robot, newborns in zip(waiting, births, strict=True):
            self._report_births(robot.row, newborns)
        self.generation = min(robot.generation for robot in self.robots)

    def save(self) -> dict[str, Any]:
        """Return a copy of the colony's whole state; a colony that restores it continues identically."""
        return {
            "tick": self.tick,
            "generation": self.generation,
            "arena": self.arena.save(),
            "robots": [robot.save() for robot in self.robots],
            "actions": self.actions.copy(),
            "central": self._central.save() if self._central else None,
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore the state of a colony with the same config; raises ValueError if it does not fit."""
        if len(saved["robots"]) != len(self.robots):
            raise ValueError("the saved colony has another number of robots")
        self.tick, self.generation = saved["tick"], saved["generation"]
        self.arena.restore(saved["arena"])
        for robot, state in zip(self.robots, saved["robots"], strict=True):
            robot.restore(state)
        self.actions[...] = saved["actions"]
        if self._central is not None:
            self._central.restore(saved["central"])

    def _report_births(self, row: int, births: list[Birth]) -> None:
        for agent, birth in enumerate(births):
            self._record(birth_event(self.tick, row, birth, self.batch.genotypes[row, agent]))
