"""The family of a colony: who was born of whom, and how much of its genes goes back to which founder.

A founder is an agent without known parents: one of generation 0, or the earliest ancestor that was heard of. Each gene
of a child comes from the parent whose gene is nearer (equal, but for mutations), and goes back to its founder.
"""

from collections import OrderedDict, deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray
from crcolony.evolution.history import Born
from crcolony.protocol.identity import RobotId

_MAX_BIRTHS = 45_000
"""That are remembered: two generations of a thousand robots"""
_MAX_FOUNDERS = 100_000
"""That are told apart; anybody can make up more, which count as the last of these"""

Origins = NDArray[np.int32]
"""(genes,) the number of the founder that each gene goes back to"""


@dataclass(frozen=True, eq=False)
class Member:
    """An agent in the family."""

    agent: str
    robot: RobotId
    place: int
    """Among the agents of its robot and generation"""
    generation: int
    mother: str | None
    father: str | None
    genes: FloatArray
    origins: Origins
    founder: int
    """The founder of most of its genes"""


class FamilyTree:
    """Takes the births of a colony. Founders are numbered in the order in which they were heard of."""

    def __init__(self) -> None:
        self.founders: list[str] = []
        """Their names, by number"""
        self.changes = 0
        """Grows with every birth"""
        self._numbers: dict[str, int] = {}
        self._members: OrderedDict[str, Member] = OrderedDict()
        self._living: dict[RobotId, tuple[int, list[Member]]] = {}
        """Of every robot, its newest generation, in order of birth"""
        self._places: dict[tuple[RobotId, int], int] = {}
        """How many agents of a robot and generation there are"""

    def __len__(self) -> int:
        return len(self._members)

    def __getitem__(self, agent: str) -> Member | None:
        return self._members.get(agent)

    def add_birth(self, robot: RobotId, event: Born) -> None:
        """Take a birth; one that was taken before changes nothing."""
        if event.agent in self._members:
            return
        generation, living = self._living.get(robot, (-1, []))
        genes = np.frombuffer(event.genes, dtype="<f8")
        origins = self._origins_of(event, genes)
        place = self._places.get((robot, event.generation), 0)
        self._places[robot, event.generation] = place + 1
        member = Member(
            agent=event.agent,
            robot=robot,
            place=place,
            generation=event.generation,
            mother=event.mother,
            father=event.father,
            genes=genes,
            origins=origins,
            founder=int(np.bincount(origins).argmax()) if len(origins) else 0,
        )
        self._members[event.agent] = member
        self.changes += 1
        if event.generation > generation:
            self._living[robot] = (event.generation, [member])
        elif event.generation == generation:
            living.append(member)
        if len(self._members) > _MAX_BIRTHS:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        _, oldest = self._members.popitem(last=False)
        self._places.pop((oldest.robot, oldest.generation), None)
        _, living = self._living.get(oldest.robot, (-1, []))
        if living and living[0] is oldest:
            living.pop(0)
            if not living:
                del self._living[oldest.robot]

    def _origins_of(self, event: Born, genes: FloatArray) -> Origins:
        names = [name for name in (event.mother, event.father) if name is not None]
        parents = [
            parent
            for name in names
            if (parent := self._members.get(name)) is not None and len(parent.genes) == len(genes)
        ]
        if not parents:
            founder = self._number_of(names[0] if names else event.agent)
            return np.full(len(genes), founder, dtype=np.int32)
        if len(parents) == 1:
            return parents[0].origins
        mother, father = parents
        is_mothers = np.abs(genes - mother.genes) <= np.abs(genes - father.genes)
        return np.where(is_mothers, mother.origins, father.origins)

    def _number_of(self, founder: str) -> int:
        number = self._numbers.get(founder, len(self.founders))
        if number < len(self.founders):
            return number
        if number == _MAX_FOUNDERS:
            return number - 1
        self._numbers[founder] = number
        self.founders.append(founder)
        return number

    def shares(self, present: Iterable[RobotId]) -> dict[int, float]:
        """Return how much of the genes in these robots goes back to which founder, the largest share first."""
        living = [
            member.origins for robot in present for member in self._living.get(robot, (-1, []))[1]
        ]
        if not living:
            return {}
        counts = np.bincount(np.concatenate(living), minlength=1)
        order = np.argsort(-counts, kind="stable")
        total = max(1, int(counts.sum()))
        return {int(number): float(counts[number]) / total for number in order if counts[number]}

    def last_births(self, most: int) -> list[Member]:
        """Return the last births and ancestors of theirs, at most so many, the oldest generation first."""
        shown: dict[str, Member] = {}
        waiting: deque[Member] = deque()
        for member in reversed(self._members.values()):
            if len(shown) >= max(1, most // 2):
                break
            shown[member.agent] = member
            waiting.append(member)
        while waiting and len(shown) < most:
            child = waiting.popleft()
            for parent in (child.mother, child.father):
                known = self._members.get(parent) if parent else None
                if known is not None and known.agent not in shown and len(shown) < most:
                    shown[known.agent] = known
                    waiting.append(known)
        return sorted(shown.values(), key=lambda member: (member.generation, member.agent))
