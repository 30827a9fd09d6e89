"""The best agent of a colony is chosen by its matings, and learns anew in two robots."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import load
from crcolony.experiments.colonies.colony_transfer import best_agent, learning_curves
from crcolony.experiments.colonies.foraging_lives import BODIES
from crcolony.robot.genes import agent_schema

SMALL = ("robots=2", "life.agents=4", "life.slices=3", "life.slice_steps=200", "seed=1")
CONFIG = load(None, SMALL)
SCHEMA = agent_schema(CONFIG.learning, CONFIG.heredity)


def agents_who_mate(chosen: tuple[int, int] | None) -> FloatArray:
    """Return genotypes of agents that forage, but for those of the first robot and a chosen one: these always mate."""
    rng = np.random.default_rng(2)
    genotypes = np.array([[SCHEMA.random(rng) for _ in range(4)] for _ in range(2)])
    selector = [k for k, gene in enumerate(SCHEMA.genes) if gene.name.startswith("selector.")]
    bias = SCHEMA.index("selector.mating.bias")
    genotypes[..., selector] = 0.0
    genotypes[..., bias] = -1.0
    if chosen is not None:
        genotypes[0, :, bias] = genotypes[*chosen, bias] = 1.0
        genotypes[..., SCHEMA.index("mating.tau")] = 1.0
    return genotypes


def test_who_mates_is_the_best() -> None:
    """The only one of the second robot that the first one's agents can mate with has all its matings."""
    genotypes = agents_who_mate((1, 2))
    best = best_agent(CONFIG, genotypes[::-1], [1, 2, 3])
    assert best.tolist() == genotypes[1, 2].tolist()


def test_curves_are_those_of_newborns_in_each_body() -> None:
    """A value for each slice, the same for the same seeds; who forages alone never mates, and captures."""
    genes = agents_who_mate(None)[0, 0]
    curves = {
        body: learning_curves(load(None, [*SMALL, *settings]), genes, [1, 2])
        for body, settings in BODIES.items()
    }
    for curve in curves.values():
        assert curve.matings.tolist() == [0.0, 0.0, 0.0]
        assert curve.captures.shape == (3,)
        assert curve.captures.min() >= 0.0
        assert curve.captures.sum() > 0.0
    assert curves["own"].captures.tolist() != curves["delayed"].captures.tolist()
    again = learning_curves(CONFIG, genes, [1, 2])
    assert again.captures.tolist() == curves["own"].captures.tolist()
