"""Foragers that bring what they have learnt elsewhere: they learn on, or are frozen: policies that learn no more."""

from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.config import Config
from crcolony.experiments.colonies.foraging_lives import LIFE_STEPS, count_packs, new_foragers

Experience = Mapping[str, Any]
"""A robot whose agents have all lived once, as it is saved."""


def gain_experience(config: Config, genotypes: FloatArray, seed: int) -> Experience:
    """Let agents with these genotypes (agents, genes) live, and return the robot with all that they have learnt."""
    colony = new_foragers(_with_two_lives(config), genotypes, seed)
    colony.run(config.life.agents * LIFE_STEPS)
    return colony.robots[0].save()


def forage_again(
    config: Config,
    experience: Experience,
    seed: int,
    wheels: tuple[float, float] = (1.0, 1.0),
    *,
    frozen: bool,
) -> IntArray:
    """Let agents live another time, in any world; return packs as `forage` does.

    They explore as little as at the end of their first life. Those that are frozen have a learning rate of 0, so that
    no weight of theirs changes.
    """
    own = _with_two_lives(config)
    genotypes = experience["arrays"]["genotypes"]
    colony = new_foragers(own, np.asarray(genotypes), seed, wheels)
    colony.robots[0].restore(experience)
    if frozen:
        colony.batch.genotypes[0, :, colony.schema.index("foraging.alpha")] = 0.0
    return count_packs(colony)


def _with_two_lives(config: Config) -> Config:
    return msgspec.structs.replace(config, life=msgspec.structs.replace(config.life, slices=2))
