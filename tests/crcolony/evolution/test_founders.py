"""Founders are the genotypes of an earlier run, named by their origin and dealt out to any number of robots."""

import numpy as np
import pytest

from crcolony.evolution.founders import (
    Founders,
    FoundersError,
    founder_name,
    make_founders,
    population_digest,
)
from crcolony.evolution.genotype import Gene, Normal, Schema, Uniform, genotype_digest
from crcolony.evolution.history import Born

A, B = Gene("a"), Gene("b", 0.0, 1.0, Uniform(0.0, 1.0))
SCHEMA = Schema((A, B))


def born(robot: int, number: int, genes: tuple[float, ...], schema: Schema = SCHEMA) -> Born:
    values = np.array(genes)
    digest = genotype_digest(schema, values)
    return Born(0, robot, 7, f"{robot}/{number}", digest, values.tobytes(), None, None)


RUN = [[born(0, 8, (1.0, 0.1)), born(0, 9, (2.0, 0.2))], [born(1, 8, (3.0, 0.3))]]


def genes_of(founders: Founders, robot: int, agents: int) -> list[float]:
    return [agent.genes[0] for agent in founders.of_robot(robot, agents)]


def test_a_founder_has_the_genes_of_its_mother_which_is_named_by_its_run() -> None:
    """No agent of the later run has such a name, and the same population gives the same names."""
    founders = make_founders(RUN, SCHEMA, SCHEMA)
    population = population_digest(RUN)
    first, second = founders.of_robot(0, 2)
    assert (first.mother, first.father) == (f"0@{population}/8", None)
    assert second.mother == founder_name("0/9", population)
    assert second.genes.tolist() == [2.0, 0.2]
    assert population_digest(RUN[:1]) != population == founders.population


def test_founders_are_dealt_out_again_where_there_are_too_few() -> None:
    """To more robots and to more agents from the first on; of too many the first are taken."""
    founders = make_founders(RUN, SCHEMA, SCHEMA)
    assert [genes_of(founders, robot, 3) for robot in range(3)] == [[1, 2, 1], [3, 3, 3], [1, 2, 1]]
    assert genes_of(founders, 0, 1) == [1.0]
    assert genes_of(founders.share_of(3), 0, 1) == genes_of(founders, 3, 1) == [3.0]


@pytest.mark.parametrize(
    ("was", "now", "line"),
    [
        ((A, B), (A,), "only there: b"),
        ((A, B), (A, B, Gene("c")), "only here: c"),
        ((A, B), (A, Gene("b", 0.0, 2.0)), r"in other ranges: b \(0 to 1 there, 0 to 2 here\)"),
        ((A, B), (B, A), "another order"),
        ((A, B), (*map(Gene, "acdefg"),), "only there: b; only here: c, d, e and 2 more"),
    ],
)
def test_other_genes_are_refused_by_name(
    was: tuple[Gene, ...], now: tuple[Gene, ...], line: str
) -> None:
    """Which are only there, which only here, and which have another range; a few of many."""
    with pytest.raises(FoundersError, match=line):
        make_founders(RUN, Schema(was), Schema(now))


def test_genes_that_settings_do_not_explain_are_refused() -> None:
    """The settings of a run of an earlier version may now mean other genes than it had."""
    older = Schema((A,))
    with pytest.raises(FoundersError, match=r"agent 0/8 has 1 genes of an earlier version.* 2"):
        make_founders([[born(0, 8, (1.0,), older)]], SCHEMA, SCHEMA)


def test_genes_that_are_switched_off_are_refused() -> None:
    """Evolution could never change them: shaping would stay in a colony without shaping."""
    off = Schema((Gene("a", initial=Normal(0.0, 0.0), mutation_sd=0.0), B))
    with pytest.raises(FoundersError, match=r"0/8 .*switched off here: a"):
        make_founders(RUN, SCHEMA, off)
    unset = [[born(0, 8, (0.0, 0.5))]]
    assert genes_of(make_founders(unset, SCHEMA, off), 0, 1) == [0.0]
