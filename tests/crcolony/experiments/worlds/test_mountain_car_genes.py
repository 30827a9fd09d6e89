"""The genes of a learner of the mountain car, with a potential or without."""

import numpy as np

from crcolony.experiments.worlds.mountain_car_genes import (
    CENTRES,
    META_PARAMETERS,
    POTENTIAL,
    car_schema,
)


def test_genes_stand_where_they_are_read() -> None:
    """Meta-parameters come first, then a weight for each centre of the potential."""
    names = [gene.name for gene in car_schema(True).genes]
    assert names[:POTENTIAL] == list(META_PARAMETERS)
    assert len(names) == POTENTIAL + CENTRES[0] * CENTRES[1]


def test_without_shaping_the_potential_is_zero_and_stays_so() -> None:
    """And the meta-parameters of founders are those with shaping."""
    with_shaping, without = (
        car_schema(shaping).random(np.random.default_rng(1)) for shaping in (True, False)
    )
    assert with_shaping[:POTENTIAL].tolist() == without[:POTENTIAL].tolist()
    assert with_shaping[POTENTIAL:].all()
    assert not without[POTENTIAL:].any()
    assert not car_schema(False).mutation_sds[POTENTIAL:].any()
