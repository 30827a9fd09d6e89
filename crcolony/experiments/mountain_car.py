"""Co-evolution of shaping rewards and meta-parameters on the mountain car (Paper IV, thesis 5.4).

Three kinds of learners by Sarsa(lambda) with the same tile coding: with potential and meta-parameters that evolved,
with meta-parameters that evolved alone, and with the best of a textbook's settings, which is greedy and undiscounted.
Five genes have converged after a few dozen generations, so that meta-parameters alone have fewer of them. Each is
measured in lives that played no part in choosing it. And there is OMPAC, in which learners compete and go on learning:
it is measured as it learns. But for the textbook's, learners of a seed begin with the same meta-parameters.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row
from crcolony.experiments.mountain_car_claims import (
    BOTH,
    LAST,
    MEASURES,
    META_ALONE,
    OMPAC,
    TEXTBOOK,
)
from crcolony.experiments.mountain_car_figure import draw
from crcolony.experiments.worlds.mountain_car_competition import CarCompetition
from crcolony.experiments.worlds.mountain_car_evolution import (
    CarEvolution,
    CarSettings,
    Generation,
    live_often,
)
from crcolony.experiments.worlds.mountain_car_genes import (
    ALPHA,
    CENTRES,
    GAMMA,
    LAMBDA,
    META_PARAMETERS,
    POTENTIAL,
    WEIGHTS,
    car_schema,
)
from crcolony.experiments.worlds.mountain_car_lives import Driver, live_all, new_driver
from crcolony.randomness import Stream, new_streams

LIVES, EPISODES = 50, 200
"""Lives in which a learner is measured, and their episodes."""
CURVE_EPISODES = 120
"""Episodes of a learning curve in the rows."""
WINDOW, ROBUST_STEPS = 10, 110
"""A policy is robust when so many episodes in a row take so many steps on average; the best takes 98."""
TEXTBOOK_ALPHAS = (0.3, 0.5, 0.9, 1.3, 1.7)
TEXTBOOK_LAMBDAS = (0.0, 0.5, 0.95, 0.99)
"""Settings of Sutton and Barto's figure 12.10; alpha is for all tilings together."""
TEXTBOOK_LIVES, TEXTBOOK_EPISODES = 10, 50
"""By how many steps in these the best of them is chosen."""
_SETTINGS = {
    True: CarSettings(individuals=50, generations=300, episodes=20),
    False: CarSettings(individuals=50, generations=40, episodes=20),
}
"""With shaping, and without"""
_COMPETITION = CarSettings(individuals=50, generations=20, episodes=10)
"""Instances, competitions and episodes between them: a quarter of what meta-parameters alone evolve in."""
_QUICK, _QUICK_LIVES = CarSettings(individuals=10, generations=4, episodes=3), 2
_QUICK_COMPETITION = CarSettings(individuals=3, generations=12, episodes=10)
_NEWBORN_EPISODES = 20

COLUMNS = {
    "generation": Column(
        "generation of these values of a population; of OMPAC, competitions before them",
        "generations",
    ),
    "steps_median": Column(
        "steps of an episode, mean over a life (of OMPAC: since the last competition), median over individuals",
        "steps",
    ),
    "steps_best": Column("the same of the individual with the fewest", "steps"),
    "temperature": Column("τ, mean over the episodes of a life, median over individuals", "steps"),
    **{f"{name}_mean": Column(f"gene {name}, mean over individuals") for name in META_PARAMETERS},
    "episode": Column("episode of a life, from 1, of these values of a learning curve", "episodes"),
    "steps": Column(
        f"steps of this episode, mean over {LIVES} lives of the chosen, or all instances of OMPAC",
        "steps",
    ),
    "founder_steps": Column("the same of the fittest of generation 0", "steps"),
    "first_steps": Column(
        f"steps of the first episode, mean over {LIVES} lives, or instances", "steps"
    ),
    "early_steps": Column("steps of an episode, mean over the first 20", "steps"),
    "late_steps": Column("the same, last 50 of 200", "steps"),
    "robust_episode": Column(
        f"the first of {WINDOW} episodes of at most {ROBUST_STEPS} steps on average; {EPISODES}: none",
        "episodes",
    ),
    "chosen_steps": Column(
        "steps of an episode, mean of the lives by which it was chosen", "steps"
    ),
    "car_steps": Column("steps of all lives of the evolutionary run", "steps"),
    "newborn_steps": Column(
        f"steps of an episode, mean over a life of {_NEWBORN_EPISODES} episodes that begins with nothing learnt,"
        " and the last meta-parameters, median over individuals",
        "steps",
    ),
    "alpha_first": Column("gene alpha, mean over instances, in the first episodes"),
    "alpha_end": Column("the same, in the last episodes"),
    "temperature_first": Column("temperature, generation 0", "steps"),
    "temperature_early": Column("temperature after a tenth of the generations", "steps"),
    "lambda_end": Column(f"gene lambda, mean over individuals and the last {LAST} generations"),
    **{name: Column(f"gene {name} of the chosen") for name in META_PARAMETERS},
    **{
        f"potential_{k}": Column(
            f"potential of the chosen, weight {k}: position {k // CENTRES[1]}, velocity {k % CENTRES[1]}",
            "steps",
        )
        for k in range(WEIGHTS)
    },
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each kind of learner for each seed."""
    jobs = []
    lives = _QUICK_LIVES if plan.is_quick else LIVES
    for seed in plan.seeds:
        for condition, shaping in ((BOTH, True), (META_ALONE, False)):
            settings = _QUICK if plan.is_quick else _SETTINGS[shaping]
            jobs.append(
                Job(condition, seed, partial(run_evolution, shaping, settings, lives, seed))
            )
        jobs.append(Job(TEXTBOOK, seed, partial(run_textbook, lives, seed)))
        competition = _QUICK_COMPETITION if plan.is_quick else _COMPETITION
        jobs.append(Job(OMPAC, seed, partial(run_competition, competition, seed)))
    return jobs


def run_evolution(shaping: bool, settings: CarSettings, lives: int, seed: int) -> list[Row]:
    """Let learners evolve; return rows of generations, of curves over so many lives, and of what came of it."""
    driver, stream = new_driver(), new_streams(seed, (5, int(shaping)), 1)[0]
    evolution = CarEvolution(settings, shaping, driver, np.random.default_rng(seed), stream)
    lived = evolution.advance()
    founder = live_often(driver, lived.fittest, lives, EPISODES, stream)
    generations, car_steps = [_generation_row(0, lived)], int(lived.steps.sum())
    for number in range(1, settings.generations):
        lived = evolution.advance()
        generations.append(_generation_row(number, lived))
        car_steps += int(lived.steps.sum())
    best, chosen_steps = evolution.choose_best(lived)
    steps = live_often(driver, best, lives, EPISODES, stream)
    early = settings.generations // 10
    found: Row = {
        **_measures(steps),
        "chosen_steps": chosen_steps,
        "car_steps": car_steps,
        "temperature_first": generations[0]["temperature"],
        "temperature_early": generations[early]["temperature"],
        "lambda_end": float(np.mean([float(row["lambda_mean"]) for row in generations[-LAST:]])),
        "newborn_steps": generations[-1]["steps_median"],
        **_genes(best, shaping),
    }
    return [*generations, *_curve(steps, founder), found]


def run_competition(settings: CarSettings, seed: int) -> list[Row]:
    """Let learners compete; return rows of the times between competitions, of the learning curve of all, and of how
    it goes."""
    stream = new_streams(seed, (5, 3), 1)[0]
    competition = CarCompetition(settings, np.random.default_rng(seed), stream)
    lived = [competition.advance() for _ in range(settings.generations)]
    steps = np.concatenate([one.steps for one in lived], axis=1)
    last = lived[-1].genotypes
    newborn = np.zeros((settings.individuals, _NEWBORN_EPISODES), dtype=np.int64)
    live_all(new_driver(), last, stream, newborn)
    found: Row = {
        **_measures(steps),
        "car_steps": int(steps.sum()),
        "newborn_steps": float(np.median(newborn.mean(axis=1))),
        "alpha_first": float(lived[0].genotypes[:, ALPHA].mean()),
        "alpha_end": float(last[:, ALPHA].mean()),
    }
    generations = [_generation_row(number, one) for number, one in enumerate(lived)]
    return [*generations, *_curve(steps), found]


def run_textbook(lives: int, seed: int) -> list[Row]:
    """Choose the best of a textbook's settings; return rows of its learning curve, and of how it does."""
    driver, stream = new_driver(), new_streams(seed, (5, 2), 1)[0]
    best, chosen_steps = min(
        ((genes, _mean_steps(driver, genes, stream)) for genes in _textbook()),
        key=lambda found: found[1],
    )
    steps = live_often(driver, best, lives, EPISODES, stream)
    found: Row = {**_measures(steps), "chosen_steps": chosen_steps, **_genes(best, False)}
    return [*_curve(steps), found]


def _textbook() -> Iterator[FloatArray]:
    for alpha in TEXTBOOK_ALPHAS:
        for lambda_ in TEXTBOOK_LAMBDAS:
            genes = np.zeros(len(car_schema(False)))
            genes[[ALPHA, GAMMA, LAMBDA]] = alpha, 1.0, lambda_
            yield genes


def _mean_steps(driver: Driver, genes: FloatArray, stream: Stream) -> float:
    return float(live_often(driver, genes, TEXTBOOK_LIVES, TEXTBOOK_EPISODES, stream).mean())


def first_robust_episode(curve: FloatArray) -> int:
    """Return the first, counted from 1, of the first episodes in a row that are robust; all if there are none."""
    means = np.convolve(curve, np.full(WINDOW, 1.0 / WINDOW), mode="valid")
    robust = np.flatnonzero(means <= ROBUST_STEPS)
    return int(robust[0]) + 1 if robust.size else curve.size


def _measures(steps: IntArray) -> Row:
    """Return how a learner does, from the steps (lives, episodes) of its lives."""
    curve = steps.mean(axis=0)
    return {
        "first_steps": float(curve[0]),
        "early_steps": float(curve[:20].mean()),
        "late_steps": float(curve[-50:].mean()),
        "robust_episode": first_robust_episode(curve),
    }


def _generation_row(number: int, lived: Generation) -> Row:
    means = lived.genotypes[:, :POTENTIAL].mean(axis=0)
    return {
        "generation": number,
        "steps_median": float(np.median(lived.mean_steps)),
        "steps_best": float(lived.mean_steps.min()),
        "temperature": float(np.median(lived.temperatures)),
        **{f"{name}_mean": float(mean) for name, mean in zip(META_PARAMETERS, means, strict=True)},
    }


def _curve(steps: IntArray, founder: IntArray | None = None) -> list[Row]:
    rows: list[Row] = [
        {"episode": k + 1, "steps": float(mean)}
        for k, mean in enumerate(steps.mean(axis=0)[:CURVE_EPISODES])
    ]
    if founder is not None:
        for row, mean in zip(rows, founder.mean(axis=0), strict=False):
            row["founder_steps"] = float(mean)
    return rows


def _genes(genes: FloatArray, shaping: bool) -> Row:
    row: Row = {
        name: float(gene) for name, gene in zip(META_PARAMETERS, genes[:POTENTIAL], strict=True)
    }
    if shaping:
        row |= {f"potential_{k}": float(weight) for k, weight in enumerate(genes[POTENTIAL:])}
    return row


EXPERIMENT = Experiment("mountain-car", COLUMNS, plan_jobs, MEASURES, draw)
