"""Foragers evolve, and the best is chosen by further lives."""

from itertools import pairwise

import numpy as np
import pytest

from crcolony.compiled import FloatArray, IntArray
from crcolony.config import Config
from crcolony.experiments.colonies import foraging_evolution
from crcolony.experiments.colonies.foraging_evolution import choose_best, evolve_foragers
from crcolony.experiments.colonies.foraging_lives import foraging_config, foraging_schema

CONFIG = foraging_config(6, True)


def test_generations_follow_from_the_seed_alone() -> None:
    """As many as are asked for; each differs from the one before, and all genes are within their ranges."""
    one, same = (list(evolve_foragers(CONFIG, 3, np.random.default_rng(5))) for _ in range(2))
    assert [lived.packs.tolist() for lived in one] == [lived.packs.tolist() for lived in same]
    assert len(one) == 3
    lambdas = [
        lived.genotypes[:, foraging_schema(CONFIG).index("foraging.lambda")] for lived in one
    ]
    for before, after in pairwise(lambdas):
        assert before.tolist() != after.tolist()
    assert 0.0 <= np.min(lambdas) <= np.max(lambdas) <= 1.0


def test_packs_select(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gene that brings packs rises; who has the most of it is the best."""
    gene = foraging_schema(CONFIG).index("foraging.gamma")

    def packs_by_gene(config: Config, genotypes: FloatArray, seed: int) -> IntArray:
        return np.asarray(1000.0 * genotypes[:, [gene, gene]], dtype=np.int64)

    monkeypatch.setattr(foraging_evolution, "forage", packs_by_gene)
    rng = np.random.default_rng(1)
    lived = list(evolve_foragers(foraging_config(20, True), 30, rng))
    assert lived[-1].packs.mean() > lived[0].packs.mean() + 400.0
    last = lived[-1].genotypes
    best = choose_best(foraging_config(20, True), last, rng)
    assert best[gene] == last[:, gene].max()
