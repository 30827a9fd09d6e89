"""Reproduction as a strategy: what an agent sends in a mating, what it does with what it receives, and who comes next.

The thesis (4.5) tells embodied evolution apart by just this. A strategy belongs to one robot, sees nothing but that
robot and what a partner has sent, and draws from the robot's own stream, so that the order of robots changes nothing.
Schemes with a central view are no such strategy: see `crcolony/in_process`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.lineage import AgentId
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.randomness import Stream


@dataclass(frozen=True)
class MatingOffer:
    """What one robot gives to the other in a mating: an agent's id and genotype, but not its
    performance."""

    agent: AgentId
    genes: FloatArray


@dataclass(frozen=True, eq=False)
class MatingAgent:
    """An agent that takes part in a mating, as its own robot knows it."""

    subpopulation: Subpopulation
    index: int
    """Of the agent in its subpopulation"""
    energy: float
    """From 0 (dead) to 1"""
    matings: int
    """In its lifetime, with this one"""
    step: int
    """The robot's count of control steps"""

    @property
    def id(self) -> AgentId:
        """The agent's name."""
        return self.subpopulation.ids[self.index]

    @property
    def genes(self) -> FloatArray:
        """The agent's genotype (genes,): what is written to it is at once in effect."""
        genes: FloatArray = self.subpopulation.genotypes[self.index]
        return genes


class ReproductionStrategy(Protocol):
    """How the agents of a robot reproduce."""

    def offer(self, own: MatingAgent, stream: Stream) -> MatingOffer:
        """Return what the agent sends; both robots have sent before either receives."""
        ...

    def receive(self, own: MatingAgent, partner: MatingOffer, stream: Stream) -> Offspring | None:
        """Make use of what the partner sent; return the genotype that comes of it, if any: a conception."""
        ...

    def next_agents(
        self, subpopulation: Subpopulation, matings: IntArray, rng: np.random.Generator
    ) -> list[NewAgent]:
        """Return the agents of the next generation, in the order of their indices.

        `matings` (agents,) are those in the lifetimes that have ended.
        """
        ...

    def save(self) -> dict[str, Any]:
        """Return what the strategy remembers beside the subpopulation, as plain data and copies; empty: nothing."""
        ...

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Remember what was saved; raises ValueError or KeyError if it does not fit."""
        ...


class WithoutMemory:
    """The part of a strategy that remembers nothing beside the subpopulation, and sends a genotype as it is."""

    def offer(self, own: MatingAgent, stream: Stream) -> MatingOffer:
        """Return the agent's genotype."""
        return MatingOffer(own.id, own.genes)

    def save(self) -> dict[str, Any]:
        """Return nothing."""
        return {}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Remember nothing."""


class CentrallyBred(WithoutMemory):
    """That of robots whose next agents are made elsewhere: matings are counted, and nothing comes of them."""

    def receive(self, own: MatingAgent, partner: MatingOffer, stream: Stream) -> Offspring | None:
        """Conceive nothing."""
        return None

    def next_agents(
        self, subpopulation: Subpopulation, matings: IntArray, rng: np.random.Generator
    ) -> list[NewAgent]:
        """Raise AssertionError: a robot alone has no next agents."""
        raise AssertionError("the next agents are made centrally")
