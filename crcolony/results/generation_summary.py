"""One row of numbers for each generation: what its agents did, and how their meta-parameters are distributed.

What evolution does to exploration is seen in the effective tau, tau_0 / (1 + k n), that a module ends a lifetime with
after its n steps: with a decay k that is a gene too, tau_0 itself need not go to 0.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.history import Born, Died, Event, Lived, Mated
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MATING, MODULES
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Shares of agents whose genes are below the quantiles in a row."""


@dataclass(frozen=True)
class AgentColumns:
    """The agents of a generation; every array has one entry for each agent, in any shape."""

    matings: NDArray[Any]
    energy_weighted_matings: FloatArray
    """Sums of the robot's energy over an agent's matings"""
    captures: NDArray[Any]
    energies: FloatArray
    """Means over the steps that an agent lived"""
    steps: NDArray[Any]
    has_starved: NDArray[Any]
    conceptions_per_agent: float
    genotypes: FloatArray | None
    """(..., genes), or None if they are unknown"""
    module_steps: IntArray | None = None
    """(..., modules) steps for which each module was selected, or None if they are unknown"""


def summarise(
    generation: int, tick: int, agents: AgentColumns, genes: Sequence[str]
) -> dict[str, float]:
    """Return the row of a generation: means over all agents, and the distribution of their meta-parameters.

    `genes` are the names of the schema's genes, in order. `energy_weighted_matings` are the conceptions to expect with
    a conception exponent of 1; `starved` is the share of agents that died; `mating_share` the share of steps for which
    the mating module was selected; `foraging.alpha q50` and the like are quantiles over all agents of a gene, or of a
    module's effective tau.
    """
    row: dict[str, float] = {
        "generation": generation,
        "tick": tick,
        "matings": float(agents.matings.mean()),
        "captures": float(agents.captures.mean()),
        "conceptions": agents.conceptions_per_agent,
        "energy_weighted_matings": float(agents.energy_weighted_matings.mean()),
        "energy": float(agents.energies.mean()),
        "lived_steps": float(agents.steps.mean()),
        "starved": float(agents.has_starved.mean()),
    }
    if agents.module_steps is not None:
        mating_steps = agents.module_steps[..., MODULES.index(MATING)].sum()
        row["mating_share"] = float(mating_steps / max(agents.module_steps.sum(), 1))
    if agents.genotypes is not None:
        row |= _summarise_genes(agents.genotypes, genes)
        if agents.module_steps is not None:
            row |= _summarise_effective_tau(agents.genotypes, agents.module_steps, genes)
    return row


def _summarise_genes(genotypes: FloatArray, genes: Sequence[str]) -> dict[str, float]:
    row: dict[str, float] = {}
    for module in MODULES:
        for meta in META_PARAMETERS:
            name = f"{module.name}.{meta}"
            row |= _summarise_values(name, genotypes[..., genes.index(name)])
    return row


def _summarise_effective_tau(
    genotypes: FloatArray, module_steps: IntArray, genes: Sequence[str]
) -> dict[str, float]:
    row: dict[str, float] = {}
    for m, module in enumerate(MODULES):
        tau = genotypes[..., genes.index(f"{module.name}.tau")]
        decay = genotypes[..., genes.index(f"{module.name}.tau_decay")]
        effective_tau = tau / (1.0 + decay * module_steps[..., m])  # as `hyperbolic_decay`
        row |= _summarise_values(f"{module.name}.effective_tau", effective_tau)
    return row


def _summarise_values(name: str, values: FloatArray) -> dict[str, float]:
    """Return the mean and the quantiles of values over all agents, by the names of their columns."""
    row = {f"{name} mean": float(values.mean())}
    for share, value in zip(QUANTILES, np.quantile(values, QUANTILES), strict=True):
        row[quantile_name(name, share)] = float(value)
    return row


def quantile_name(gene: str, share: float) -> str:
    """Return the column name of a gene's quantile over agents."""
    return f"{gene} q{round(100 * share):02d}"


def summarise_robots(
    generation: int, tick: int, batch: Robots, robots: Sequence[Robot]
) -> dict[str, float]:
    """Return the row of the generation that all robots of a batch are about to end."""
    conceived = sum(robot.subpopulation.conceived for robot in robots)
    agents = AgentColumns(
        matings=batch.matings,
        energy_weighted_matings=batch.mating_energy_sum,
        captures=batch.captures,
        energies=batch.energy_sum / np.maximum(batch.steps_alive, 1),
        steps=batch.steps_alive,
        has_starved=batch.energies <= 0.0,
        conceptions_per_agent=conceived / batch.matings.size,
        genotypes=batch.genotypes,
        module_steps=batch.module_steps,
    )
    genes = [gene.name for gene in robots[0].subpopulation.schema.genes]
    return summarise(generation, tick, agents, genes)


def summarise_events(events: Sequence[Event], genes: Sequence[str]) -> Iterator[dict[str, float]]:
    """Yield the row of every generation that all robots of a history have ended, in order.

    `genes` are the names of the schema's genes, in order.
    """
    births = {event.agent: event for event in events if isinstance(event, Born)}
    conceptions, energies = _matings_by_agent(events)
    starved = {event.agent for event in events if isinstance(event, Died)}
    lifetimes: dict[int, list[Lived]] = {}
    for lifetime in (event for event in events if isinstance(event, Lived)):
        lifetimes.setdefault(lifetime.generation, []).append(lifetime)
    robots = len({event.robot for event in births.values()})
    for generation in sorted(lifetimes):
        ended = lifetimes[generation]
        if len({lifetime.robot for lifetime in ended}) < robots:
            break
        born = [births[lifetime.agent] for lifetime in ended if lifetime.agent in births]
        agents = AgentColumns(
            matings=np.array([lifetime.matings for lifetime in ended]),
            energy_weighted_matings=np.array([energies[lifetime.agent] for lifetime in ended]),
            captures=np.array([lifetime.captures for lifetime in ended]),
            energies=np.array([lifetime.energy for lifetime in ended]),
            steps=np.array([lifetime.steps for lifetime in ended]),
            has_starved=np.array([lifetime.agent in starved for lifetime in ended]),
            conceptions_per_agent=float(np.mean([conceptions[one.agent] for one in ended])),
            genotypes=np.stack([genes_of(birth) for birth in born]) if born else None,
        )
        yield summarise(generation, max(lifetime.tick for lifetime in ended), agents, genes)


def genes_of(born: Born) -> FloatArray:
    """Return the genes of a birth, (genes,)."""
    return np.frombuffer(born.genes, dtype="<f8")


def _matings_by_agent(events: Sequence[Event]) -> tuple[Counter[str], defaultdict[str, float]]:
    """Return the conceptions of every agent, and the sum of its energy at its matings."""
    conceptions: Counter[str] = Counter()
    energies: defaultdict[str, float] = defaultdict(float)
    for mated in (event for event in events if isinstance(event, Mated)):
        conceptions[mated.agent] += mated.conceived
        conceptions[mated.partner] += mated.partner_conceived
        energies[mated.agent] += mated.energy
        energies[mated.partner] += mated.partner_energy
    return conceptions, energies
