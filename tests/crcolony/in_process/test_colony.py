"""An in-process colony has the same history however it is run, and every event in it is true."""

import numpy as np
import pytest

from crcolony.body import contract
from crcolony.evolution.genotype import genotype_digest
from crcolony.evolution.history import Born, Died, Lived, Mated, TurnedOver
from crcolony.in_process.colony import InProcessColony
from tests.support.small_colony import Recorder, history, live, new_colony, small


def test_the_same_seed_gives_the_same_history_and_another_seed_another() -> None:
    """Histories are compared by the hash over all events."""
    assert history("seed=5") == history("seed=5")
    assert history("seed=5") != history("seed=6")


@pytest.mark.parametrize(
    "settings",
    [
        (),
        ("selection=central",),
        ("selection=pgta",),
        ("selection=pega",),
        ("selection=medea", "heredity.pool_limit=2"),
        ("life.time_sharing=epsilon_greedy",),
        ("life.time_sharing=softmax",),
        ("learning.shaping=false",),
        ("arena.wall_turn_rad=1.0", "arena.physics_steps=2"),
        ("body.infrared=true", "body.inertial=true", "body.microphones=true"),
        ("body.noise.distance_m=0.05", "body.noise.bearing_rad=0.1"),
        ("body.observation_latency_steps=2", "body.action_latency_steps=1"),
        ("arena.pack_charge_per_step=0.1", "body.battery_drain_per_s=0.01"),
        ("arena.pillars=[[0.2, 0.1, 0.1]]", "arena.inner_walls=[[-0.3, 0.0, 0.0, 0.3]]"),
        ("robots=9", "life.conception_threshold=0.3", "heredity.pool_limit=2"),
    ],
    ids=lambda settings: settings[0] if settings else "default",
)
def test_saving_and_restoring_mid_lifetime_changes_nothing(settings: tuple[str, ...]) -> None:
    """A colony restored into a new one at an arbitrary tick continues with the same history, bit for bit."""
    whole, expected = new_colony(*settings)
    whole.start()
    whole.run(777)
    recorder = Recorder()
    recorder.hash.state = expected.hash.state
    other = InProcessColony(small(*settings), recorder)
    other.restore(whole.save())
    live(whole)
    live(other)
    assert str(recorder.hash) == str(expected.hash)
    for one, same in zip(whole.robots, other.robots, strict=True):
        assert np.array_equal(one.save()["arrays"]["weights"], same.save()["arrays"]["weights"])
    assert np.array_equal(whole.arena.world.poses, other.arena.world.poses)


def test_a_saved_colony_is_a_copy_that_does_not_change() -> None:
    """A colony that continues can be restored to it."""
    colony, _ = new_colony()
    colony.start()
    colony.run(100)
    saved = colony.save()
    colony.run(500)
    ahead = colony.arena.world.poses.copy()
    colony.restore(saved)
    colony.run(500)
    assert np.array_equal(colony.arena.world.poses, ahead)


def test_how_ticks_are_cut_into_pieces_changes_nothing() -> None:
    """One tick at a time leads to the same history as thousands."""
    assert history(chunk_ticks=1) == history(chunk_ticks=7) == history(chunk_ticks=10_000)


def test_a_saved_colony_of_other_settings_is_refused() -> None:
    """With another number of robots, agents or packs it does not fit."""
    colony, _ = new_colony()
    colony.start()
    for setting in ("robots=5", "life.agents=5", "arena.packs=3", "learning.tilings=2"):
        with pytest.raises(ValueError):
            new_colony(setting)[0].restore(colony.save())


def test_every_mating_is_between_two_robots_that_face_each_other_in_range() -> None:
    """In the tick of the event, both see the other ahead, both beacons are on, and both receive the same nonce."""
    colony, recorder = new_colony()
    colony.start()
    seen = 0
    for _ in range(20_000):
        colony.run(1)
        for mated in recorder.all(Mated)[seen:]:
            seen += 1
            assert mated.tick == colony.tick
            rows = colony.arena.world.observations[-1]
            one, two = rows[mated.robot], rows[mated.partner_robot]
            assert one[contract.ENCOUNTER_NONCE] == two[contract.ENCOUNTER_NONCE] > 0
            poses = colony.arena.world.poses
            offset = poses[mated.partner_robot, :2] - poses[mated.robot, :2]
            distance_m = float(np.hypot(*offset))
            assert distance_m <= colony.config.body.encounter_range_m
            for robot, towards in ((mated.robot, offset), (mated.partner_robot, -offset)):
                heading = poses[robot, 2]
                ahead = np.array([np.cos(heading), np.sin(heading)]) @ towards
                assert ahead >= distance_m * np.cos(colony.config.body.encounter_half_angle_rad)
    assert seen > 20


def test_an_offspring_is_born_of_two_agents_that_mated_and_one_that_conceived() -> None:
    """A child has a mother who conceived from its father in the generation before, or is her mutated copy."""
    colony, recorder = new_colony()
    colony.start()
    live(colony, 4)
    conceived = {(m.agent, m.partner) for m in recorder.all(Mated) if m.conceived}
    conceived |= {(m.partner, m.agent) for m in recorder.all(Mated) if m.partner_conceived}
    generation_of = {b.agent: b.generation for b in recorder.all(Born)}
    children = [b for b in recorder.all(Born) if b.generation > 0]
    assert any(child.father for child in children)
    for child in children:
        assert child.mother is not None
        assert generation_of[child.mother] == child.generation - 1
        assert child.mother.split("/")[0] == str(child.robot)
        if child.father is not None:
            assert (child.mother, child.father) in conceived


def test_the_recorded_genes_are_those_of_the_agents() -> None:
    """A birth's genes lie within the schema and have the birth's content hash."""
    colony, recorder = new_colony()
    colony.start()
    live(colony, 2)
    for birth in recorder.all(Born):
        genes = np.frombuffer(birth.genes, dtype="<f8")
        colony.schema.validate(genes)
        assert genotype_digest(colony.schema, genes) == birth.genotype


def test_no_agent_and_no_mating_is_lost() -> None:
    """Each robot has as many agents in every generation, each has one lifetime, and lifetimes and matings agree."""
    colony, recorder = new_colony()
    colony.start()
    live(colony, 3)
    births, lives = recorder.all(Born), recorder.all(Lived)
    for generation in range(3):
        for robot in range(4):
            born = [b.agent for b in births if (b.generation, b.robot) == (generation, robot)]
            lived = [v.agent for v in lives if (v.generation, v.robot) == (generation, robot)]
            assert len(set(born)) == 4
            assert born == lived
    assert len({b.agent for b in births}) == len(births)
    assert 2 * len(recorder.all(Mated)) == sum(v.matings for v in lives) > 0
    assert [t.generation for t in recorder.all(TurnedOver)] == [1] * 4 + [2] * 4 + [3] * 4
    steps = colony.config.life.slices * colony.config.life.slice_steps
    dead = {d.agent for d in recorder.all(Died)}
    for life in lives:
        assert life.steps == steps or life.agent in dead
        assert 0.0 < life.energy <= 1.0


def test_agents_that_starve_die_once_and_mate_no_more() -> None:
    """Without enough batteries all starve in their first slice, and the colony continues."""
    settings = ("arena.packs=1", "life.initial_energy=0.05", "arena.pack_charge=0.0001")
    colony, recorder = new_colony(*settings)
    colony.start()
    live(colony, 2)
    deaths = {d.agent: d.tick for d in recorder.all(Died)}
    assert len(deaths) == len(recorder.all(Died)) == 2 * 4 * 4
    for mated in recorder.all(Mated):
        assert mated.tick <= deaths[mated.agent]
        assert mated.tick <= deaths[mated.partner]


def test_conception_is_more_likely_with_more_energy() -> None:
    """Over many matings the share that conceived follows the energies at that moment."""
    colony, recorder = new_colony("life.agents=8", "life.slice_steps=500", "life.slices=4")
    colony.start()
    live(colony, 10)
    sides = [(m.energy, m.conceived) for m in recorder.all(Mated)]
    sides += [(m.partner_energy, m.partner_conceived) for m in recorder.all(Mated)]
    energy, conceived = np.array(sides).T
    assert energy.size > 100
    expected, spread = energy.sum(), np.sqrt((energy * (1 - energy)).sum())
    assert abs(conceived.sum() - expected) < 4 * spread
