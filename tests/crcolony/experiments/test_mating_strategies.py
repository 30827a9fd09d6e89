"""Mixtures of foragers and trackers live as they were made, and the same seed gives the same rows."""

import numpy as np

from crcolony.config import load
from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.mating_strategies import COLUMNS, EXPERIMENT, draw, fitness_in_mixture
from crcolony.experiments.mating_strategies_claims import DENSITIES, SHARES
from crcolony.robot.genes import agent_schema

QUICK = Plan(seeds=(1,), is_quick=True)


def test_a_quick_run_has_a_population_and_every_mixture() -> None:
    """All its columns are in the data dictionary, its figure can be drawn, and it is the same each time."""
    job = EXPERIMENT.jobs(QUICK)[0]
    rows = job.run()
    assert isinstance(rows, list)
    assert rows == job.run()
    population, *mixtures = rows
    assert [row["share"] for row in mixtures] == list(SHARES)
    assert "forager_fitness" not in mixtures[0]
    assert "tracker_fitness" not in mixtures[-1]
    assert all(row.keys() <= COLUMNS.keys() for row in rows)
    assert 0.0 <= float(population["foragers"]) + float(population["trackers"]) <= 1.0
    everywhere: list[Row] = [
        {"condition": job.condition, "seed": 1, **row}
        for job in EXPERIMENT.jobs(QUICK)
        for row in rows
    ]
    assert len(draw(everywhere).axes) == 1 + len(DENSITIES)


def test_who_can_mate_earns_from_it() -> None:
    """In a crowded arena trackers that always mate have offspring to expect, alone and in a mixture."""
    config = load(
        None,
        [
            "robots=4",
            "life.agents=4",
            "life.slices=4",
            "arena.area_per_robot_m2=0.2",
            "arena.packs_per_robot=0",
            "arena.packs=1",
        ],
    )
    schema = agent_schema(config.learning, config.heredity)
    rng = np.random.default_rng(1)
    genotypes = np.array([schema.random(rng) for _ in range(16)])
    genotypes[:, :4] = 1.0, 0.0, 0.0, 0.0
    _, alone = fitness_in_mixture(config, genotypes, schema, share=0.0, lives=2)
    foragers, trackers = fitness_in_mixture(config, genotypes, schema, share=0.5, lives=2)
    assert alone > 0.0
    assert trackers > 0.0
    assert np.isfinite(foragers)
