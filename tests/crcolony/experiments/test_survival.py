"""The experiment on survival: who are the parents with either selection, and what a run leaves."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.colonies.survival_lives import NOBODY, Lives, survival_config
from crcolony.experiments.framework.experiment import CONDITION, SEED, Plan, Row
from crcolony.experiments.survival import (
    EXPERIMENT,
    QUICK,
    breed_autonomously,
    breed_centrally,
    found_population,
)
from crcolony.experiments.survival_claims import AUTONOMOUS, CENTRAL

ROBOTS, AGENTS, GENES = 2, 4, 8


def population() -> FloatArray:
    """Return genotypes whose genes are all the number of the agent, so that parents show."""
    numbers = np.arange(ROBOTS * AGENTS, dtype=np.float64) / 10.0
    return np.repeat(numbers, GENES).reshape(ROBOTS, AGENTS, GENES)


def lives(captures: list[list[int]], partners: list[list[int]]) -> Lives:
    """Return lives in which agents captured so much and remember these partners."""
    zeros = np.zeros((ROBOTS, AGENTS), dtype=np.int64)
    return Lives(np.array(captures), zeros, np.array(partners), zeros, zeros > 0)


NO_PARTNERS = [[NOBODY] * AGENTS] * ROBOTS


def parents_of(genotypes: FloatArray) -> list[set[int]]:
    """Return, for each robot, the agents whose genes its own have; about a tenth has mutated and is left out."""
    return [
        {round(10 * gene) for gene in own.flat if abs(10 * gene - round(10 * gene)) < 1e-9}
        for own in genotypes
    ]


def test_central_selection_breeds_from_those_that_captured_in_any_robot() -> None:
    """Whether they mated or not."""
    found = lives([[0, 5, 0, 0], [0, 0, 5, 0]], NO_PARTNERS)
    bred = breed_centrally(population(), found, np.random.default_rng(1))
    assert bred.shape == (ROBOTS, AGENTS, GENES)
    assert parents_of(bred) == [{1, 6}, {1, 6}]


def test_autonomous_selection_breeds_from_own_agents_that_mated_and_their_partners() -> None:
    """One that captured most but never mated leaves nothing; nor do others of the partner's robot."""
    captures = [[9, 1, 0, 0], [0, 0, 0, 3]]
    partners = [[NOBODY, 6, 4, NOBODY], [NOBODY, NOBODY, 1, 2]]
    bred = breed_autonomously(population(), lives(captures, partners), np.random.default_rng(1))
    assert parents_of(bred) == [{1, 6}, {7, 2}]


def test_a_robot_in_which_none_has_mated_keeps_its_agents_mutated() -> None:
    """The other one breeds as ever; where none of the mated captured anything, all are as likely."""
    partners = [[NOBODY] * AGENTS, [0, NOBODY, 0, NOBODY]]
    found = lives([[0] * AGENTS] * ROBOTS, partners)
    bred = breed_autonomously(population(), found, np.random.default_rng(2))
    assert parents_of(bred) == [{0, 1, 2, 3}, {0, 4, 6}]
    assert (bred[0] != population()[0]).any()
    assert [round(10 * float(np.median(own))) for own in bred[0]] == [0, 1, 2, 3]


def test_a_quick_run_has_all_columns_and_a_figure() -> None:
    """Of both selections, which begin with the same founders in the same arena."""
    rows: list[Row] = []
    for job in EXPERIMENT.jobs(Plan([7], True)):
        found = job.run()
        rows += [{CONDITION: job.condition, SEED: job.seed, **row} for row in found]  # type: ignore[dict-item]
    assert {name for row in rows for name in row} - {CONDITION, SEED} == set(EXPERIMENT.columns)
    own, central = (
        [row for row in rows if row[CONDITION] == selection] for selection in (AUTONOMOUS, CENTRAL)
    )
    assert len(own) == len(central) == QUICK.generations + QUICK.generations_after + 1
    assert {**own[0], CONDITION: CENTRAL} == central[0]
    labels = [line.get_label() for line in EXPERIMENT.draw(rows).axes[0].lines]
    assert labels[:2] == [AUTONOMOUS, CENTRAL]


def test_founders_differ_and_are_drawn_from_the_generator_alone() -> None:
    """One genotype for each agent of each robot."""
    config = survival_config("own", QUICK.settings)
    one, same, other = (found_population(config, np.random.default_rng(k)) for k in (1, 1, 2))
    assert one.shape == (config.robots, config.life.agents, GENES)
    assert len(np.unique(one)) == one.size
    assert one.tolist() == same.tolist() != other.tolist()
