"""Two robots learn to mate (Paper I, thesis 5.1), with macro actions on a coarse RBF network, or without on fine tiles.

Each robot has a learner of its own and is a part of the other's environment. Rewards, discount, traces, learning rate
and temperature are the same whatever the learner is.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.framework.experiment import (
    Column,
    Experiment,
    Job,
    Measured,
    Plan,
    Row,
    pairs_of,
    verdict_of,
)
from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import LEVEL, ratio_interval
from crcolony.experiments.worlds.mating_pair import (
    FACE,
    HIGH,
    KINDS,
    LOW,
    NOTHING,
    TAIL,
    MatingPair,
)
from crcolony.learning.features import NormalizedRBF, TileCoding, uniform_offsets
from crcolony.learning.options import OptionLearner, macro_action
from crcolony.learning.sarsa_learner import SarsaLambda
from crcolony.learning.watkins import WatkinsQLambda

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEPS, QUICK_STEPS = 40_000, 2_000
POINTS = 8
"""Of a learning curve; the first and the last quarter of them are what claims are about"""

REPEATS = 3
"""Control steps of a macro action: 0.6 s"""
ALPHA, GAMMA, LAMBDA = 0.3, 0.97, 0.7
TEMPERATURE, COOLING = 0.05, 0.02
"""tau in the first episode, and k of its decay tau / (1 + k t) over episodes"""
_DISTANCES_M = np.linspace(0.2, 1.4, 3)
_BEARINGS_RAD = np.linspace(LOW[2], HIGH[2], 5)
_APART = 0.1
"""Width of a basis function along what is seen: those of another kind do not respond"""
TILINGS, DISTANCE_TILES, BEARING_TILES = 7, 7, 13
"""As those of the default colony"""

PLAIN, MACRO, SARSA, RANDOM = (
    "Q(λ), RBF",
    "Q(λ), RBF, macro actions",
    "Sarsa(λ), tiles",
    "at random",
)

COLUMNS = {
    "steps": Column("control steps so far, at a point of a learning curve", "steps"),
    "matings": Column("matings in a thousand steps, since the last point", "1/1000 steps"),
    "matings_first": Column("matings in a thousand steps, first quarter", "1/1000 steps"),
    "matings_last": Column("matings in a thousand steps, last quarter", "1/1000 steps"),
}


class Learner(Protocol):
    """What drives a robot: called once a control step."""

    def start(self, state: FloatArray, u: float) -> int:
        """Start an episode; return the first primitive action."""

    def step(self, reward: float, state: FloatArray, terminal: bool, u: float) -> int:
        """Learn; return the next primitive action."""


class _AtRandom:
    """Robots that learn nothing, to compare with."""

    temperature = 0.0

    def __init__(self, actions: int) -> None:
        self._actions = actions

    def start(self, state: FloatArray, u: float) -> int:
        return int(u * self._actions)

    def step(self, reward: float, state: FloatArray, terminal: bool, u: float) -> int:
        return int(u * self._actions)


def coarse_network() -> NormalizedRBF:
    """Return basis functions over distance and bearing of a face, and of a tail lamp, and one where nothing is seen."""
    seen = [(kind, d, b) for kind in (TAIL, FACE) for d in _DISTANCES_M for b in _BEARINGS_RAD]
    widths = _APART, _DISTANCES_M[1] - _DISTANCES_M[0], _BEARINGS_RAD[1] - _BEARINGS_RAD[0]
    centres = np.array([(NOTHING, 0.0, 0.0), *seen])
    return NormalizedRBF(centres, np.tile(widths, (len(centres), 1)))


def fine_tiles() -> TileCoding:
    """Return tilings over distance and bearing, apart for what is seen."""
    offsets = uniform_offsets(TILINGS, 3)
    offsets[:, 0] = 0.0
    return TileCoding(LOW, HIGH, np.array([KINDS, DISTANCE_TILES, BEARING_TILES]), offsets)


def new_learner(condition: str, actions: int) -> tuple[Learner, Callable[[float], None]]:
    """Return a learner, and how to set its temperature."""
    rates = ALPHA, GAMMA, LAMBDA, TEMPERATURE
    if condition == RANDOM:
        return _AtRandom(actions), lambda _: None
    if condition == SARSA:
        sarsa = SarsaLambda(fine_tiles(), actions, *rates)
        return sarsa, partial(setattr, sarsa, "temperature")
    watkins = WatkinsQLambda(coarse_network(), actions, *rates)
    set_temperature = partial(setattr, watkins, "temperature")
    if condition == PLAIN:
        return watkins, set_temperature
    macro_actions = [macro_action(action, REPEATS) for action in range(actions)]
    return OptionLearner(watkins, macro_actions), set_temperature


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each condition for each seed."""
    steps = QUICK_STEPS if plan.is_quick else STEPS
    return [
        Job(condition, seed, partial(run, condition, seed, steps))
        for seed in plan.seeds
        for condition in (PLAIN, MACRO, SARSA, RANDOM)
    ]


def run(condition: str, seed: int, steps: int) -> list[Row]:
    """Let two robots learn together; return the curve of their matings, and its first and last quarter."""
    rng = np.random.default_rng([seed, 4])
    pair = MatingPair(seed, rng)
    learners, cool = zip(*(new_learner(condition, pair.actions) for _ in range(2)), strict=True)
    matings, episode, is_over = np.zeros(POINTS), 0, True
    actions: list[int] = []
    for step in range(steps):
        if is_over:
            for set_temperature in cool:
                set_temperature(TEMPERATURE / (1.0 + COOLING * episode))
            states = pair.start()
            actions = [one.start(states[i], float(rng.random())) for i, one in enumerate(learners)]
            episode += 1
        states, has_mated, is_over = pair.step((actions[0], actions[1]))
        matings[step * POINTS // steps] += has_mated
        actions = [
            one.step(float(has_mated), states[i], has_mated, float(rng.random()))
            for i, one in enumerate(learners)
        ]
    rates = matings * POINTS * 1000.0 / steps
    quarter = POINTS // 4
    curve: list[Row] = [
        {"steps": (point + 1) * steps // POINTS, "matings": float(rate)}
        for point, rate in enumerate(rates)
    ]
    first, last = float(rates[:quarter].mean()), float(rates[-quarter:].mean())
    return [*curve, {"matings_first": first, "matings_last": last}]


def _more(column: str, one: str, other: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure how many times more matings the one condition has than the other."""
    from scipy import stats

    own, others = pairs_of(rows, column, one, other)
    ratio = ratio_interval(own, others)
    p = float(stats.wilcoxon(own, others, alternative="greater").pvalue)
    return measured_pairs(
        ratio,
        own,
        others,
        statistic=f"{own.mean():.1f} against {others.mean():.1f}; one-sided Wilcoxon, {own.size} pairs",
        p=p,
        verdict=verdict_of(p < LEVEL and ratio.estimate > claim.threshold, p < LEVEL),
    )


def _no_behaviour(claim: Claim, rows: Sequence[Row]) -> Measured:
    own, random = pairs_of(rows, "matings_last", PLAIN, RANDOM)
    ratio = ratio_interval(own, random)
    return measured_pairs(
        ratio,
        own,
        random,
        statistic=f"{own.mean():.1f} against {random.mean():.1f}; bootstrap over pairs",
        verdict=verdict_of(ratio.high < claim.threshold, ratio.estimate < claim.threshold),
    )


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw learning curves: medians over seeds, and the middle half."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(0.6 * PAGE_IN, 2.6)
    panel = figure.subplots()
    for line, condition in zip(LINES, (PLAIN, MACRO, SARSA, RANDOM), strict=False):
        steps, matings = quartiles_of(rows, condition, "steps", "matings")
        draw_quartiles(panel, steps / 1000.0, matings, condition, line)
    panel.set(xlabel="thousand steps", ylabel="matings in a thousand steps")
    panel.set_ylim(0.0, 1.5 * panel.get_ylim()[1])  # room for the legend
    panel.legend()
    return figure


EXPERIMENT = Experiment(
    name="mating-macro-actions",
    columns=COLUMNS,
    jobs=plan_jobs,
    measures={
        "help-first": partial(_more, "matings_first", MACRO, PLAIN),
        "help-last": partial(_more, "matings_last", MACRO, PLAIN),
        "nothing-without": _no_behaviour,
        "not-needed": partial(_more, "matings_last", SARSA, MACRO),
    },
    draw=draw,
)
