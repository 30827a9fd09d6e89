"""A generation in numbers: what its agents did, and how their meta-parameters are distributed."""

from collections.abc import Iterator, Sequence

import numpy as np

from crcolony.evolution.history import Born, Died, Event, Lived, Mated
from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def summarise(
    generation: int, tick: int, batch: Robots, robots: Sequence[Robot]
) -> dict[str, float]:
    """Return means over all agents of all robots, taken before the turnover.

    Matings, captures and conceptions are per agent; energy is the mean over the steps lived; starved is the share
    of agents that died; `foraging.alpha q50` and the like are quantiles of a gene over all agents.
    """
    lived = np.maximum(batch.steps_alive, 1)
    agents = batch.matings.size
    row: dict[str, float] = {
        "generation": generation,
        "tick": tick,
        "matings": float(batch.matings.mean()),
        "captures": float(batch.captures.mean()),
        "conceptions": sum(robot.subpopulation.conceived for robot in robots) / agents,
        "energy": float((batch.energy_sum / lived).mean()),
        "lived_steps": float(batch.steps_alive.mean()),
        "starved": float((batch.energies <= 0.0).mean()),
        "mating_share": float(
            batch.module_steps[:, :, -1].sum() / max(batch.module_steps.sum(), 1)
        ),
    }
    schema = robots[0].subpopulation.schema
    for module in MODULES:
        for meta in META_PARAMETERS:
            name = f"{module.name}.{meta}"
            values = batch.genotypes[:, :, schema.index(name)]
            row[f"{name} mean"] = float(values.mean())
            for quantile, value in zip(QUANTILES, np.quantile(values, QUANTILES), strict=True):
                row[quantile_of(name, quantile)] = float(value)
    return row


def quantile_of(gene: str, share: float) -> str:
    """Name the column of a gene's quantile over agents."""
    return f"{gene} q{round(100 * share):02d}"


def generations_of(events: Sequence[Event], genes: Sequence[str]) -> Iterator[dict[str, float]]:
    """Return a row of means for every generation that all robots have ended, as `summary.summarise` does.

    `genes` are the names of the schema's genes, in order.
    """
    births = {event.agent: event for event in events if isinstance(event, Born)}
    conceptions: dict[str, int] = {}
    for mated in (event for event in events if isinstance(event, Mated)):
        conceptions[mated.agent] = conceptions.get(mated.agent, 0) + mated.conceived
        partner = mated.partner
        conceptions[partner] = conceptions.get(partner, 0) + mated.partner_conceived
    starved = {event.agent for event in events if isinstance(event, Died)}
    lives: dict[int, list[Lived]] = {}
    for life in (event for event in events if isinstance(event, Lived)):
        lives.setdefault(life.generation, []).append(life)
    robots = len({event.robot for event in births.values()})
    for generation in sorted(lives):
        ended = lives[generation]
        if len({life.robot for life in ended}) < robots:
            break
        row: dict[str, float] = {
            "generation": generation,
            "tick": max(life.tick for life in ended),
            "matings": float(np.mean([life.matings for life in ended])),
            "captures": float(np.mean([life.captures for life in ended])),
            "conceptions": float(np.mean([conceptions.get(life.agent, 0) for life in ended])),
            "energy": float(np.mean([life.energy for life in ended])),
            "lived_steps": float(np.mean([life.steps for life in ended])),
            "starved": float(np.mean([life.agent in starved for life in ended])),
        }
        bearers = [births[life.agent] for life in ended if life.agent in births]
        if bearers:
            row |= _genes_in_numbers(np.stack([genes_of(born) for born in bearers]), genes)
        yield row


def genes_of(born: Born) -> np.ndarray:
    """Return the genes of a birth, (genes,)."""
    return np.frombuffer(born.genes, dtype="<f8")


def _genes_in_numbers(genotypes: np.ndarray, genes: Sequence[str]) -> dict[str, float]:
    row: dict[str, float] = {}
    for module in MODULES:
        for meta in META_PARAMETERS:
            name = f"{module.name}.{meta}"
            values = genotypes[:, genes.index(name)]
            row[f"{name} mean"] = float(values.mean())
            for quantile, value in zip(QUANTILES, np.quantile(values, QUANTILES), strict=True):
                row[quantile_of(name, quantile)] = float(value)
    return row
