"""The claims of Paper I are judged as they were registered, and learners differ as its conditions say."""

import itertools
from typing import Any

import numpy as np
import pytest

from crcolony.experiments.framework.catalogue import summaries
from crcolony.experiments.framework.experiment import Plan, Row
from crcolony.experiments.mating_macro_actions import (
    COLUMNS,
    EXPERIMENT,
    MACRO,
    PLAIN,
    POINTS,
    RANDOM,
    REPEATS,
    SARSA,
    coarse_network,
    draw,
    fine_tiles,
    new_learner,
    run,
)
from crcolony.experiments.worlds.mating_pair import FACE, NOTHING, TAIL

CLAIMS = {claim.id: claim for claim in summaries()["mating-macro-actions"].claims}
NOISE = np.linspace(-0.5, 0.5, 10)


def verdict(claim: str, **means: float) -> str:
    """Return the verdict where matings are these, first and last."""
    conditions = {"plain": PLAIN, "macro": MACRO, "sarsa": SARSA, "random": RANDOM}
    rows: list[Row] = []
    for k, (name, condition) in enumerate(conditions.items()):
        for seed, noise in enumerate(np.roll(NOISE, k)):
            value = means.get(name, 5.0) + float(noise)
            rows.append(
                {
                    "condition": condition,
                    "seed": seed,
                    "matings_first": value,
                    "matings_last": value,
                }
            )
    return EXPERIMENT.measures[claim](CLAIMS[claim], rows).verdict


@pytest.mark.parametrize("claim", ["help-first", "help-last"])
def test_macro_actions_help_if_there_are_clearly_more_matings(claim: str) -> None:
    """A few more are help in part, and as many are none."""
    for macro, expected in ((10.0, "reproduced"), (5.9, "partly"), (5.0, "not"), (2.0, "not")):
        assert verdict(claim, macro=macro) == expected


def test_no_behaviour_is_to_be_near_random() -> None:
    """Twice as many matings are behaviour."""
    for plain, expected in ((5.0, "reproduced"), (9.9, "partly"), (20.0, "not")):
        assert verdict("nothing-without", plain=plain) == expected


def test_macro_actions_are_not_needed_where_others_mate_more() -> None:
    """As many matings are not more."""
    for sarsa, expected in ((8.0, "reproduced"), (5.0, "not")):
        assert verdict("not-needed", sarsa=sarsa) == expected


def test_features_tell_apart_what_is_seen() -> None:
    """Nothing, a tail and a face have no feature in common, in the network and in the tiles."""
    network, tiles = coarse_network(), fine_tiles()
    for features in (network, tiles):
        active: list[set[Any]] = []
        for kind in (NOTHING, TAIL, FACE):
            indices, values = features(np.array([kind, 0.8, 0.1]))
            active.append(set(indices[values > 1e-9]))
        assert all(one.isdisjoint(two) for one, two in itertools.combinations(active, 2))
    assert network.size == 31


def test_a_macro_action_is_repeated() -> None:
    """With them a robot changes its action after three steps at the earliest; without, at any time."""
    state = np.array([FACE, 0.8, 0.1])
    draws = np.random.default_rng(1).random(100)
    for condition, least in ((MACRO, REPEATS), (PLAIN, 1)):
        learner, set_temperature = new_learner(condition, 9)
        set_temperature(1e6)
        actions = [learner.start(state, 0.5), *(learner.step(0.0, state, False, u) for u in draws)]
        changes = np.flatnonzero(np.diff(actions)) + 1
        assert np.diff(changes, prepend=0).min() == least
        assert np.all(changes % least == 0)


@pytest.mark.parametrize("condition", [PLAIN, MACRO, SARSA, RANDOM])
def test_a_run_has_its_curve_and_is_the_same_for_the_same_seed(condition: str) -> None:
    """Both quarters are means of its points."""
    rows = run(condition, 3, 400)
    assert rows == run(condition, 3, 400)
    assert all(set(row) <= COLUMNS.keys() for row in rows)
    assert [row["steps"] for row in rows[:-1]] == [50 * (k + 1) for k in range(POINTS)]
    last = np.mean([float(row["matings"]) for row in rows[-3:-1]])
    assert rows[-1]["matings_last"] == pytest.approx(last)


def test_the_figure_has_a_curve_of_every_condition() -> None:
    """With the middle half of the seeds."""
    rows: list[Row] = [
        {"condition": job.condition, "seed": job.seed, "steps": steps, "matings": 1.0}
        for job in EXPERIMENT.jobs(Plan([1, 2], is_quick=True))
        for steps in (10, 20)
    ]
    assert len(draw(rows).axes[0].lines) == 4
