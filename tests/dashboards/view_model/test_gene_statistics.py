"""The statistics of genes are those of the decoded agents."""

import numpy as np
import pytest
from crcolony_dashboards.view_model.gene_statistics import QUANTILES, gene_statistics
from crcolony_dashboards.view_model.potentials import potential

from crcolony.body.settings import CyberRodent
from crcolony.robot.genes import decode
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.peer_settings import Mind
from tests.support.reported_generations import GENES

MIND = Mind(CyberRodent(), Learning(), Heredity())


def test_quantiles_means_and_attractions_are_those_of_the_agents() -> None:
    """Of every module and meta-parameter."""
    genotypes = np.array(GENES[:30])
    agents = [decode(genes, MIND.learning) for genes in genotypes]
    statistics = gene_statistics(genotypes, MIND)
    for module in (0, 1):
        gammas = [agent.meta_parameters[module].gamma for agent in agents]
        expected = np.quantile(gammas, QUANTILES)
        assert statistics.meta_parameters[module, 1] == pytest.approx(expected)
        potentials = [potential(MIND, agent.potentials[module], 61) for agent in agents]
        attraction = np.mean([values[0, 30] - values[-1, 30] for values in potentials])
        assert statistics.attraction[module] == pytest.approx(attraction)
    selectors = np.array([agent.selector[0] for agent in agents])
    assert statistics.selector == pytest.approx(selectors.mean(axis=0))
