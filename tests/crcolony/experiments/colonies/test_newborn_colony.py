"""A colony begins with the genotypes that it is given."""

import numpy as np
import pytest

from crcolony.config import load
from crcolony.experiments.colonies.newborn_colony import newborn_colony
from crcolony.robot.genes import agent_schema

CONFIG = load(None, ["robots=2", "life.agents=3"])


def test_every_agent_has_its_own_genotype() -> None:
    """In the order of robots and agents."""
    schema, rng = agent_schema(CONFIG.learning, CONFIG.heredity), np.random.default_rng(1)
    genotypes = np.array([[schema.random(rng) for _ in range(3)] for _ in range(2)])
    colony = newborn_colony(CONFIG, genotypes)
    colony.start()
    assert colony.batch.genotypes.tolist() == genotypes.tolist()


def test_each_agent_needs_one() -> None:
    """No more and no fewer."""
    with pytest.raises(ValueError, match=r"\(2, 4\) robots and agents for \(2, 3\)"):
        newborn_colony(CONFIG, np.zeros((2, 4, 1)))
