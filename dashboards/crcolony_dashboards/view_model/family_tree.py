"""The family tree of a colony: parents of every agent, and the founder that each of its genes descends from.

A founder is an agent without known parents: one of generation 0, or the earliest ancestor whose name was received. Each
gene of a child descends from the parent whose gene is nearer (equal, apart from mutations).
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
"""Kept at a time: two generations of a thousand robots; the oldest are dropped"""
_MAX_FOUNDERS = 100_000
"""Numbered apart from each other; further ones count as the last of these"""

Origins = NDArray[np.int32]
"""(genes,) the number of the founder that each gene descends from"""


@dataclass(frozen=True, eq=False)
class Member:
    """An agent in the family tree."""

    agent: str
    robot: RobotId
    index: int
    """Among the agents of its robot and generation, in order of arrival"""
    generation: int
    mother: str | None
    father: str | None
    genes: FloatArray
    origins: Origins
    founder: int
    """The number of the founder of most of its genes"""


class FamilyTree:
    """Built from the births of a colony. Founders are numbered in the order in which they were received."""

    def __init__(self) -> None:
        self.founders: list[str] = []
        """Their names; the index is the founder's number"""
        self.births = 0
        """How many births were added"""
        self._numbers: dict[str, int] = {}
        self._members: OrderedDict[str, Member] = OrderedDict()
        self._living: dict[RobotId, tuple[int, list[Member]]] = {}
        """Of every robot, the number and the members of its newest generation"""
        self._sizes: dict[tuple[RobotId, int], int] = {}
        """The number of agents of every robot and generation"""

    def __len__(self) -> int:
        return len(self._members)

    def __getitem__(self, agent: str) -> Member | None:
        return self._members.get(agent)

    def add_birth(self, robot: RobotId, event: Born) -> None:
        """Add a birth; one that was added before changes nothing."""
        if event.agent in self._members:
            return
        generation, living = self._living.get(robot, (-1, []))
        genes = np.frombuffer(event.genes, dtype="<f8")
        origins = self._origins_of(event, genes)
        index = self._sizes.get((robot, event.generation), 0)
        self._sizes[robot, event.generation] = index + 1
        member = Member(
            agent=event.agent,
            robot=robot,
            index=index,
            generation=event.generation,
            mother=event.mother,
            father=event.father,
            genes=genes,
            origins=origins,
            founder=int(np.bincount(origins).argmax()) if len(origins) else 0,
        )
        self._members[event.agent] = member
        self.births += 1
        if event.generation > generation:
            self._living[robot] = (event.generation, [member])
        elif event.generation == generation:
            living.append(member)
        if len(self._members) > _MAX_BIRTHS:
            self._drop_oldest()

    def _drop_oldest(self) -> None:
        _, oldest = self._members.popitem(last=False)
        self._sizes.pop((oldest.robot, oldest.generation), None)
        _, living = self._living.get(oldest.robot, (-1, []))
        if living and living[0] is oldest:
            living.pop(0)
            if not living:
                del self._living[oldest.robot]

    def _origins_of(self, event: Born, genes: FloatArray) -> Origins:
        """Return the founder of every gene; that of the only known parent, or a new one if no parent is known."""
        names = [name for name in (event.mother, event.father) if name is not None]
        parents = [
            parent
            for name in names
            if (parent := self._members.get(name)) is not None and len(parent.genes) == len(genes)
        ]
        if not parents:
            founder = self._founder_number(names[0] if names else event.agent)
            return np.full(len(genes), founder, dtype=np.int32)
        if len(parents) == 1:
            return parents[0].origins
        mother, father = parents
        is_mothers = np.abs(genes - mother.genes) <= np.abs(genes - father.genes)
        return np.where(is_mothers, mother.origins, father.origins)

    def _founder_number(self, founder: str) -> int:
        number = self._numbers.get(founder, len(self.founders))
        if number < len(self.founders):
            return number
        if number == _MAX_FOUNDERS:
            return number - 1
        self._numbers[founder] = number
        self.founders.append(founder)
        return number

    def shares(self, present: Iterable[RobotId]) -> dict[int, float]:
        """Return the share of each founder in the genes of these robots' newest agents, the largest first."""
        living = [
            member.origins for robot in present for member in self._living.get(robot, (-1, []))[1]
        ]
        if not living:
            return {}
        counts = np.bincount(np.concatenate(living), minlength=1)
        order = np.argsort(-counts, kind="stable")
        total = max(1, int(counts.sum()))
        return {int(number): float(counts[number]) / total for number in order if counts[number]}

    def last_births(self, count: int) -> list[Member]:
        """Return the last births and their ancestors, at most `count` in all, the oldest generation first."""
        shown: dict[str, Member] = {}
        queue: deque[Member] = deque()
        for member in reversed(self._members.values()):
            if len(shown) >= max(1, count // 2):
                break
            shown[member.agent] = member
            queue.append(member)
        while queue and len(shown) < count:
            child = queue.popleft()
            for parent in (child.mother, child.father):
                known = self._members.get(parent) if parent else None
                if known is not None and known.agent not in shown and len(shown) < count:
                    shown[known.agent] = known
                    queue.append(known)
        return sorted(shown.values(), key=lambda member: (member.generation, member.agent))
