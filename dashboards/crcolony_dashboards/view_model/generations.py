"""A colony generation by generation, put together from what its robots tell: mean and spread over all agents.

Robots turn over one by one, and some are late: a generation is over when all who are alive have left it and told of
it, or when half of them have left it and nothing more was heard of it for a while. What comes later is not waited for.
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
_MAX_AGENTS = 100_000
"""Whose births, or whose conceptions, are kept at a time, or whose lives of one generation"""
_MAX_GENERATIONS = 16
"""That are under way at a time; robots of a colony are seldom two apart"""
_CLOUD = 400
"""Genotypes of one generation that are kept to be drawn"""


@dataclass(frozen=True)
class Spread:
    """How a number is distributed over the agents of a generation."""

    mean: float
    sd: float
    low: float
    """10 % are below"""
    high: float
    """10 % are above"""


@dataclass(frozen=True)
class Generation:
    """A generation that is over."""

    number: int
    unix_s: float
    """When the last of its agents told of its life"""
    tick: int
    """Of the last of them"""
    agents: int
    matings: Spread
    captures: Spread
    conceptions: Spread
    energy: Spread
    genotypes: FloatArray
    """(some agents, genes); nobody's if their births were not heard"""
    best: str
    """Who mated most; of equals, who captured most batteries"""
    best_genes: FloatArray | None


class Generations:
    """Takes the events of one colony's robots, and returns each generation once it is over."""

    def __init__(self) -> None:
        self.last = -1
        """The newest generation that is over"""
        self._lives: dict[int, dict[str, Lived]] = {}
        self._heard_s: dict[int, float] = {}
        self._told_s: dict[int, float] = {}
        self._next: dict[int, set[RobotId]] = {}
        """Of generations that are under way: whose children were heard of, which come after the parents' lives"""
        self._births: OrderedDict[str, bytes] = OrderedDict()
        self._conceptions: OrderedDict[str, int] = OrderedDict()

    def add_birth(self, robot: RobotId, event: Born) -> None:
        """Take a birth."""
        if event.generation - 1 in self._lives:
            self._next[event.generation - 1].add(robot)
        self._births[event.agent] = event.genes
        if len(self._births) > _MAX_AGENTS:
            self._births.popitem(last=False)

    def add_mating(self, event: Exchanged) -> None:
        """Take one side of a mating."""
        self._conceptions[event.agent] = self._conceptions.get(event.agent, 0) + event.conceived
        if len(self._conceptions) > _MAX_AGENTS:
            self._conceptions.popitem(last=False)

    def add_lifetime(self, event: Lived, told_s: float, unix_s: float) -> None:
        """Take what an agent made of its life, told then and heard now; of a generation that is over, too late."""
        number = event.generation
        if number <= self.last:
            return
        lives = self._lives.setdefault(number, {})
        if len(lives) >= _MAX_AGENTS:
            return
        lives[event.agent] = event
        self._next.setdefault(number, set())
        self._heard_s[number] = unix_s
        self._told_s[number] = max(told_s, self._told_s.get(number, told_s))
        if len(self._lives) > _MAX_GENERATIONS:
            self._forget(min(self._lives))

    def genes_of(self, agent: str) -> FloatArray | None:
        """Return the genes of an agent, (genes,), if its birth was heard."""
        genes = self._births.get(agent)
        return None if genes is None else np.frombuffer(genes, dtype="<f8")

    def take_ended(self, present: Mapping[RobotId, int], unix_s: float) -> list[Generation]:
        """Return generations that have come to an end, in order; `present` says in which one every robot lives now."""
        over = [number for number in self._lives if self._is_over(number, present, unix_s)]
        self.last = max(over, default=self.last)
        ended = []
        for number in sorted(number for number in self._lives if number <= self.last):
            ended.append(self._summary(number))
            self._forget(number)
        return ended

    def _is_over(self, number: int, present: Mapping[RobotId, int], unix_s: float) -> bool:
        left = sum(now > number for now in present.values())
        if left == len(present) > 0 and self._next[number].issuperset(present):
            return True
        return 2 * left >= len(present) and unix_s - self._heard_s[number] >= PATIENCE_S

    def _summary(self, number: int) -> Generation:
        lives = list(self._lives[number].values())
        best = max(lives, key=lambda life: (life.matings, life.captures, life.energy))
        known = [genes for life in lives if (genes := self.genes_of(life.agent)) is not None]
        known = [genes for genes in known if len(genes) == len(known[0])]
        some = known[:: max(1, -(-len(known) // _CLOUD))]
        return Generation(
            number=number,
            unix_s=self._told_s[number],
            tick=max(life.tick for life in lives),
            agents=len(lives),
            matings=spread(life.matings for life in lives),
            captures=spread(life.captures for life in lives),
            conceptions=spread(self._conceptions.get(life.agent, 0) for life in lives),
            energy=spread(life.energy for life in lives),
            genotypes=np.array(some) if some else np.zeros((0, 0)),
            best=best.agent,
            best_genes=self.genes_of(best.agent),
        )

    def _forget(self, number: int) -> None:
        for agent in self._lives.pop(number):
            self._conceptions.pop(agent, None)
        del self._heard_s[number], self._told_s[number], self._next[number]


def spread(values: Iterable[float]) -> Spread:
    """Return mean, standard deviation, and the 10 % and 90 % quantiles."""
    array = np.fromiter(values, dtype=float)
    with np.errstate(all="ignore"):  # anybody may publish any number
        low, high = np.quantile(array, (0.1, 0.9))
        return Spread(float(array.mean()), float(array.std()), float(low), float(high))
