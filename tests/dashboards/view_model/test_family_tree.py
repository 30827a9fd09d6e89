"""Every gene is traced to the founder that it came from, through crossover, mutation, late and lost births."""

import random
import warnings
from collections import Counter
from collections.abc import Iterable

import numpy as np
import pytest
from crcolony_dashboards.view_model import family_tree as family_module
from crcolony_dashboards.view_model.family_tree import FamilyTree
from hypothesis import given
from hypothesis import strategies as st

from crcolony.evolution.history import Born
from crcolony.evolution.variation import CROSSOVERS
from crcolony.protocol.identity import RobotId
from tests.support.fake_telemetry import IDS, agent, born

GENES = 12
"""Of an agent here"""
A, B, C = "a/0", "a/1", "b/0"


def family(*births: Born, robot: int = 0) -> FamilyTree:
    made = FamilyTree()
    for birth in births:
        made.add_birth(IDS[robot], birth)
    return made


def origins(made: FamilyTree, name: str) -> list[str]:
    """Return the founder of every gene of an agent, by name."""
    member = made[name]
    assert member is not None
    return [made.founders[number] for number in member.origins]


class TracedColony:
    """A colony that evolves, of which every gene is traced: the oracle.

    Founders' genes are far apart, and mutations small, so that the origin of a gene is unambiguous.
    """

    def __init__(self, seed: int, robots: int, agents: int, crossover: str) -> None:
        self._rng = np.random.default_rng(seed)
        self._crossover = CROSSOVERS[crossover]
        self.births: list[tuple[RobotId, Born]] = []
        self.origins: dict[str, list[str]] = {}
        self._agents = agents
        self._count = Counter[int]()
        self._genes: dict[str, np.ndarray] = {}
        self.living: dict[int, list[str]] = {robot: [] for robot in range(robots)}
        for robot in range(robots):
            for _ in range(agents):
                name = self._name(robot)
                genes = 100.0 * len(self._genes) + self._rng.random(GENES)
                self._add(robot, 0, name, genes, [name] * GENES, {})
        self._generation = 0

    def _name(self, robot: int) -> str:
        self._count[robot] += 1
        return agent(robot, self._count[robot])

    def _add(
        self, robot: int, generation: int, name: str, genes: np.ndarray, of: list[str],
        parents: dict[str, str],
    ) -> None:  # fmt: skip
        self._genes[name], self.origins[name] = genes, of
        self.births.append((IDS[robot], born(name, generation, list(genes), **parents)))
        self.living[robot].append(name)

    def turn_over(self) -> None:
        """Let every agent have a child, with any agent of the colony or alone."""
        self._generation += 1
        agents = [name for names in self.living.values() for name in names]
        before = {robot: list(names) for robot, names in self.living.items()}
        for robot, mothers in before.items():
            self.living[robot] = []
            for mother in mothers:
                self._add_child(robot, mother, str(self._rng.choice(agents)))

    def _add_child(self, robot: int, mother: str, father: str) -> None:
        genes, of, parents = self._genes[mother], self.origins[mother], {"mother": mother}
        if self._rng.random() < 0.8:
            seed = int(self._rng.integers(2**32))
            places = np.arange(GENES, dtype=float)
            genes, _ = self._crossover(genes, self._genes[father], np.random.default_rng(seed))
            chosen, _ = self._crossover(places, GENES + places, np.random.default_rng(seed))
            both = self.origins[mother] + self.origins[father]
            of, parents = [both[int(place)] for place in chosen], parents | {"father": father}
        genes = genes + self._rng.normal(0.0, 0.1, GENES) * (self._rng.random(GENES) < 0.3)
        self._add(robot, self._generation, self._name(robot), genes, of, parents)

    def shares(self) -> dict[str, float]:
        living = [name for names in self.living.values() for name in names]
        counts = Counter(founder for name in living for founder in self.origins[name])
        return {name: count / (GENES * len(living)) for name, count in counts.items()}


@given(
    st.integers(0, 2**32), st.integers(1, 4), st.integers(1, 5), st.integers(0, 6),
    st.sampled_from(sorted(CROSSOVERS)),
)  # fmt: skip
def test_every_gene_is_traced_to_its_founder(
    seed: int, robots: int, agents: int, generations: int, crossover: str
) -> None:
    """Through all crossovers and mutations, as by the oracle; the founders' shares too."""
    colony, made = TracedColony(seed, robots, agents, crossover), FamilyTree()
    for _ in range(generations):
        colony.turn_over()
    for robot, birth in colony.births:
        made.add_birth(robot, birth)
    for name, of in colony.origins.items():
        assert origins(made, name) == of
        member = made[name]
        assert member is not None
        counts = Counter(of)
        assert counts[made.founders[member.founder]] == max(counts.values())
    shares = made.shares(IDS[:robots])
    assert sum(shares.values()) == pytest.approx(1.0)
    assert list(shares.values()) == sorted(shares.values(), reverse=True)
    assert {made.founders[n]: share for n, share in shares.items()} == pytest.approx(
        colony.shares()
    )


class TestFounders:
    """An agent without known parents is a founder."""

    def test_founders_are_numbered_in_order_of_arrival(self) -> None:
        """A birth that arrives twice counts once."""
        made = family(born(A), born(C), born(A), born(B))
        assert made.founders == [A, C, B]
        assert (made.births, len(made)) == (3, 3)

    def test_the_earliest_known_ancestor_is_a_founder(self) -> None:
        """Of a child of unknown parents it is the mother, for all her children."""
        made = family(
            born("x/5", 3, mother="x/1", father="x/2"), born("x/6", 3, mother="x/1"),
            born("x/7", 3, father="x/2"),
        )  # fmt: skip
        assert made.founders == ["x/1", "x/2"]
        assert origins(made, "x/6") == ["x/1"]
        assert origins(made, "x/7") == ["x/2"]

    def test_with_one_known_parent_all_genes_are_traced_to_it(self) -> None:
        """Whether the other parent is unknown or there is none."""
        made = family(
            born(A, genes=[1.0, 2.0]),
            born("a/5", 1, genes=[1.1, 7.0], mother=A),
            born("a/6", 1, genes=[1.0, 9.0], mother="gone/1", father=A),
        )
        assert origins(made, "a/5") == origins(made, "a/6") == [A, A]

    def test_parents_with_another_number_of_genes_are_ignored(self) -> None:
        """The child is then a founder's child."""
        made = family(born(A, genes=[1.0, 2.0]), born("a/5", 1, genes=[1.0, 2.0, 3.0], mother=A))
        assert origins(made, "a/5") == [A, A, A]

    def test_agents_without_genes_have_no_share(self) -> None:
        """And nothing is raised."""
        made = family(born(A, genes=[]), born("a/5", 1, genes=[], mother=A, father=A))
        assert made.shares(IDS) == {}


class TestShares:
    """The founders' shares in the living agents' genes."""

    def test_shares_are_of_the_newest_generation_of_every_robot(self) -> None:
        """Not of its parents; a birth of an older generation that arrives late changes nothing."""
        made = family(born(A), born(B), born("a/5", 1, mother=B))
        made.add_birth(IDS[1], born(C))
        made.add_birth(IDS[0], born("a/2"))
        assert made.shares(IDS) == {1: 0.5, 2: 0.5}

    def test_robots_that_are_absent_do_not_count(self) -> None:
        """Until they are present again."""
        made = family(born(A))
        made.add_birth(IDS[1], born(C))
        assert made.shares([IDS[1]]) == {1: 1.0}
        assert made.shares([]) == {}
        assert made.shares(IDS) == {0: 0.5, 1: 0.5}


class TestIndices:
    """Agents of one robot and generation have successive indices."""

    def test_every_agent_has_its_own_index(self) -> None:
        """Within its robot and generation, also if births arrive late."""
        made = FamilyTree()
        births = [born(agent(r, k), k // 3) for r in range(2) for k in range(9)]
        random.Random(1).shuffle(births)
        for birth in births:
            made.add_birth(bytes.fromhex(birth.agent[:32]), birth)
        members = [made[birth.agent] for birth in births]
        places = Counter((m.robot, m.generation, m.index) for m in members if m)
        assert set(places) == {(IDS[r], g, k) for r in range(2) for g in range(3) for k in range(3)}
        assert set(places.values()) == {1}


def ancestors(colony: TracedColony, names: Iterable[str]) -> set[str]:
    parents = {birth.agent: (birth.mother, birth.father) for _, birth in colony.births}
    found, waiting = set[str](), list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [parent for parent in parents[name] if parent is not None]
    return found


@given(st.integers(0, 2**32), st.integers(1, 80))
def test_the_last_births_are_returned_with_their_ancestors(seed: int, most: int) -> None:
    """At most so many; at least half are the last births, the others are ancestors, and the oldest come first."""
    colony, made = TracedColony(seed, 3, 4, "uniform"), FamilyTree()
    for _ in range(4):
        colony.turn_over()
    for robot, birth in colony.births:
        made.add_birth(robot, birth)
    shown = made.last_births(most)
    names = [member.agent for member in shown]
    newest = [birth.agent for _, birth in colony.births][-max(1, most // 2) :]
    assert len(set(names)) == len(names) <= max(1, most)
    assert set(newest) <= set(names) <= ancestors(colony, newest)
    assert len(names) == min(max(1, most), len(ancestors(colony, newest)))
    generations = [member.generation for member in shown]
    assert generations == sorted(generations)


class TestLimits:
    """Any peer can publish births: memory is bounded."""

    def test_the_oldest_births_are_dropped(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Of whatever robots and generations; the shares of the others still add up to 1."""
        monkeypatch.setattr(family_module, "_MAX_BIRTHS", 50)
        rng, made = random.Random(1), FamilyTree()
        for number in range(2_000):
            robot = IDS[rng.randrange(len(IDS))]
            parents = {"mother": f"x/{rng.randrange(number + 1)}"} if number % 3 else {}
            made.add_birth(robot, born(f"x/{number}", rng.randrange(4), [float(number)], **parents))
            assert len(made) <= 50
            if number % 50 == 0:
                assert sum(made.shares(IDS).values()) == pytest.approx(1.0)
        assert made["x/0"] is None
        assert made["x/1999"] is not None
        assert sum(len(members) for _, members in made._living.values()) <= 50
        assert len(made._sizes) <= 50

    def test_founders_above_the_limit_count_as_the_last(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The first keep their numbers."""
        monkeypatch.setattr(family_module, "_MAX_FOUNDERS", 3)
        made = family(*(born(f"x/{number}", mother=f"y/{number}") for number in range(9)))
        assert made.founders == ["y/0", "y/1", "y/2"]
        assert origins(made, "x/0") == ["y/0"]
        assert origins(made, "x/8") == ["y/2"]
        assert made.shares(IDS) == pytest.approx({0: 1 / 9, 1: 1 / 9, 2: 7 / 9})

    def test_the_largest_genes_are_compared_without_a_warning(self) -> None:
        """Each is traced to one of the parents."""
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            made = family(
                born(A, genes=[1e9]),
                born(B, genes=[-1e9]),
                born("a/5", 1, [5.0], mother=A, father=B),
            )
        assert origins(made, "a/5") in ([A], [B])
