"""A colony in one process whose robots begin with given genotypes, newborn."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.evolution.founders import Founders
from crcolony.evolution.population import NewAgent
from crcolony.in_process.colony import InProcessColony
from crcolony.robot.genes import agent_schema


def newborn_colony(config: Config, genotypes: FloatArray) -> InProcessColony:
    """Return a colony, not started, whose agents have these genotypes (robots, agents, genes).

    Raises ValueError for other numbers of robots or agents than the config has.
    """
    expected = (config.robots, config.life.agents)
    if genotypes.shape[:2] != expected:
        raise ValueError(f"genotypes of {genotypes.shape[:2]} robots and agents for {expected}")
    schema = agent_schema(config.learning, config.heredity)
    founders = Founders(
        schema.digest,
        "",
        tuple(tuple(NewAgent(np.array(genes), None, None) for genes in own) for own in genotypes),
    )
    return InProcessColony(config, lambda _: None, founders)
