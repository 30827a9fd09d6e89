"""A colony with faults is the same colony where there are none, and loses what its faults take where there are some."""

import numpy as np
import pytest

from crcolony.config import Config, load
from crcolony.evolution.history import Born, Event
from crcolony.experiments.colonies.faulty_colony import (
    FaultRates,
    FaultyColony,
    RandomLossColony,
    RecordingColony,
)
from crcolony.in_process.colony import InProcessColony

GENERATIONS = 2
SMALL = ("life.agents=4", "life.slices=2", "life.slice_steps=300", "arena.area_per_robot_m2=0.6")


def config_of(seed: int = 1, *settings: str) -> Config:
    return load(None, [*SMALL, f"seed={seed}", f"generations={GENERATIONS}", *settings])


def live(colony: InProcessColony) -> None:
    colony.start()
    while colony.generation < GENERATIONS:
        colony.run(1_000)


def faulty(rates: FaultRates, *settings: str) -> FaultyColony:
    colony = FaultyColony(config_of(1, *settings), lambda _: None, rates)
    live(colony)
    return colony


@pytest.mark.parametrize("seed", [1, 2])
def test_without_faults_the_same_agents_are_born_as_where_mating_takes_no_time(seed: int) -> None:
    """The real protocol is quicker than a control period, so that nobody notices it; nor a loss that never comes."""
    histories: list[list[tuple[str, str]]] = []
    for kind in (InProcessColony, FaultyColony, RandomLossColony):
        births: list[tuple[str, str]] = []

        def record(event: Event, births: list[tuple[str, str]] = births) -> None:
            if isinstance(event, Born):
                births.append((event.agent, event.genotype))

        faults = {FaultyColony: (FaultRates(),), RandomLossColony: (0.0,)}.get(kind, ())
        live(kind(config_of(seed), record, *faults))
        histories.append(births)
    assert histories[0] == histories[1] == histories[2]
    assert len(histories[0]) == (GENERATIONS + 1) * 4 * 4


def test_without_faults_every_encounter_is_a_mating_of_four_messages() -> None:
    """For both sides, a tenth of a second later at most, on average."""
    colony = faulty(FaultRates())
    assert colony.encounters > 10
    assert colony.decided == 2 * colony.encounters
    assert colony.messages == 4 * colony.encounters
    assert 0.0 < colony.waited_s / colony.decided < 0.1
    assert colony.kills == 0


def test_of_a_lossy_network_matings_take_more_messages_and_time_and_few_fail() -> None:
    """Where nothing arrives, none takes place."""
    colony = faulty(FaultRates(loss=0.4))
    assert colony.messages > 6 * colony.encounters
    assert 0.2 < colony.waited_s / colony.decided < 2.0
    assert 0.8 < colony.decided / (2 * colony.encounters) < 1.0
    silent = faulty(FaultRates(loss=1.0))
    assert silent.encounters >= 10
    assert silent.decided == 0
    assert sum(ended.conceptions for ended in silent.ended) == 0


def test_who_is_killed_ends_its_generation_later() -> None:
    """It is as often killed as is set, stands still for a while, and lives again what was lost."""
    colony = faulty(FaultRates(kills_per_h=60.0))
    robot_hours = 4 * colony.tick * 0.2 / 3600.0
    assert 0.5 < colony.kills / (60.0 * robot_hours) < 1.5
    lost_ticks = colony.tick - GENERATIONS * 2 * 4 * 300
    assert lost_ticks * 0.2 > 5.0 * colony.kills / 8
    assert sum(ended.conceptions for ended in colony.ended) > 0
    assert all(0 < ended.steps <= 2 * 4 * 300 for ended in colony.ended)


def test_the_same_seed_has_the_same_faults() -> None:
    """And another history than without them."""
    one, other, none = (
        faulty(rates) for rates in (FaultRates(0.4, 60.0), FaultRates(0.4, 60.0), FaultRates())
    )
    assert (one.messages, one.kills, one.decided) == (other.messages, other.kills, other.decided)
    assert np.array_equal(one.batch.genotypes, other.batch.genotypes)
    assert not np.array_equal(one.batch.genotypes, none.batch.genotypes)


def test_matings_that_are_lost_at_random_are_as_many_as_are_asked_for() -> None:
    """Neither side conceives at one; encounters are rewarded as before."""
    colony = RandomLossColony(config_of(1, "life.initial_energy=1.0"), lambda _: None, 0.5)
    live(colony)
    assert 0.3 < colony.failed / colony.encounters < 0.7
    assert sum(ended.matings for ended in colony.ended) == 2 * colony.encounters
    conceptions = sum(ended.conceptions for ended in colony.ended)
    assert 0 < conceptions <= 2 * (colony.encounters - colony.failed)


def test_what_robots_did_is_kept_of_every_generation() -> None:
    """As the colony's own summary has it of the last one."""
    colony = RecordingColony(config_of(), lambda _: None)
    live(colony)
    assert [ended.generation for ended in colony.ended] == [0] * 4 + [1] * 4
    last = colony.ended[-4:]
    summary = colony.summary
    assert sum(ended.matings for ended in last) / 16 == pytest.approx(summary["matings"])
    assert sum(ended.conceptions for ended in last) / 16 == pytest.approx(summary["conceptions"])
    assert sum(ended.captures for ended in last) / 16 == pytest.approx(summary["captures"])
    assert sum(ended.starved for ended in last) / 16 == pytest.approx(summary["starved"])
    assert sum(ended.mating_energy for ended in last) / 16 == pytest.approx(
        summary["energy_weighted_matings"]
    )
    assert sum(ended.steps for ended in last) / 16 == pytest.approx(summary["lived_steps"])
    steps = sum(ended.mating_steps for ended in last) / sum(ended.steps for ended in last)
    assert steps == pytest.approx(summary["mating_share"], abs=0.02)
