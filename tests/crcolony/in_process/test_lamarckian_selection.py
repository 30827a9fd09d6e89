"""Central schemes of instances hand on genes and learning alike, and nothing else."""

from typing import Any

import numpy as np
import pytest

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.history import Born, Mated
from crcolony.in_process.lamarckian_selection import LamarckianSelection
from crcolony.robot.weight_rows import weights_by_tile
from tests.support.small_colony import live, new_colony


class FirstWins:
    """A competition in which everyone goes on as the first agent of the second robot."""

    memory = np.zeros(1)

    def compete(
        self, genotypes: FloatArray, fitness: FloatArray, rng: np.random.Generator
    ) -> tuple[IntArray, FloatArray]:
        """Return the same for all."""
        winner = np.full(fitness.size, 4)
        return winner, genotypes[winner]


def test_what_an_instance_has_learnt_goes_on_in_every_robot() -> None:
    """Weights of all tiles it visited, and its genes; energy and counts begin anew."""
    colony, recorder = new_colony("selection=ompac")
    colony.start()
    colony.run(1500)
    batch, config = colony.batch, colony.config
    learnt = weights_by_tile(batch, 1, -1.0)[0]
    assert (learnt != -1.0).any()
    genes = batch.genotypes[1, 0].copy()
    LamarckianSelection(FirstWins(), 1).turn_over(colony.robots, batch)
    for robot in colony.robots:
        table = weights_by_tile(batch, robot.row, -1.0)
        for agent in range(config.life.agents):
            assert np.array_equal(table[agent], learnt)
            assert np.array_equal(batch.genotypes[robot.row, agent], genes)
    assert (batch.energies == config.life.initial_energy).all()
    assert not batch.matings.any()
    live(colony, 2)
    assert recorder.all(Mated)


@pytest.mark.parametrize("selection", ["ompac", "gpbt_pl"])
def test_a_colony_of_instances_lives_and_goes_on_where_it_was_saved(selection: str) -> None:
    """Newborns have one parent, of any robot; nobody conceives; restored it has the same future, bit for bit."""
    colony, recorder = new_colony(f"selection={selection}")
    colony.start()
    live(colony, 1)
    colony.run(100)
    restored, other = new_colony(f"selection={selection}")
    restored.restore(colony.save())
    seen = len(recorder.events)
    live(colony, 3)
    live(restored, 3)
    assert other.events == recorder.events[seen:]
    newborns = [born for born in recorder.all(Born) if born.generation > 0]
    assert all(born.mother is not None and born.father is None for born in newborns)
    assert {str(born.mother).split("/")[0] for born in newborns} == {"0", "1", "2", "3"}
    assert not any(mated.conceived or mated.partner_conceived for mated in recorder.all(Mated))


def test_what_does_not_fit_is_refused() -> None:
    """The state of another scheme, or of another number of instances."""
    colony, _ = new_colony("selection=gpbt_pl")
    colony.start()
    saved: Any = colony.save()
    for wrong in ({}, {"memory": np.zeros((3, 3)), "stream": np.zeros(2)}):
        with pytest.raises((KeyError, ValueError)):
            colony.restore({**saved, "central": wrong})
