"""Other schemes of the field as ways to reproduce, on the same foraging-and-mating task, with the same robot-steps.

The schemes and where they differ from their originals: docs/schemes.md. Runs of one seed begin in the same arena with
the same founders. In the Lamarckian schemes agents begin a generation with what others have learnt; therefore all live
one generation more, in which nobody has learnt anything.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, get_args

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config, load
from crcolony.experiments.colonies.colony_run import run_colony
from crcolony.experiments.framework.experiment import (
    Column,
    Experiment,
    Job,
    Measured,
    Plan,
    Row,
    pairs_of,
    values_of,
    verdict_of,
)
from crcolony.experiments.framework.measured_pairs import measured_pairs, measured_ratio
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    mean_interval,
    one_sided_p,
)
from crcolony.experiments.worlds.phototaxis import HAND_DESIGNED, ROBOTS, random_weights, simulate
from crcolony.results.generation_table import LAST_GENERATIONS
from crcolony.robot.settings import Selection
from crcolony.robot.weight_rows import forget

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SELECTIONS: tuple[Selection, ...] = get_args(Selection)
GENERATIONS = 100
_QUICK = ("generations=3", "life.agents=4", "life.slices=2", "life.slice_steps=100")
_HOUR_STEPS = 36_000
_QUICK_STEPS = 1500
EVOLVED, RANDOM = "phototaxis", "phototaxis-random"
_CHUNK_TICKS = 10_000
_END = "mean of the last 10 generations"
_FIFTHS = 5

COLUMNS = {
    "energy_weighted_matings_end": Column(f"the robot's energy summed over matings, {_END}"),
    "energy_weighted_matings_newborn": Column("the same, in a generation that has learnt nothing"),
    "matings_end": Column(f"matings of an agent, {_END}", "matings"),
    "captures_end": Column(f"captured batteries of an agent, {_END}", "batteries"),
    "captures_newborn": Column("the same, in a generation that has learnt nothing", "batteries"),
    "starved_end": Column(f"share of agents that starved, {_END}"),
    "robot_steps": Column("control steps of all robots until the end", "steps"),
    "history_hash": Column("hash of all births, matings, deaths and turnovers"),
    "visits_first": Column("visits of the lamp by a robot, first fifth of an hour", "1/min"),
    "visits_last": Column("visits of the lamp by a robot, last fifth of an hour", "1/min"),
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each scheme, and of each controller in the pen with the lamp, for each seed."""
    quick = _QUICK if plan.is_quick else (f"generations={GENERATIONS}",)
    steps = _QUICK_STEPS if plan.is_quick else _HOUR_STEPS
    jobs = []
    for seed in plan.seeds:
        for selection in SELECTIONS:
            config = load(None, [f"seed={seed}", f"selection={selection}", *quick])
            jobs.append(Job(selection, seed, partial(run_scheme, config)))
        for controller in (EVOLVED, RANDOM, *map(_by_hand, HAND_DESIGNED)):
            jobs.append(Job(controller, seed, partial(run_phototaxis, controller, seed, steps)))
    return jobs


def run_scheme(config: Config) -> Row:
    """Run a colony, and one generation more in which nobody has learnt anything."""
    lived = run_colony(config)
    colony, last = lived.colony, lived.rows[-LAST_GENERATIONS:]
    row: Row = {
        f"{name}_end": float(np.mean([generation[name] for generation in last]))
        for name in ("energy_weighted_matings", "matings", "captures", "starved")
    }
    row["robot_steps"] = colony.tick * config.robots
    row["history_hash"] = lived.history_hash
    for robot in colony.robots:
        forget(colony.batch, robot.row)
    while colony.generation == config.generations:
        colony.run(_CHUNK_TICKS)
    for name in ("energy_weighted_matings", "captures"):
        row[f"{name}_newborn"] = colony.summary[name]
    return row


def run_phototaxis(controller: str, seed: int, steps: int) -> Row:
    """Let robots look for a lamp: random ones whose weights evolve or stay, or hand-designed ones."""
    rng = np.random.default_rng(seed)
    weights = random_weights(rng)
    if controller not in (EVOLVED, RANDOM):
        weights = np.tile(HAND_DESIGNED[controller.removeprefix(_by_hand(""))], (ROBOTS, 1))
    reached = simulate(weights, controller == EVOLVED, steps, rng)
    fifths = reached.reshape(_FIFTHS, -1).mean(axis=1) / ROBOTS * 600.0  # steps in a minute
    return {"visits_first": float(fifths[0]), "visits_last": float(fifths[-1])}


def _by_hand(name: str) -> str:
    return f"phototaxis-{name}"


def _ahead(one: str, other: str, column: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure the ratio of a column of one condition over another."""
    own, others = pairs_of(rows, column, one, other)
    return measured_ratio(
        claim,
        own,
        others,
        statistic=f"{own.mean():.3g} over {others.mean():.3g}; one-sided paired t-test, {own.size} pairs",
    )


def _fed_better(claim: Claim, rows: Sequence[Row]) -> Measured:
    own, others = pairs_of(rows, "starved_end", "implicit", "medea")
    difference = mean_interval(own - others)
    p = one_sided_p(own - others, 0.0, "less")
    return measured_pairs(
        difference,
        own,
        others,
        statistic=f"{own.mean():.3g} less {others.mean():.3g}; one-sided paired t-test, {own.size} pairs",
        p=p,
        verdict=verdict_of(difference.estimate < claim.threshold and p < LEVEL),
    )


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw every run as a point: of each scheme matings, newborn matings and captures; of controllers their visits."""
    from crcolony.results.plots.style import PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.6)
    end, newborn, captures, visits = figure.subplots(1, 4)
    _draw_points(end, rows, "energy_weighted_matings_end", SELECTIONS)
    _draw_points(newborn, rows, "energy_weighted_matings_newborn", SELECTIONS)
    _draw_points(captures, rows, "captures_end", SELECTIONS)
    controllers = (EVOLVED, RANDOM, *map(_by_hand, HAND_DESIGNED))
    names = ("evolved", "random", *HAND_DESIGNED)
    _draw_points(visits, rows, "visits_last", controllers, names)
    end.set_ylabel("energy-weighted matings, end")
    newborn.set_ylabel("the same, nothing learnt")
    captures.set_ylabel("captures of an agent, end")
    visits.set_ylabel("visits of the lamp, 1/min")
    return figure


def _draw_points(
    axes: "Axes",
    rows: Sequence[Row],
    column: str,
    conditions: Sequence[str],
    names: Sequence[str] | None = None,
) -> None:
    from crcolony.results.plots.style import LINES

    for x, condition in enumerate(conditions):
        values: FloatArray = values_of(rows, column, condition)
        jitter = np.linspace(-0.2, 0.2, values.size)
        axes.plot(x + jitter, values, "o", markersize=2, color=LINES[x % len(LINES)]["color"])
    axes.set_xticks(range(len(conditions)), names or conditions, rotation=90)
    axes.set_ylim(bottom=0.0)


EXPERIMENT = Experiment(
    name="schemes",
    columns=COLUMNS,
    jobs=plan_jobs,
    measures={
        "ahead-of-pgta": partial(_ahead, "implicit", "pgta", "energy_weighted_matings_end"),
        "ahead-of-pega": partial(_ahead, "implicit", "pega", "energy_weighted_matings_end"),
        "ahead-of-medea": partial(_ahead, "implicit", "medea", "energy_weighted_matings_end"),
        "fed-better-than-medea": _fed_better,
        "learning-handed-down": partial(_ahead, "ompac", "implicit", "energy_weighted_matings_end"),
        "learning-ability": partial(_ahead, "implicit", "ompac", "energy_weighted_matings_newborn"),
        "pairwise-learning": partial(_ahead, "gpbt_pl", "implicit", "energy_weighted_matings_end"),
        "phototaxis-evolves": partial(_ahead, EVOLVED, RANDOM, "visits_last"),
        "beats-pivoting": partial(_ahead, EVOLVED, _by_hand("pivoting"), "visits_last"),
        "beats-turning": partial(_ahead, EVOLVED, _by_hand("turning"), "visits_last"),
    },
    draw=draw,
)
