"""Statistics of a colony's generations, computed from its robots' events: mean and spread over all agents.

Robots turn over one by one. A generation has ended when all robots on the network have left it and reported its
lifetimes, or when half of them have left it and no lifetime of it arrived for a while. Later reports are ignored.
"""

from collections import OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.history import Born, Lived
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Exchanged

PATIENCE_S = 10.0
"""A generation that half of the robots have left ends after so long without a report"""
_MAX_AGENTS = 100_000
"""Limit of the births kept, of the agents whose conceptions are counted, and of the lifetimes of one generation"""
_MAX_GENERATIONS = 16
"""Collected at a time; robots of a colony are seldom two apart"""
_MAX_GENOTYPES = 400
"""Of one generation that are kept to be drawn"""


@dataclass(frozen=True)
class Spread:
    """The distribution of a number over the agents of a generation."""

    mean: float
    sd: float
    low: float
    """10 % quantile"""
    high: float
    """90 % quantile"""


@dataclass(frozen=True)
class Generation:
    """The statistics of a generation that has ended."""

    number: int
    agents: int
    matings: Spread
    captures: Spread
    conceptions: Spread
    energy: Spread
    genotypes: FloatArray
    """(some agents, genes); empty if their births were not received"""
    best: str
    """The agent that mated most; of equals, the one that captured most batteries"""
    best_genes: FloatArray | None


class Generations:
    """Collects the events of one colony's robots, and returns each generation once, when it has ended."""

    def __init__(self) -> None:
        self.last = -1
        """The newest generation that has ended; -1 before the first"""
        self._lifetimes: dict[int, dict[str, Lived]] = {}
        """Of every generation that has not ended, by agent"""
        self._received_s: dict[int, float] = {}
        """When the last lifetime of a generation was received"""
        self._turned_over: dict[int, set[RobotId]] = {}
        """The robots that have reported births of the next generation, hence all lifetimes of this one"""
        self.starts: dict[RobotId, tuple[int, int]] = {}
        """Of every robot its newest generation, and the tick at which that began"""
        self._births: OrderedDict[str, bytes] = OrderedDict()
        self._conceptions: OrderedDict[str, int] = OrderedDict()

    def add_birth(self, robot: RobotId, event: Born) -> None:
        """Add a birth."""
        if event.generation - 1 in self._lifetimes:
            self._turned_over[event.generation - 1].add(robot)
        if event.generation > self.starts.get(robot, (-1, 0))[0]:
            self.starts[robot] = (event.generation, event.tick)
        self._births[event.agent] = event.genes
        if len(self._births) > _MAX_AGENTS:
            self._births.popitem(last=False)

    def add_mating(self, event: Exchanged) -> None:
        """Add one robot's report of a mating."""
        self._conceptions[event.agent] = self._conceptions.get(event.agent, 0) + event.conceived
        if len(self._conceptions) > _MAX_AGENTS:
            self._conceptions.popitem(last=False)

    def add_lifetime(self, event: Lived, unix_s: float) -> None:
        """Add a lifetime that was received at `unix_s`; ignored if its generation has ended."""
        number = event.generation
        if number <= self.last:
            return
        lifetimes = self._lifetimes.setdefault(number, {})
        if len(lifetimes) >= _MAX_AGENTS:
            return
        lifetimes[event.agent] = event
        self._turned_over.setdefault(number, set())
        self._received_s[number] = unix_s
        if len(self._lifetimes) > _MAX_GENERATIONS:
            self._drop(min(self._lifetimes))

    def genes_of(self, agent: str) -> FloatArray | None:
        """Return the genes of an agent, (genes,); None if its birth was not received."""
        genes = self._births.get(agent)
        return None if genes is None else np.frombuffer(genes, dtype="<f8")

    def pop_ended(self, present: Mapping[RobotId, int], unix_s: float) -> list[Generation]:
        """Return the generations that have ended since the last call, in order.

        `present` has the current generation of every robot on the network.
        """
        ended_numbers = [
            number for number in self._lifetimes if self._has_ended(number, present, unix_s)
        ]
        self.last = max(ended_numbers, default=self.last)
        ended = []
        for number in sorted(number for number in self._lifetimes if number <= self.last):
            ended.append(self._statistics(number))
            self._drop(number)
        return ended

    def _has_ended(self, number: int, present: Mapping[RobotId, int], unix_s: float) -> bool:
        left = sum(now > number for now in present.values())
        if left == len(present) > 0 and self._turned_over[number].issuperset(present):
            return True
        return 2 * left >= len(present) and unix_s - self._received_s[number] >= PATIENCE_S

    def _statistics(self, number: int) -> Generation:
        lifetimes = list(self._lifetimes[number].values())
        best = max(
            lifetimes, key=lambda lifetime: (lifetime.matings, lifetime.captures, lifetime.energy)
        )
        known = [
            genes for lifetime in lifetimes if (genes := self.genes_of(lifetime.agent)) is not None
        ]
        known = [genes for genes in known if len(genes) == len(known[0])]
        some = known[:: max(1, -(-len(known) // _MAX_GENOTYPES))]
        return Generation(
            number=number,
            agents=len(lifetimes),
            matings=spread(lifetime.matings for lifetime in lifetimes),
            captures=spread(lifetime.captures for lifetime in lifetimes),
            conceptions=spread(self._conceptions.get(lifetime.agent, 0) for lifetime in lifetimes),
            energy=spread(lifetime.energy for lifetime in lifetimes),
            genotypes=np.array(some) if some else np.zeros((0, 0)),
            best=best.agent,
            best_genes=self.genes_of(best.agent),
        )

    def _drop(self, number: int) -> None:
        for agent in self._lifetimes.pop(number):
            self._conceptions.pop(agent, None)
        del self._received_s[number], self._turned_over[number]


def spread(values: Iterable[float]) -> Spread:
    """Return mean, standard deviation, and the 10 % and 90 % quantiles of numbers."""
    array = np.fromiter(values, dtype=float)
    with np.errstate(all="ignore"):  # any peer may publish any number
        low, high = np.quantile(array, (0.1, 0.9))
        return Spread(float(array.mean()), float(array.std()), float(low), float(high))
