"""Stability of populations that mate by proximity: the regimes of arXiv 2604.26822, and selection by mating (Paper
III).

The paper concludes that only deterministic selection by fitness is stable. Its regimes are rebuilt in a plane, see
`population_regimes.py` for what is taken over and what is not. Where a regime has a number that could be tuned to
balance births and deaths, a lifespan or the number of zones, that number is swept: stable means stable somewhere.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from crcolony.experiments.colonies.population_regimes import (
    ZONES,
    Course,
    deaths_by_age,
    deaths_by_density,
    deaths_by_energy,
    deaths_by_fitness,
    run_colony_regime,
    run_free,
)
from crcolony.experiments.framework.experiment import (
    Column,
    Experiment,
    Job,
    Measured,
    Plan,
    Row,
    values_of,
    verdict_of,
)
from crcolony.experiments.framework.measured_share import measured_share, share_interval
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import LEVEL, mean_interval, one_sided_p

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GENERATIONS = 50
_QUICK_GENERATIONS = 4
LIFESPANS = (2.0, 2.25, 2.5, 3.0, 4.0)
ZONE_COUNTS = (2, 4, 6, 8, 12, 16, 24)
ENDS = ("completed", "extinct", "exploded")
AGES = tuple(f"age-{lifespan:g}" for lifespan in LIFESPANS)
ENERGIES = tuple(f"energy-{zones}" for zones in ZONE_COUNTS)
REGIMES = ("fitness", *AGES, *ENERGIES, "density", "colony")

COLUMNS = {
    **{end: Column(f"1 if the run ended so, else 0: {end}") for end in ENDS},
    "generations": Column("generations until the end", "generations"),
    "size_end": Column(
        "individuals in the last generation; of the colony, agents at a time that live to its end"
    ),
    "matings_first": Column("matings of an individual, first generation", "matings"),
    "matings_last": Column("matings of an individual, last generation", "matings"),
    "matings_slope": Column("slope of the matings of an individual", "matings a generation"),
    "skill_last": Column("mean of the gene skill, last generation, 0 to 1"),
    "skill_slope": Column("slope of the mean of the gene skill", "1/generation"),
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each regime for each seed."""
    generations = _QUICK_GENERATIONS if plan.is_quick else GENERATIONS
    return [
        Job(regime, seed, partial(run, regime, seed, generations))
        for seed in plan.seeds
        for regime in REGIMES
    ]


def run(regime: str, seed: int, generations: int) -> Row:
    """Run a population in a regime until it has lived so many generations, has died out, or explodes."""
    course = live_in(regime, generations, np.random.default_rng(seed))
    row: Row = {end: int(course.end == end) for end in ENDS}
    return row | {
        "generations": len(course.sizes),
        "size_end": course.sizes[-1],
        "matings_first": course.matings[0],
        "matings_last": course.matings[-1],
        "matings_slope": _slope(course.matings),
        "skill_last": course.skills[-1],
        "skill_slope": _slope(course.skills),
    }


def live_in(regime: str, generations: int, rng: np.random.Generator) -> Course:
    """Return the course of a population in a regime."""
    name, _, number = regime.partition("-")
    match name:
        case "fitness":
            return run_free(deaths_by_fitness, False, ZONES, generations, rng)
        case "age":
            return run_free(deaths_by_age(float(number)), False, ZONES, generations, rng)
        case "energy":
            return run_free(deaths_by_energy, True, int(number), generations, rng)
        case "density":
            return run_free(deaths_by_density, False, ZONES, generations, rng)
    assert name == "colony", regime
    return run_colony_regime(ZONES, generations, rng)


def _slope(values: Sequence[float]) -> float:
    """Return the slope of a line through values, a generation each; NaN of fewer than three."""
    if len(values) < 3:
        return float("nan")
    return float(np.polyfit(np.arange(len(values)), values, 1)[0])


def _completes(regime: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    return measured_share(claim, values_of(rows, "completed", regime) > 0.0)


def _never_completes(
    regimes: Sequence[str], flips: bool, claim: Claim, rows: Sequence[Row]
) -> Measured:
    """Measure the regime of a sweep in which most runs complete; one that `flips` has both other ends at its ends."""
    most = max(regimes, key=lambda regime: values_of(rows, "completed", regime).mean())
    completed = values_of(rows, "completed", most)
    found = stats.binomtest(int(completed.sum()), completed.size, 0.5, "less")
    p = min(1.0, float(found.pvalue) * len(regimes))
    share = share_interval(completed > 0.0)
    first, last = (
        {end: values_of(rows, end, regime).mean() for end in ENDS}
        for regime in (regimes[0], regimes[-1])
    )
    is_flipped = first["extinct"] > first["exploded"] and last["exploded"] > last["extinct"]
    return Measured(
        estimate=share.estimate,
        low=share.low,
        high=share.high,
        statistic=f"most in {most}; {regimes[0]}: {first['extinct']:.0%} extinct, {first['exploded']:.0%}"
        f" exploded; {regimes[-1]}: {last['extinct']:.0%}, {last['exploded']:.0%}; exact binomial test",
        p=p,
        runs=len(regimes) * completed.size,
        verdict=verdict_of(
            share.estimate <= claim.threshold and p < LEVEL and (is_flipped or not flips),
            share.estimate <= claim.threshold,
        ),
    )


def _slope_of_matings(regime: str, sign: int, claim: Claim, rows: Sequence[Row]) -> Measured:
    slopes = values_of(rows, "matings_slope", regime)
    slopes = slopes[~np.isnan(slopes)]
    mean = mean_interval(slopes)
    p = one_sided_p(sign * slopes, sign * claim.threshold, "greater")
    skill = mean_interval(values_of(rows, "skill_slope", regime)).estimate
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"one-sided t-test, {slopes.size} runs; the gene skill moves by {skill:+.2g} a generation",
        p=p,
        runs=slopes.size,
        verdict=verdict_of(sign * (mean.estimate - claim.threshold) > 0.0 and p < LEVEL),
    )


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw how the runs of each regime end, and the slopes of those that complete."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.6)
    ends, slopes = figure.subplots(1, 2, width_ratios=(2, 1))
    base = np.zeros(len(REGIMES))
    for end, color in zip(ENDS, (2, 3, 1), strict=True):
        shares = np.array([values_of(rows, end, regime).mean() for regime in REGIMES])
        ends.bar(range(len(REGIMES)), shares, bottom=base, label=end, color=LINES[color]["color"])
        base += shares
    ends.set_xticks(range(len(REGIMES)), REGIMES, rotation=90)
    ends.set_ylabel("share of runs")
    ends.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(ENDS))
    stable = ("fitness", "density", "colony")
    for x, regime in enumerate(stable):
        values = values_of(rows, "matings_slope", regime)
        jitter = np.linspace(-0.2, 0.2, values.size)
        slopes.plot(x + jitter, values, "o", markersize=2, color=LINES[x]["color"])
    slopes.axhline(0.0, color="black", linewidth=0.5)
    slopes.set_xticks(range(len(stable)), stable, rotation=90)
    slopes.set_ylabel("slope of matings, 1/generation")
    return figure


EXPERIMENT = Experiment(
    name="stability",
    columns=COLUMNS,
    jobs=plan_jobs,
    measures={
        "fitness-stable": partial(_completes, "fitness"),
        "age-unstable": partial(_never_completes, AGES, False),
        "energy-flips": partial(_never_completes, ENERGIES, True),
        "density-completes": partial(_completes, "density"),
        "density-declines": partial(_slope_of_matings, "density", -1),
        "colony-completes": partial(_completes, "colony"),
        "colony-improves": partial(_slope_of_matings, "colony", 1),
    },
    draw=draw,
)
