"""Genes decode to what the compiled step reads."""

import math

import msgspec
import numpy as np
import pytest

from crcolony.evolution.variation import gaussian_mutation
from crcolony.robot.genes import META_PARAMETERS, agent_schema, decode, module_genes
from crcolony.robot.settings import Heredity, Learning


def test_a_genotype_decodes_to_selector_meta_parameters_and_potentials() -> None:
    """Every gene is decoded to the quantity that it is named for."""
    learning = Learning()
    schema = agent_schema(learning, Heredity())
    genes = np.arange(float(len(schema)))
    agent = decode(genes, learning)
    assert len(schema) == 4 + 2 * module_genes(learning) == 46
    assert agent.selector.tolist() == [[0.0, 1.0, 2.0, 3.0]]
    for module, name in enumerate(("foraging", "mating")):
        meta = agent.meta_parameters[module]
        for value, field in zip(META_PARAMETERS, meta.__dataclass_fields__, strict=True):
            assert getattr(meta, field) == schema.index(f"{name}.{value}")
        assert agent.potentials[module].shape == (4, 4)
        assert agent.potentials[module][0, 0] == schema.index(f"{name}.potential.0")
        assert agent.potentials[module][3, 3] == schema.index(f"{name}.potential.15")


def test_meta_parameters_have_the_bounds_of_the_settings() -> None:
    """A lambda of at most 0.5 does not exceed it in the first generation."""
    heredity = msgspec.structs.replace(Heredity(), highest_lambda=0.5, highest_tau_decay=0.01)
    schema = agent_schema(Learning(), heredity)
    index = schema.index("mating.lambda")
    assert (schema.lows[index], schema.highs[index]) == (0.0, 0.5)
    assert schema.highs[schema.index("foraging.tau_decay")] == 0.01
    assert schema.highs[schema.index("foraging.gamma")] == 0.999
    rng = np.random.default_rng(1)
    assert max(schema.random(rng)[index] for _ in range(200)) <= 0.5


@pytest.mark.parametrize(("setting", "bound"), [(3.0, 3.0), (0.5, 0.5), (0.0, math.inf)])
def test_selector_genes_have_the_bounds_of_the_setting(setting: float, bound: float) -> None:
    """Neither founders nor mutants leave them; 0 is without bounds."""
    heredity = msgspec.structs.replace(Heredity(), highest_selector=setting)
    schema = agent_schema(Learning(), heredity)
    assert schema.lows[:4].tolist() == [-bound] * 4
    assert schema.highs[:4].tolist() == [bound] * 4
    rng = np.random.default_rng(1)
    genes = schema.random(rng)
    for _ in range(300):
        genes = gaussian_mutation(genes, schema, 1.0, rng)
        assert np.abs(genes[:4]).max() <= bound
