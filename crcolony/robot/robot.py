"""A robot: a controller that virtual agents share in time (Papers II and III; thesis 4.5, 5.3).

`Robot.step` is the control step. What is rare is here in plain Python: the hand-over to the next
agent, a mating, and the turnover of a generation. No I/O and no clock: a robot counts control steps
and nothing else.
"""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from crcolony.body import contract
from crcolony.body.shared_pages import (
    ACTION_AT,
    NOTHING,
    OBSERVATION_AT,
    ROW_AFTER,
    Page,
    new_page,
)
from crcolony.compiled import FloatArray
from crcolony.evolution.lineage import Birth
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.evolution.reproduction import MatingAgent, MatingOffer, ReproductionStrategy
from crcolony.evolution.time_sharing import TimeSharing
from crcolony.randomness import EventGenerator, Stream
from crcolony.robot.aot_step import PagedStep, load_step
from crcolony.robot.settings import Life
from crcolony.robot.state import ADDED, SCRATCH, Robots, StepParameters, with_present_names
from crcolony.robot.weight_rows import (
    BLOCKS,
    SAVED_APART,
    forget,
    restore_weights,
    save_weights,
    with_rows,
)

_OBSERVATION = slice(
    OBSERVATION_AT + ROW_AFTER, OBSERVATION_AT + ROW_AFTER + contract.OBSERVATION_WIDTH
)
_ACTION = slice(ACTION_AT + 1, ACTION_AT + 1 + contract.ACTION_WIDTH)
"""The rows of even ticks on a page"""
_SAVED = tuple(name for name in Robots._fields if name not in (*SCRATCH, *SAVED_APART, *BLOCKS))


class Robot:
    """One row of a batch of robots: the only one in a robot's own process, one of many in an
    in-process colony."""

    def __init__(
        self,
        robots: Robots,
        row: int,
        parameters: StepParameters,
        life: Life,
        subpopulation: Subpopulation,
        time_sharing: TimeSharing,
        reproduction: ReproductionStrategy,
    ) -> None:
        self.row = row
        self.generation = 0
        self.subpopulation = subpopulation
        self._robots = robots
        self._parameters = parameters
        self._life = life
        self._time_sharing = time_sharing
        self._reproduction = reproduction
        self._rare_events = EventGenerator()
        self._own: tuple[Page, PagedStep] | None = None
        """The step on a page of its own; the robots of an in-process colony need none"""
        self._shared: tuple[Page, PagedStep] | None = None

    @property
    def agent(self) -> int:
        """The index, in the subpopulation, of the agent in control."""
        return int(self._robots.agent[self.row])

    @property
    def steps(self) -> int:
        """The number of control steps since the robot's first start."""
        return int(self._robots.steps[self.row])

    @property
    def energy(self) -> float:
        """The energy of the agent in control."""
        return float(self._robots.energies[self.row, self.agent])

    @property
    def events(self) -> int:
        """What happened in the last step, as the event bits of `state.py`."""
        return int(self._robots.events[self.row])

    @property
    def stream(self) -> Stream:
        """The state of the robot's random number generator, shape (2,): every draw changes it."""
        stream: Stream = self._robots.streams[self.row]
        return stream

    def set_parameters(self, parameters: StepParameters) -> None:
        """Step with other parameters from now on, as in another body: the same modules and actions,
        other senses."""
        self._parameters, self._own, self._shared = parameters, None, None

    def set_reproduction(self, reproduction: ReproductionStrategy) -> None:
        """Reproduce in another way from now on: one that is no setting, of which nothing is known yet."""
        self._reproduction = reproduction

    def start(self) -> list[Birth]:
        """Create the first generation and give control to its first agent; return the births."""
        agents = self.subpopulation.draw_first_generation(self._rare_events.begin(self.stream))
        births = self.subpopulation.replace_agents(agents, 0, self.steps)
        self._reset_agents()
        self.hand_over()
        return births

    def step(self, observation: FloatArray) -> FloatArray:
        """Do one control step: from an observation (OBSERVATION_WIDTH,) to an action
        (ACTION_WIDTH,).

        The returned array is overwritten by the next step. Afterwards `events` shows what else has
        to be done: `mating_offer` and `mate` after an encounter, then `hand_over` when the slice is
        over.
        """
        if self._own is None:
            page = new_page()
            self._own = page, load_step(self._robots, self._parameters, page)
        page, step = self._own
        page.numbers[_OBSERVATION] = observation
        step(self.row, NOTHING)
        return page.numbers[_ACTION]

    def step_on(self, page: Page) -> Callable[[int], int]:
        """Return the function that steps on a page of shared memory, for a tick; see `step_page`."""
        if self._shared is None or self._shared[0] is not page:
            self._shared = page, load_step(self._robots, self._parameters, page)
        return functools.partial(self._shared[1], self.row)

    def mating_offer(self) -> MatingOffer:
        """Return what this robot gives to its partner in a mating."""
        return self._reproduction.offer(self._mating_agent(self.agent), self.stream)

    def mate(self, partner: MatingOffer, agent: int | None = None) -> Offspring | None:
        """Let an agent make use of what the partner gave; return the offspring if it conceives one.

        The agent is the one in control, unless the index of another is given: the one that met the
        partner.
        """
        own = self._mating_agent(self.agent if agent is None else agent)
        return self._reproduction.receive(own, partner, self.stream)

    def _mating_agent(self, agent: int) -> MatingAgent:
        robots, row = self._robots, self.row
        return MatingAgent(
            self.subpopulation,
            agent,
            energy=float(robots.energies[row, agent]),
            matings=int(robots.matings[row, agent]),
            step=self.steps,
        )

    def hand_over(self) -> bool:
        """Give control to the next agent; return False if every agent has had its slices: time for
        a turnover."""
        robots, row = self._robots, self.row
        following = self._time_sharing.next_agent(
            self.subpopulation.turns, self._performance(), self._rare_events.begin(self.stream)
        )
        if following is None:
            return False
        self.subpopulation.turns[following] += 1
        robots.agent[row] = following
        robots.slice_steps_left[row] = self._life.slice_steps
        robots.module[row] = -1
        return True

    def turn_over(self, agents: Sequence[NewAgent] | None = None) -> list[Birth]:
        """Start the next generation with the agents of the own strategy, or with given ones; return
        the births."""
        self.generation += 1
        if agents is None:
            matings = self._robots.matings[self.row]
            rng = self._rare_events.begin(self.stream)
            agents = self._reproduction.next_agents(self.subpopulation, matings, rng)
        births = self.subpopulation.replace_agents(agents, self.generation, self.steps)
        self._reset_agents()
        self.hand_over()
        return births

    def _reset_agents(self) -> None:
        """Set every agent to the initial energy, with nothing learnt and nothing counted."""
        robots, row = self._robots, self.row
        robots.energies[row] = self._life.initial_energy
        for field in (
            robots.module_steps,
            robots.captures,
            robots.matings,
            robots.mating_energy_sum,
            robots.steps_alive,
            robots.energy_sum,
        ):
            field[row] = 0
        forget(robots, row)

    def _performance(self) -> FloatArray:
        """Return every agent's matings per step alive, which informed ways of time sharing use.

        It is -1 of a dead one, however good it was: with control of the robot it could do nothing.
        """
        robots, row = self._robots, self.row
        rates = robots.matings[row] / np.maximum(robots.steps_alive[row], 1)
        performance: FloatArray = np.where(robots.energies[row] > 0.0, rates, -1.0)
        return performance

    def save(self) -> dict[str, Any]:
        """Return all there is of the robot, as copies: arrays by field, its subpopulation, and its
        counters."""
        robots, row = self._robots, self.row
        arrays = {name: np.array(getattr(robots, name)[row]) for name in _SAVED}
        saved = {
            "arrays": arrays | save_weights(robots, row),
            "subpopulation": self.subpopulation.save(),
            "generation": self.generation,
        }
        memory = self._reproduction.save()
        return saved | {"reproduction": memory} if memory else saved

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Become a saved robot of the same settings, also one that an earlier version saved.

        Raises ValueError if a field does not fit.
        """
        arrays = with_rows(with_present_names(saved["arrays"]), self._parameters.initial_weight)
        restore_weights(self._robots, self.row, arrays)
        for name in _SAVED:
            field = getattr(self._robots, name)
            if name in ADDED and name not in arrays:
                field[self.row] = 0
                continue
            if name not in arrays or np.shape(arrays[name]) != field.shape[1:]:
                raise ValueError(f"the saved robot does not fit these settings: {name}")
            field[self.row] = arrays[name]
        self.subpopulation.restore(saved["subpopulation"])
        self._reproduction.restore(saved.get("reproduction", {}))
        self.generation = saved["generation"]
