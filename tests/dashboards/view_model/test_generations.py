"""A generation is returned once, when it has ended, with the statistics of all its agents."""

import random

import msgspec
import numpy as np
import pytest
from crcolony_dashboards.view_model import generations as generations_module
from crcolony_dashboards.view_model.generations import (
    PATIENCE_S,
    Generation,
    Generations,
    Spread,
    spread,
)
from hypothesis import given
from hypothesis import strategies as st

from crcolony.evolution.history import Born, Lived
from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Exchanged
from tests.support.fake_telemetry import IDS, T, agent, born, lived, mated

ME, PEER, LATE = 0, 1, 2


def present(*generations: int) -> dict[RobotId, int]:
    """Robots on the network, each in its generation."""
    return dict(zip(IDS, generations, strict=False))


def turn_over(made: Generations, robot: int, number: int, agents: int = 2) -> None:
    """Report all lifetimes of a robot's generation, and the births of the next."""
    for k in range(agents):
        made.add_lifetime(lived(agent(robot, 100 * number + k), number), T)
    for k in range(agents):
        made.add_birth(IDS[robot], born(agent(robot, 100 * (number + 1) + k), number + 1))


def numbers(ended: list[Generation]) -> list[int]:
    return [generation.number for generation in ended]


def only(ended: list[Generation]) -> Generation:
    (generation,) = ended
    return generation


LIVES = st.lists(
    st.tuples(
        st.integers(0, 30), st.integers(0, 500), st.floats(0.0, 1.0), st.integers(0, 5),
        st.floats(-1e6, 1e6),
    ),
    min_size=1,
    max_size=40,
)  # fmt: skip
"""Matings, captures, mean energy, conceptions and a gene of every agent"""


@given(LIVES, st.randoms(use_true_random=False))
def test_mean_and_spread_are_those_of_all_agents(
    lives: list[tuple[int, int, float, int, float]], rng: random.Random
) -> None:
    """As computed by numpy, in any order of arrival; a lifetime that arrives twice counts once."""
    made = Generations()
    events: list[Born | Exchanged | Lived] = []
    for k, (matings, captures, energy, conceptions, gene) in enumerate(lives):
        name = agent(k % 3, k)
        life = lived(name, 4, matings=matings, captures=captures, energy=energy, tick=k)
        sides = [mated(0, 1, j, agent=name, conceived=j < conceptions) for j in range(6)]
        events += [born(name, 4, [gene]), life, life, *sides]
    rng.shuffle(events)
    for event in events:
        if isinstance(event, Lived):
            made.add_lifetime(event, T + 1_000.0)
        elif isinstance(event, Born):
            made.add_birth(IDS[ME], event)
        else:
            made.add_mating(event)
    generation = only(made.pop_ended({}, T + 1_000.0 + PATIENCE_S))
    for place, name in enumerate(("matings", "captures", "energy", "conceptions")):
        values = np.array([float(life[place]) for life in lives])
        low, high = np.quantile(values, [0.1, 0.9])
        expected = (values.mean(), values.std(), low, high)
        found: Spread = getattr(generation, name)
        assert (found.mean, found.sd, found.low, found.high) == pytest.approx(expected, abs=1e-12)
    assert (generation.number, generation.agents) == (4, len(lives))
    assert sorted(generation.genotypes[:, 0]) == sorted(life[4] for life in lives)
    best = int(generation.best.rpartition("/")[2])
    assert lives[best][:3] == max(life[:3] for life in lives)
    assert generation.best_genes is not None
    assert generation.best_genes.tolist() == [lives[best][4]]


def test_conceptions_count_for_the_agent_that_conceived() -> None:
    """Both robots report their own side; a side that did not conceive counts nothing."""
    made = Generations()
    for k, (mine, theirs) in enumerate([(True, True), (True, False), (False, False)]):
        made.add_mating(mated(ME, PEER, k, agent=agent(ME, 7), conceived=mine))
        made.add_mating(mated(ME, PEER, k, agent=agent(PEER, 7), conceived=theirs))
    made.add_lifetime(lived(agent(ME, 7)), T)
    made.add_lifetime(lived(agent(PEER, 7)), T)
    conceptions = only(made.pop_ended({}, T + PATIENCE_S)).conceptions
    assert (conceptions.mean, conceptions.low, conceptions.high) == pytest.approx((1.5, 1.1, 1.9))


def test_the_best_mates_most_and_of_equals_captures_most() -> None:
    """Energy decides last."""
    made = Generations()
    for k, (matings, captures, energy) in enumerate([(2, 9, 0.1), (3, 1, 0.9), (3, 2, 0.1)]):
        life = lived(agent(ME, k), matings=matings, captures=captures, energy=energy)
        made.add_lifetime(life, T)
    generation = only(made.pop_ended({}, T + PATIENCE_S))
    assert (generation.best, generation.best_genes) == (agent(ME, 2), None)
    assert generation.genotypes.shape == (0, 0)


def test_a_spread_has_mean_standard_deviation_and_quantiles() -> None:
    """Also of a single number."""
    assert spread(range(11)) == Spread(5.0, float(np.sqrt(10.0)), 1.0, 9.0)
    assert spread([3]) == Spread(3.0, 0.0, 3.0, 3.0)


def test_implausible_numbers_raise_no_warning() -> None:
    """Their statistics are not finite, or 0."""
    assert np.isnan(spread([float("inf"), 1.0]).sd)
    assert spread([2**63, -(2**63)]).mean == 0.0


class TestEnd:
    """When a generation has ended."""

    def test_it_ends_when_all_robots_have_left_and_reported_it(self) -> None:
        """Not before the last robot has turned over; then at once, and once."""
        made = Generations()
        turn_over(made, ME, 0)
        assert made.pop_ended(present(1, 0), T + 0.1) == []
        turn_over(made, PEER, 0)
        generation = only(made.pop_ended(present(1, 1), T + 0.2))
        assert (generation.number, generation.agents) == (0, 4)
        assert made.pop_ended(present(1, 1), T + 1_000.0) == []

    @pytest.mark.parametrize(
        ("generations", "is_over"), [((1, 1, 0, 0), True), ((1, 0, 0, 0), False), ((), True)]
    )
    def test_a_few_late_robots_are_not_waited_for(
        self, generations: tuple[int, ...], is_over: bool
    ) -> None:
        """Once half have left it and no lifetime arrived for a while."""
        made = Generations()
        turn_over(made, ME, 0)
        turn_over(made, PEER, 0)
        assert made.pop_ended(present(*generations), T + PATIENCE_S - 0.1) == []
        assert numbers(made.pop_ended(present(*generations), T + PATIENCE_S)) == [0] * is_over

    def test_late_reports_do_not_restart_it(self) -> None:
        """Nor any generation before it."""
        made = Generations()
        turn_over(made, ME, 0)
        turn_over(made, ME, 1)
        assert numbers(made.pop_ended(present(2), T)) == [0, 1]
        turn_over(made, LATE, 0)
        turn_over(made, LATE, 1)
        assert made.pop_ended(present(2), T + 1_000.0) == []
        assert made.last == 1

    def test_generations_end_in_order(self) -> None:
        """One that late robots still report ends together with the next."""
        made = Generations()
        turn_over(made, ME, 3)
        turn_over(made, ME, 4)
        made.add_lifetime(lived(agent(LATE, 1), 3), T + 9.0)
        ended = made.pop_ended(present(5, 3), T + PATIENCE_S)
        assert numbers(ended) == [3, 4]
        assert [generation.agents for generation in ended] == [3, 2]

    def test_the_history_of_one_robot_after_another_is_collected(self) -> None:
        """A generation of the past does not end when the first robot has reported it."""
        made, ended = Generations(), list[Generation]()
        for robot in range(4):
            for number in range(3):
                turn_over(made, robot, number)
                ended += made.pop_ended(present(3, 3, 3, 3), T + robot)
        assert numbers(ended) == [0, 1, 2]
        assert [generation.agents for generation in ended] == [8, 8, 8]

    def test_a_robot_that_joined_later_is_not_waited_for(self) -> None:
        """Beyond a while, since it has nothing to report of it."""
        made = Generations()
        turn_over(made, ME, 3)
        made.add_birth(IDS[LATE], born(agent(LATE, 0), 4))
        assert made.pop_ended(present(4, 4), T + 1.0) == []
        assert numbers(made.pop_ended(present(4, 4), T + PATIENCE_S)) == [3]

    def test_a_present_generation_has_not_ended(self) -> None:
        """However long nothing arrives of it."""
        made = Generations()
        made.add_lifetime(lived(agent(ME, 1), 3), T)
        assert made.pop_ended(present(3, 3), T + 1e6) == []


class TestLimits:
    """Any peer can report any generation: memory is bounded."""

    def test_the_number_of_genotypes_is_limited(self) -> None:
        """They are taken evenly from all agents."""
        made = Generations()
        for k in range(1_000):
            made.add_birth(IDS[ME], born(agent(ME, k), 0, [float(k)]))
            made.add_lifetime(lived(agent(ME, k)), T)
        generation = only(made.pop_ended({}, T + PATIENCE_S))
        genes = generation.genotypes[:, 0]
        assert generation.agents == 1_000
        assert 300 < len(genes) <= 400
        assert set(np.diff(genes)) == {3.0}

    def test_the_number_of_open_generations_is_limited(self) -> None:
        """The oldest is dropped, with its conceptions."""
        made = Generations()
        for number in range(40):
            made.add_mating(mated(ME, PEER, agent=agent(ME, number), conceived=True))
            made.add_lifetime(lived(agent(ME, number), number), T)
        ended = made.pop_ended({}, T + PATIENCE_S)
        assert numbers(ended) == list(range(24, 40))
        assert len(made._conceptions) == 0

    def test_the_number_of_agents_is_limited(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """The oldest births and conceptions are dropped, and further lifetimes of a generation ignored."""
        monkeypatch.setattr(generations_module, "_MAX_AGENTS", 10)
        made = Generations()
        for k in range(30):
            made.add_birth(IDS[ME], born(agent(ME, k), 0, [float(k)]))
            made.add_mating(mated(ME, PEER, k, agent=agent(ME, k), conceived=True))
            made.add_lifetime(lived(agent(ME, k)), T)
        assert made.genes_of(agent(ME, 19)) is None
        genes = made.genes_of(agent(ME, 20))
        assert genes is not None
        assert genes.tolist() == [20.0]
        generation = only(made.pop_ended({}, T + PATIENCE_S))
        assert (generation.agents, generation.conceptions.mean) == (10, 0.0)

    def test_genotypes_of_different_lengths_are_not_mixed(self) -> None:
        """Only those as long as the first are kept."""
        made = Generations()
        for k, genes in enumerate(([1.0, 2.0], [3.0], [4.0, 5.0])):
            made.add_birth(IDS[ME], born(agent(ME, k), 0, genes))
            made.add_lifetime(lived(agent(ME, k)), T)
        generation = only(made.pop_ended({}, T + PATIENCE_S))
        assert generation.genotypes.tolist() == [[1.0, 2.0], [4.0, 5.0]]


def test_a_generation_of_a_robot_starts_with_its_first_birth() -> None:
    """Later births of the same generation do not count, and a new generation starts anew."""
    made = Generations()
    for tick, number in ((5, 0), (6, 0), (905, 1), (906, 1), (907, 0)):
        birth = msgspec.structs.replace(born(agent(ME, tick), number), tick=tick)
        made.add_birth(IDS[ME], birth)
    assert made.starts == {IDS[ME]: (1, 905)}
