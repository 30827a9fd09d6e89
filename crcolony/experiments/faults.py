"""Faults: what evolves where messages of matings get lost and robots are killed, against matings lost at random.

Colonies of the default world run the real mating protocol in virtual time; `colonies/faulty_colony.py` and
`colonies/mating_process.py` say what of it is real and what is not. A robot's senses do not tell whether an encounter
became a mating: it is rewarded for the encounter and rests after it either way. So faults act by selection alone: on
who has offspring, when that is decided, and what is lost of a life at a restart. Of one seed all conditions begin with
the same founders in the same arena. Two have a control beside: a colony without faults in which as large a share of the
encounters as failed there, drawn at random, comes to nothing.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from crcolony.config import Config, load
from crcolony.evolution.history import Born, Event
from crcolony.experiments.colonies.colony_run import ColonyRun
from crcolony.experiments.colonies.faulty_colony import (
    FaultRates,
    FaultyColony,
    RandomLossColony,
    RecordingColony,
)
from crcolony.experiments.colonies.mating_strategy import mating_range_of
from crcolony.experiments.faults_claims import (
    BOTH,
    GENES,
    KILLS,
    LOSSES,
    MEASURES,
    NEUTRAL,
    RANDOM,
    STRATEGY,
    WITH_CONTROL,
    condition_of,
    effect_of,
    gene_name,
)
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row, values_of
from crcolony.experiments.framework.quartile_curve import draw_quartiles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GENERATIONS = 60
LAST_GENERATIONS = 10
_QUICK = ("generations=3", "life.agents=4", "life.slices=2", "life.slice_steps=100")
_CHUNK_TICKS = 100_000
_END = f"mean of the last {LAST_GENERATIONS} generations"

_COLONY = {
    "failed": Column("share of the encounters' sides that did not become matings"),
    "matings_end": Column(f"encounters of an agent, {_END}", "encounters"),
    "conceptions_end": Column(f"offspring that an agent conceived, {_END}", "offspring"),
    "captures_end": Column(f"captured batteries of an agent, {_END}", "batteries"),
    "energy_end": Column(f"mean energy while alive, 0 to 1, {_END}"),
    "starved_end": Column(f"share of agents that starved, {_END}"),
    "waiting": Column(
        f"share of energies, 0 to 1, at which an agent that sees neither seeks a mate, {_END}"
    ),
    "choosiness": Column(f"share of energies at which it ignores a mate in sight, {_END}"),
    "tracking": Column(f"share of energies at which it prefers a mate to a battery, {_END}"),
    "mating_energy": Column(f"energy at encounters, mean, {_END}"),
    "mating_share": Column(f"share of steps in the mating module, {_END}"),
    **{gene: Column(f"{gene_name(gene)}, median over agents, {_END}") for gene in GENES},
}
COLUMNS = {
    "loss": Column("share of messages that get lost"),
    "kills_per_h": Column("times that each robot is killed", "1/h"),
    "kills": Column("times that any robot was killed", "kills"),
    "encounters": Column("pairs of robots that met", "encounters"),
    "messages_per_encounter": Column("messages for each encounter", "messages"),
    "wait_s": Column("mean time from an encounter until a robot decides about offspring", "s"),
    "too_late": Column("share of matings whose agent had died with its generation by then"),
    **_COLONY,
    **{
        f"{gene}{NEUTRAL}": Column(f"{gene_name(gene)} if it were a neutral gene, {_END}")
        for gene in GENES
    },
    **{
        f"{RANDOM}{name}": Column(f"with matings lost at random: {column.meaning}", column.unit)
        for name, column in _COLONY.items()
    },
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each combination of faults for each seed."""
    quick = _QUICK if plan.is_quick else ()
    return [
        Job(
            condition_of(loss, kills),
            seed,
            partial(
                run,
                load(None, [f"seed={seed}", f"generations={GENERATIONS}", *quick]),
                FaultRates(loss, kills),
                condition_of(loss, kills) in WITH_CONTROL,
            ),
        )
        for seed in plan.seeds
        for kills in KILLS
        for loss in LOSSES
    ]


def run(config: Config, rates: FaultRates, has_control: bool) -> Row:
    """Let a colony evolve with faults, and perhaps its control; return what came of both."""
    births: list[Born] = []

    def record(event: Event) -> None:
        if isinstance(event, Born):
            births.append(event)

    colony = FaultyColony(config, record, rates)
    _live(colony)
    failed = 1.0 - colony.decided / max(2 * colony.encounters, 1)
    generations = [{"generation": float(k)} for k in range(config.generations)]
    neutral = ColonyRun(colony, generations, births, "").neutral_means(
        [gene_name(gene) for gene in GENES]
    )
    row: Row = {
        "loss": rates.loss,
        "kills_per_h": rates.kills_per_h,
        "kills": colony.kills,
        "encounters": colony.encounters,
        "messages_per_encounter": colony.messages / max(colony.encounters, 1),
        "wait_s": colony.waited_s / max(colony.decided, 1),
        "too_late": colony.too_late / max(colony.decided, 1),
        "failed": failed,
        **_end_of(colony),
        **{f"{gene}{NEUTRAL}": neutral[gene_name(gene)] for gene in GENES},
    }
    if has_control:
        control = RandomLossColony(config, lambda _: None, failed)
        _live(control)
        row[f"{RANDOM}failed"] = control.failed / max(control.encounters, 1)
        row |= {f"{RANDOM}{name}": value for name, value in _end_of(control).items()}
    return row


def _live(colony: RecordingColony) -> None:
    colony.start()
    while colony.generation < colony.config.generations:
        colony.run(_CHUNK_TICKS)


def _end_of(colony: RecordingColony) -> Row:
    """Return what agents did in the last generations, and which genes they had."""
    last = range(colony.config.generations)[-LAST_GENERATIONS:]
    ended = [one for one in colony.ended if one.generation in last]
    agents = sum(len(one.genotypes) for one in ended)
    matings, steps = sum(one.matings for one in ended), sum(one.steps for one in ended)
    row: Row = {
        "matings_end": matings / agents,
        "conceptions_end": sum(one.conceptions for one in ended) / agents,
        "captures_end": sum(one.captures for one in ended) / agents,
        "starved_end": sum(one.starved for one in ended) / agents,
        "energy_end": sum(one.energy for one in ended) / max(steps, 1),
        "mating_share": sum(one.mating_steps for one in ended) / max(steps, 1),
    }
    if matings:
        row["mating_energy"] = sum(one.mating_energy for one in ended) / matings
    schema = colony.schema
    genotypes = np.concatenate([one.genotypes for one in ended])
    row["waiting"] = float(mating_range_of(genotypes, schema, False, False).mean())
    row["choosiness"] = 1.0 - float(mating_range_of(genotypes, schema, False, True).mean())
    row["tracking"] = float(mating_range_of(genotypes, schema, True, True).mean())
    populations = [
        np.concatenate([one.genotypes for one in ended if one.generation == generation])
        for generation in last
    ]
    for gene in GENES:
        column = schema.index(gene_name(gene))
        row[gene] = float(np.mean([np.median(genes[:, column]) for genes in populations]))
    return row


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw encounters that fail and matings of agents, by loss, and how far both faults move genes and strategy."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.8)
    failed, matings, effects = figure.subplots(1, 3, width_ratios=(2, 2, 3))
    for axes, column in ((failed, "failed"), (matings, "matings_end")):
        for line, kills in zip(LINES, KILLS, strict=False):
            values = [values_of(rows, column, condition_of(loss, kills)) for loss in LOSSES]
            quartiles = np.array([np.quantile(one, (0.25, 0.5, 0.75)) for one in values]).T
            draw_quartiles(axes, np.array(LOSSES), quartiles, f"{kills:g} kills an hour", line)
        axes.set(xlabel="share of messages lost", ylim=(0.0, None))
    failed.set_ylabel("share of encounters that fail")
    failed.legend()
    matings.set_ylabel("encounters of an agent, end")
    names = (*GENES, *STRATEGY)
    shown = [effect_of(rows, BOTH, name) for name in names]
    places = np.arange(len(names))[::-1]
    low, middle, high = np.array(shown).T
    effects.errorbar(
        middle,
        places,
        xerr=np.array([middle - low, high - middle]),
        fmt="o",
        color=LINES[0]["color"],
        linewidth=0.8,
    )
    effects.axvline(0.0, color="black", linewidth=0.5)
    effects.set_yticks(places, [name.replace("_", " ") for name in names], fontsize=5)
    effects.set_xlabel("40 % loss and 10 kills an hour,\nmean difference over its sd")
    return figure


EXPERIMENT = Experiment("faults", COLUMNS, plan_jobs, MEASURES, draw)
