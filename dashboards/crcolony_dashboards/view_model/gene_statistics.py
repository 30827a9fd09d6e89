"""What the genes of a generation have in common: meta-parameters, weights of the selector, and potentials."""

from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.robot.genes import META_PARAMETERS, agent_schema, decode, selector_inputs
from crcolony.robot.modules import MODULES
from crcolony.telemetry.peer_settings import Mind
from crcolony_dashboards.view_model.potentials import potential

QUANTILES = (0.1, 0.5, 0.9)
"""Of the meta-parameters; the median is in the middle"""


@dataclass(frozen=True, eq=False)
class GeneStatistics:
    """The genes of the agents of one generation."""

    meta_parameters: FloatArray
    """(modules, meta-parameters, quantiles)"""
    selector: FloatArray
    """(inputs,) mean weights"""
    attraction: FloatArray
    """(modules,) by how much the mean potential is higher at a target in front than at the end of the view"""


def gene_statistics(genotypes: FloatArray, mind: Mind) -> GeneStatistics:
    """Return the statistics of genotypes, (agents, genes), which are read by these settings."""
    schema = agent_schema(mind.learning, mind.heredity)
    columns = [
        [schema.index(f"{module.name}.{meta}") for meta in META_PARAMETERS] for module in MODULES
    ]
    mean = decode(genotypes.mean(axis=0), mind.learning)
    # Three points over the view: the middle column is straight ahead
    ahead = [potential(mind, weights, 3)[:, 1] for weights in mean.potentials]
    return GeneStatistics(
        meta_parameters=np.moveaxis(np.quantile(genotypes[:, columns], QUANTILES, axis=0), 0, -1),
        selector=genotypes[:, : len(selector_inputs())].mean(axis=0),
        attraction=np.array([along[0] - along[-1] for along in ahead]),
    )
