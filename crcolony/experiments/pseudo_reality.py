"""Evolved learners against their own learnt policies, frozen, in pseudo-realities (after Ligot and Birattari 2019).

Learners of foraging evolve in one world, in which the best one then learns. All are tested at home and in worlds that
are sampled around it: as newborns with the evolved genes, who learn there; frozen, with what they learnt at home; and
with what they learnt at home, learning on. Home is the centre of the range of worlds, or the edge of it. Numbers are
ours.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.config import Config
from crcolony.experiments.colonies.experienced_foragers import (
    Experience,
    forage_again,
    gain_experience,
)
from crcolony.experiments.colonies.foraging_evolution import (
    AGENTS,
    arena_seed,
    choose_best,
    evolve_foragers,
)
from crcolony.experiments.colonies.foraging_lives import (
    WINDOW_STEPS,
    WINDOWS,
    forage,
    foraging_config,
)
from crcolony.experiments.colonies.pseudo_realities import (
    CENTRE,
    EDGE,
    LONGEST_DELAY_STEPS,
    PseudoReality,
    sample_pseudo_reality,
)
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row, values_of
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.pseudo_reality_claims import (
    AT_CENTRE,
    AT_EDGE,
    FROZEN,
    LEARNING_ON,
    MEASURES,
    NEWBORN,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HOMES = {AT_CENTRE: CENTRE, AT_EDGE: EDGE}
KINDS = {
    NEWBORN: "newborns who learn there",
    FROZEN: "frozen policies that were learnt at home",
    LEARNING_ON: "policies that were learnt at home, learning on",
}
DELAYS = range(LONGEST_DELAY_STEPS + 1)


@dataclass(frozen=True)
class Sizes:
    """How much is run."""

    generations: int = 150
    worlds: int = 30
    home_arenas: int = 5
    """Arenas of the home in which all are tested, with as many lives in each as there are agents; a world is one"""


_QUICK = Sizes(generations=2, worlds=2, home_arenas=1)
_LATE = WINDOWS - WINDOWS // 3
"""The last third of a life begins with this part."""

COLUMNS = {
    "world": Column("number of the sampled world, from 1"),
    "delay_steps": Column("control steps by which actions are late there", "control steps"),
    "distance_noise_m": Column("standard deviation of the distance of what is seen", "m"),
    "bearing_noise_rad": Column("standard deviation of the bearing of what is seen", "rad"),
    "wheel_left": Column("how fast the left wheel turns, 1 is as it is meant to"),
    "wheel_right": Column("how fast the right wheel turns, 1 is as it is meant to"),
    "width_m": Column("width of the arena", "m"),
    "height_m": Column("height of the arena", "m"),
    "pillars": Column("pillars in the arena", "pillars"),
    **{
        f"packs_{kind}": Column(f"packs of a life there, {who}", "packs")
        for kind, who in KINDS.items()
    },
    "window": Column(f"part of a life, of {WINDOW_STEPS} control steps, from 1"),
    **{
        f"curve_{kind}_{where}": Column(f"packs captured in it {place}, {who}", "packs")
        for kind, who in KINDS.items()
        for where, place in (("home", "at home"), ("away", "in sampled worlds, mean"))
    },
    "evolved_first": Column("packs of a life, mean over agents, generation 0", "packs"),
    "evolved_last": Column("packs of a life, mean over agents, last generation", "packs"),
    **{
        f"{part}_{kind}_{where}": Column(f"packs of {of} {place}, {who}", "packs")
        for part, of in (("life", "a life"), ("late", "the last third of a life"))
        for kind, who in KINDS.items()
        for where, place in (("home", "at home"), ("away", "in sampled worlds, mean"))
    },
    **{
        f"loss_{kind}": Column(f"share of the packs at home that is lost in sampled worlds, {who}")
        for kind, who in KINDS.items()
    },
    **{
        f"loss_{kind}_delay_{delay}": Column(
            f"the same, in worlds that are {delay} steps late, {who}"
        )
        for kind, who in KINDS.items()
        for delay in DELAYS
    },
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run with each home for each seed; those of one seed meet the same worlds."""
    sizes = _QUICK if plan.is_quick else Sizes()
    return [
        Job(home, seed, partial(run, home, sizes, seed)) for seed in plan.seeds for home in HOMES
    ]


def run(home: str, sizes: Sizes, seed: int) -> list[Row]:
    """Let learners evolve and learn at home; return a row of each world, of each part of a life, and of what came."""
    rng, worlds_rng = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    base = foraging_config(AGENTS, shaping=True)
    config = HOMES[home].config_of(base)
    lived = list(evolve_foragers(config, sizes.generations, rng))
    genes = choose_best(config, lived[-1].genotypes, rng)
    experience = gain_experience(config, np.tile(genes, (AGENTS, 1)), arena_seed(rng))
    tested = partial(_packs_of_all, base, genes, experience)
    at_home = [tested(HOMES[home], arena_seed(rng)) for _ in range(sizes.home_arenas)]
    worlds = [sample_pseudo_reality(worlds_rng) for _ in range(sizes.worlds)]
    away = [tested(world, arena_seed(worlds_rng)) for world in worlds]
    rows = [_world_row(k + 1, *one) for k, one in enumerate(zip(worlds, away, strict=True))]
    delays = np.array([world.delay_steps for world in worlds])
    curves = {kind: (_curves(at_home, kind).mean(axis=0), _curves(away, kind)) for kind in KINDS}
    found: Row = {
        "evolved_first": float(lived[0].packs.mean()),
        "evolved_last": float(lived[-1].packs.mean()),
    }
    for kind, (own, others) in curves.items():
        found |= _outcome(kind, own, others, delays)
    return [*rows, *_curve_rows(curves), found]


def _packs_of_all(
    base: Config, genes: FloatArray, experience: Experience, world: PseudoReality, seed: int
) -> dict[str, IntArray]:
    """Return the packs (agents, WINDOWS) of all kinds in one arena of a world."""
    config, wheels = world.config_of(base), world.wheels
    return {
        NEWBORN: forage(config, np.tile(genes, (AGENTS, 1)), seed, wheels),
        FROZEN: forage_again(config, experience, seed, wheels, frozen=True),
        LEARNING_ON: forage_again(config, experience, seed, wheels, frozen=False),
    }


def _curves(tested: Sequence[Mapping[str, IntArray]], kind: str) -> FloatArray:
    """Return the mean packs of a kind in each part of a life, (arenas, WINDOWS)."""
    return np.stack([packs[kind].mean(axis=0) for packs in tested])


def _world_row(number: int, world: PseudoReality, packs: Mapping[str, IntArray]) -> Row:
    return {
        "world": number,
        "delay_steps": world.delay_steps,
        "distance_noise_m": world.distance_noise_m,
        "bearing_noise_rad": world.bearing_noise_rad,
        "wheel_left": world.wheels[0],
        "wheel_right": world.wheels[1],
        "width_m": world.width_m,
        "height_m": world.height_m,
        "pillars": len(world.pillars),
        **{f"packs_{kind}": float(own.sum(axis=1).mean()) for kind, own in packs.items()},
    }


def _curve_rows(curves: Mapping[str, tuple[FloatArray, FloatArray]]) -> list[Row]:
    rows: list[Row] = [{"window": k + 1} for k in range(WINDOWS)]
    for kind, (own, others) in curves.items():
        for k, row in enumerate(rows):
            row[f"curve_{kind}_home"] = float(own[k])
            row[f"curve_{kind}_away"] = float(others[:, k].mean())
    return rows


def _outcome(kind: str, own: FloatArray, others: FloatArray, delays: IntArray) -> Row:
    """Return what a kind captures at home (WINDOWS,) and away (worlds, WINDOWS), and which share of it is lost."""
    at_home, away = max(float(own.sum()), 1e-12), others.sum(axis=1)
    found: Row = {
        f"life_{kind}_home": float(own.sum()),
        f"life_{kind}_away": float(away.mean()),
        f"late_{kind}_home": float(own[_LATE:].sum()),
        f"late_{kind}_away": float(others[:, _LATE:].sum(axis=1).mean()),
        f"loss_{kind}": 1.0 - float(away.mean()) / at_home,
    }
    for delay in DELAYS:
        late = away[delays == delay]
        lost = 1.0 - float(late.mean()) / at_home if late.size else float("nan")
        found[f"loss_{kind}_delay_{delay}"] = lost
    return found


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw learning curves in sampled worlds and at home, and what is lost by the delay of worlds, of both homes."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 4.8)
    all_axes = figure.subplots(2, 2)
    for (curves, losses), home in zip(all_axes, HOMES, strict=True):
        for k, (kind, line) in enumerate(zip(KINDS, LINES, strict=False)):
            label = kind.replace("_", " ")
            away = quartiles_of(rows, home, "window", f"curve_{kind}_away")
            draw_quartiles(curves, *away, label, line)
            points, at_home = quartiles_of(rows, home, "window", f"curve_{kind}_home")
            curves.plot(points, at_home[1], **{**line, "linewidth": 0.6})
            for delay in DELAYS:
                lost = values_of(rows, f"loss_{kind}_delay_{delay}", home)
                at = delay + 0.25 * (k - 1) + np.linspace(-0.06, 0.06, lost.size)
                losses.plot(at, lost, "o", markersize=2, color=line["color"])
        curves.set(
            ylabel="packs", ylim=(0.0, None), title=f"home at the {home}: away; thin: at home"
        )
        curves.set_xlabel(f"part of a life ({WINDOW_STEPS} steps)")
        losses.axhline(0.0, color="black", linewidth=0.5)
        losses.set_xticks(DELAYS)
        losses.set(xlabel="delay of the world, control steps", ylabel="share that is lost")
    all_axes[0, 0].legend()
    return figure


EXPERIMENT = Experiment("pseudo-reality", COLUMNS, plan_jobs, MEASURES, draw)
