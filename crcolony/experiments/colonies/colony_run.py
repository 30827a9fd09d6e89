"""A colony that lives in one process without a folder, as a job of an experiment, and its history."""

from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.evolution.founders import Founders
from crcolony.evolution.genotype import Schema
from crcolony.evolution.history import Born, Event, HistoryHash
from crcolony.evolution.population import NewAgent
from crcolony.experiments.colonies.energy_effect import measure_energy_effect
from crcolony.experiments.colonies.outcomes import Outcome, outcome_of
from crcolony.in_process.colony import InProcessColony
from crcolony.results.generation_table import LAST_GENERATIONS
from crcolony.results.neutral_gene import neutral_medians
from crcolony.results.pedigree import Pedigree, pedigree_of

_CHUNK_TICKS = 10_000


@dataclass(frozen=True)
class ColonyRun:
    """A colony after its last generation, and its history."""

    colony: InProcessColony
    rows: list[dict[str, float]]
    """One a generation, as in `generations.csv`"""
    births: list[Born]
    history_hash: str

    @property
    def genotypes(self) -> FloatArray:
        """The genes of the newborn population, (agents, genes)."""
        genotypes = self.colony.batch.genotypes
        return np.array(genotypes.reshape(-1, genotypes.shape[-1]))

    @property
    def pedigree(self) -> Pedigree:
        """Who is whose offspring."""
        return pedigree_of(
            [
                (one.agent, one.generation, one.genotype, one.mother, one.father)
                for one in self.births
            ]
        )

    def neutral_means(self, genes: list[str]) -> dict[str, float]:
        """Return where the medians of neutral genes in the place of these are in the last generations, on average."""
        medians = neutral_medians(self.pedigree, self.colony.config, genes)
        last = [int(row["generation"]) for row in self.rows[-LAST_GENERATIONS:]]
        return {gene: float(medians[gene][last].mean()) for gene in genes}

    def outcome(self, condition: str) -> Outcome:
        """Return what came of it; the colony lives one generation more to be examined."""
        energy = measure_energy_effect(self.colony)
        return outcome_of(condition, self.colony.config.seed, self.rows, energy, self.history_hash)


def founders_of(genotypes: FloatArray, schema: Schema, name: str) -> Founders:
    """Return genotypes (robots, agents, genes) as founders, of a population with this name."""
    robots = [
        tuple(NewAgent(genes, f"{robot}@{name}/{k}", None) for k, genes in enumerate(own))
        for robot, own in enumerate(genotypes)
    ]
    return Founders(schema.digest, name, tuple(robots))


def run_colony(config: Config) -> ColonyRun:
    """Let a colony live until the last generation of its config, which has one."""
    assert config.generations > 0, "a run without an end"
    births: list[Born] = []
    chain = HistoryHash()

    def record(event: Event) -> None:
        chain.add(event)
        if isinstance(event, Born):
            births.append(event)

    colony = InProcessColony(config, record)
    colony.start()
    rows: list[dict[str, float]] = []
    while colony.generation < config.generations:
        colony.run(_CHUNK_TICKS)
        if colony.generation > len(rows):
            rows.append(colony.summary)
    return ColonyRun(colony, rows, list(births), str(chain))
