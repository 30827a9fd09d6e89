"""The taxi of section 3.4.4: learning curves of flat Q-learning, MAXQ-Q, and MAXQ-Q with state abstraction.

Each learner drives in both reward conventions (see `worlds/taxi.py`), with Dietterich's meta-parameters. Those of flat
Q-learning are ours: alpha as with abstraction, the temperature cooled after every episode as Navigate's is.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.taxi_claims import (
    CONVENTIONS,
    EXAMPLE,
    IN_ADDITION,
    IN_PLACE,
    LEARNERS,
    MEASURES,
    condition_of,
)
from crcolony.experiments.worlds.taxi import RewardConvention, encode_uncompiled, start_states
from crcolony.experiments.worlds.taxi_learning import (
    EPISODES,
    Episodes,
    drive_greedily,
    flat_learner,
    learn_by_maxq,
    learn_by_q_learning,
    no_episodes,
)
from crcolony.experiments.worlds.taxi_optimum import drive_by_table, optimal_values
from crcolony.experiments.worlds.taxi_tasks import INITIAL_VALUE, dietterich_parameters, taxi_tasks
from crcolony.learning.maxq.maxq_learner import MaxqQ
from crcolony.randomness import Stream, new_streams

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEPS = 250_000
WINDOW = 5_000
"""Steps of a point of a learning curve"""
PERIODS = {
    "return_first": (0, 20_000),
    "return_settled": (40_000, 100_000),
    "return_middle": (80_000, 100_000),
    "return_ahead": (110_000, 130_000),
    "return_last": (230_000, 250_000),
}
"""Steps over which the columns that claims are about are means"""
FIGURE_3_1 = encode_uncompiled(cell=5, passenger=0, destination=3)
"""s1: the taxi one step south of R, where a passenger waits who wants to B"""

COLUMNS = {
    "steps": Column("steps so far, at a point of a learning curve", "steps"),
    "mean_return": Column(f"mean return of the episodes that ended in the last {WINDOW} steps"),
    "greedy_return": Column("mean return of greedy execution over all 300 starts, at this point"),
    "final_greedy_return": Column("the same after all steps"),
    "greedy_optimal": Column("share of the starts from which greedy execution is optimal then"),
    "entries": Column("values that are stored", "values"),
    "steps_to_optimum": Column(
        f"steps until a mean return of {WINDOW} steps is within 1 of the optimum, or all", "steps"
    ),
    **{
        name: Column(f"mean return of the episodes that ended in steps {first} to {last}")
        for name, (first, last) in PERIODS.items()
    },
    **{name: Column(f"of state s1 of figure 3.1: {term}") for name, (term, _) in EXAMPLE.items()},
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each learner in each convention for each seed; it takes a moment, so quick ones are as long."""
    return [
        Job(condition_of(learner, convention), seed, partial(run, learner, convention, seed))
        for seed in plan.seeds
        for convention in CONVENTIONS
        for learner in LEARNERS
    ]


def run(learner: str, convention: str, seed: int) -> list[Row]:
    """Let a learner drive; return its learning curve, and a row of what came of it."""
    rewards = RewardConvention(convention)
    taxi: _Driver = _Flat(rewards) if learner == "flat" else _Maxq(learner == "abstract", rewards)
    stream, episodes = new_streams(seed, (3,), 1)[0], no_episodes(STEPS)
    best = optimal_values(rewards)[start_states()]
    curve: list[Row] = []
    for end in range(WINDOW, STEPS + 1, WINDOW):
        taxi.learn(WINDOW, stream, episodes)
        point: Row = {"steps": end, "greedy_return": float(taxi.greedy_returns().mean())}
        curve.append(point | _mean_return("mean_return", episodes, end - WINDOW, end))
    near = [
        row["steps"] for row in curve if float(row.get("mean_return", -np.inf)) >= best.mean() - 1.0
    ]
    greedy = taxi.greedy_returns()
    found: Row = {
        "final_greedy_return": float(greedy.mean()),
        "greedy_optimal": float((greedy == best).mean()),
        "steps_to_optimum": near[0] if near else STEPS,
        **taxi.describe(),
    }
    for name, (first, last) in PERIODS.items():
        found |= _mean_return(name, episodes, first, last)
    return [*curve, found]


def _mean_return(name: str, episodes: Episodes, first: int, last: int) -> Row:
    """Return a column, unless no episode has ended in these steps."""
    count = int(episodes.counts[EPISODES])
    ends, returns = episodes.ends[:count], episodes.returns[:count]
    within = returns[(ends > first) & (ends <= last)]
    return {name: float(within.mean())} if within.size else {}


class _Driver(Protocol):
    """A learner that drives in one convention."""

    def learn(self, steps: int, stream: Stream, episodes: Episodes) -> None:
        """Drive for some steps."""

    def greedy_returns(self) -> FloatArray:
        """Return what greedy execution earns from each start."""

    def describe(self) -> Row:
        """Return how many values it stores, and what the example is worth to it, if that has terms."""


class _Flat:
    """Flat Q-learning."""

    def __init__(self, convention: RewardConvention) -> None:
        self._convention = convention
        self._learner = flat_learner(0.25, 1.0, 50.0, 0.9879, INITIAL_VALUE)

    def learn(self, steps: int, stream: Stream, episodes: Episodes) -> None:
        in_addition = self._convention.is_in_addition
        learn_by_q_learning(self._learner, start_states(), in_addition, steps, stream, episodes)

    def greedy_returns(self) -> FloatArray:
        return drive_by_table(self._learner.q, start_states(), self._convention)

    def describe(self) -> Row:
        return {"entries": self._learner.q.size}


class _Maxq:
    """MAXQ-Q, with state abstraction or without."""

    def __init__(self, is_abstract: bool, convention: RewardConvention) -> None:
        self._in_addition = convention.is_in_addition
        parameters = dietterich_parameters(is_abstract)
        self._maxq = MaxqQ(
            taxi_tasks(is_abstract), parameters=parameters, initial_value=INITIAL_VALUE
        )

    def learn(self, steps: int, stream: Stream, episodes: Episodes) -> None:
        learner = self._maxq.learner
        learn_by_maxq(learner, start_states(), self._in_addition, steps, stream, episodes)

    def greedy_returns(self) -> FloatArray:
        returns = np.zeros(start_states().size)
        graph, tables, *_ = self._maxq.learner
        drive_greedily(graph, tables, start_states(), self._in_addition, returns)
        return returns

    def describe(self) -> Row:
        terms = {"V(Root)": self._maxq.value(FIGURE_3_1)} | dict(
            self._maxq.decomposition(FIGURE_3_1)
        )
        example: Row = {name: terms[term] for name, (term, _) in EXAMPLE.items() if term in terms}
        return {"entries": self._maxq.sizes.total} | example


_PREPOSITIONS = {IN_PLACE: "of", IN_ADDITION: "to"}


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw learning curves, medians over seeds with the middle half, a panel for each convention."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.6)
    panels = figure.subplots(1, 2, sharey=True)
    for panel, convention in zip(panels, CONVENTIONS, strict=True):
        for line, (learner, label) in zip(LINES, LEARNERS.items(), strict=False):
            condition = condition_of(learner, convention)
            steps, returns = quartiles_of(rows, condition, "steps", "mean_return")
            draw_quartiles(panel, steps / 1000.0, returns, label, line)
        best = optimal_values(RewardConvention(convention))[start_states()]
        panel.axhline(best.mean(), color="0.5", linewidth=0.8, linestyle=":")
        title = f"20 {convention} {_PREPOSITIONS[convention]} the cost of the last step"
        panel.set(xlabel="thousand steps", ylim=(-150.0, 15.0), title=title)
    panels[0].set_ylabel("return of an episode")
    panels[0].legend()
    return figure


EXPERIMENT = Experiment("taxi", COLUMNS, plan_jobs, MEASURES, draw)
