"""Navigation with a fitness (Floreano and Mondada; thesis 4.2): a perceptron drives a Khepera, and then a Koala.

It is the way of evolutionary robotics from which embodied evolution departs: one individual at a time in the robot, a
fitness that is computed by those who know the task, and selection from outside.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row, values_of
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.navigation_claims import (
    KHEPERA,
    KOALA,
    LARGE_WEIGHTS,
    MEASURES,
    MOVED,
)
from crcolony.experiments.worlds.looping_maze import khepera, koala
from crcolony.experiments.worlds.navigator import FIRST_WEIGHTS, INDIVIDUALS, Navigation, live_often
from crcolony.randomness import new_streams

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GENERATIONS = 150
_QUICK_GENERATIONS = 3
EXAMINED = 50
"""The generation whose best individual is looked at"""
_LIVES, _ACTIONS = 20, 240
"""In which it is: of 72 s each"""
_EVOLUTION, _EXAMINATION = 1, 2
"""Names of random streams"""

COLUMNS = {
    "generation": Column("counted from 0", "generations"),
    "best": Column(f"fitness (eq. 4.2) of the best of {INDIVIDUALS} individuals, 0 to 1"),
    "mean": Column("mean fitness of all individuals, 0 to 1"),
    "fitness": Column(f"fitness of the best of generation {EXAMINED}, mean of {_LIVES} more lives"),
    "speed": Column("its mean speed, -1 to 1; above 0 where it has more sensors", "full speed"),
    "touched": Column("share of its sensorimotor loops in which a wall was in the way"),
    "laps": Column(f"laps that it drives in {_ACTIONS} sensorimotor loops of 0.3 s", "laps"),
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run for each seed: in the small body alone, moved to the large one, and with larger first weights."""
    generations = _QUICK_GENERATIONS if plan.is_quick else GENERATIONS
    moved = generations // 2 if plan.is_quick else MOVED
    examined = 1 if plan.is_quick else EXAMINED
    runs = {
        KHEPERA: partial(run, generations, generations, examined),
        KOALA: partial(run, moved, generations, examined),
        LARGE_WEIGHTS: partial(
            run, generations, generations, examined, first_weights=2.0 * FIRST_WEIGHTS
        ),
    }
    return [
        Job(condition, seed, partial(one, seed))
        for seed in plan.seeds
        for condition, one in runs.items()
    ]


def run(
    moved: int, generations: int, examined: int, seed: int, *, first_weights: float = FIRST_WEIGHTS
) -> list[Row]:
    """Let perceptrons evolve, from generation `moved` on in the large body; return a row a generation.

    The best individual of generation `examined` then drives in the small body, which gives the last row.
    """
    stream = new_streams(seed, (_EVOLUTION,), 1)[0]
    navigation = Navigation(np.random.default_rng(seed), stream, first_weights)
    small, large = khepera(), koala()
    rows: list[Row] = []
    for generation in range(generations):
        fitness = navigation.evaluate(small if generation < moved else large)
        rows.append(
            {
                "generation": generation,
                "best": float(fitness.max()),
                "mean": float(fitness.mean()),
            }
        )
        if generation == examined:
            best = navigation.genotypes[int(np.argmax(fitness))]
        navigation.breed(fitness)
    lives = live_often(small, best, _LIVES, _ACTIONS, new_streams(seed, (_EXAMINATION,), 1)[0])
    names = ("fitness", "speed", "touched", "laps")
    rows.append({name: float(np.mean([getattr(life, name) for life in lives])) for name in names})
    return rows


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw the fitness by generation, and what the best of generation 50 do, a point a run."""
    from crcolony.results.plots.style import LINES, PAGE_IN, format_axes, new_figure

    figure = new_figure(PAGE_IN, 2.4)
    best, mean, examined = figure.subplots(1, 3)
    conditions = (KHEPERA, KOALA, LARGE_WEIGHTS)
    for line, condition in zip(LINES, conditions, strict=False):
        for axes, column in ((best, "best"), (mean, "mean")):
            points, quartiles = quartiles_of(rows, condition, "generation", column)
            draw_quartiles(axes, points, quartiles, condition, line)
    for axes, title in ((best, "best individual"), (mean, "mean of the population")):
        format_axes(axes, title, top=1.0)
        axes.set(xlabel="generation", ylabel="fitness (eq. 4.2)")
    best.legend()
    for line, condition in zip((LINES[0], LINES[2]), (KHEPERA, LARGE_WEIGHTS), strict=True):
        laps, fitness = (values_of(rows, name, condition) for name in ("laps", "fitness"))
        examined.plot(laps, fitness, "o", color=line["color"], markersize=3, label=condition)
    format_axes(examined, "best of generation 50", top=1.0)
    examined.set(xlabel="laps in 72 s", ylabel="fitness (eq. 4.2)")
    return figure


EXPERIMENT = Experiment("navigation", COLUMNS, plan_jobs, MEASURES, draw)
