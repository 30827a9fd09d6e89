"""Task graphs and worlds at random, for properties that hold of any."""

import numpy as np

from crcolony.compiled import IntArray
from crcolony.learning.maxq.task_graph import Composite, Primitive, QNode, TaskGraph

STATES = 6


def random_graph(rng: np.random.Generator, is_plain: bool = False) -> TaskGraph:
    """Return a graph of two or three actions and up to four composites, with all that one may have.

    A plain one has no parameters and abstractions, and a subtask ends wherever one ends that invokes it.
    """
    primitives = [
        Primitive(f"p{action}", action, _abstraction(rng, 0))
        for action in range(int(rng.integers(2, 4)))
    ]
    names = [one.name for one in primitives]
    composites: list[Composite] = []
    unused = set(names)
    count = int(rng.integers(1, 5))
    for number in range(count):
        chosen = list(rng.permutation(names)[: int(rng.integers(1, 4))])
        if number == count - 1:
            chosen += sorted(unused - set(chosen))  # all that is left hangs on the root
        composites.append(
            Composite(
                f"c{number}",
                _q_nodes(rng, chosen),
                terminal=rng.random(STATES) < (0.1 if number == count - 1 else 0.3),
                pseudo_reward=rng.normal(size=STATES) if rng.random() < 0.6 else None,
            )
        )
        names.append(f"c{number}")
        unused = unused - set(chosen) | {f"c{number}"}
    if is_plain:
        return _plain(primitives, composites)
    return TaskGraph(STATES, (*composites, *primitives))


def _plain(primitives: list[Primitive], composites: list[Composite]) -> TaskGraph:
    plain: list[Composite] = []
    ends = {one.name: one.terminal for one in composites}
    for one in reversed(composites):  # every subtask after those that invoke it
        names = [name for node in one.q_nodes for name in node.subtasks]
        for name in names:
            if name in ends:
                ends[name] = ends[name] | ends[one.name]
        q_nodes = tuple(QNode((name,)) for name in names)
        plain.append(Composite(one.name, q_nodes, ends[one.name], one.pseudo_reward))
    return TaskGraph(STATES, (*plain, *(Primitive(one.name, one.action) for one in primitives)))


def _q_nodes(rng: np.random.Generator, chosen: list[str]) -> tuple[QNode, ...]:
    if len(chosen) > 2 and rng.random() < 0.5:  # the first two are one subtask with a parameter
        bound = QNode(tuple(chosen[:2]), rng.integers(0, 2, STATES), _abstraction(rng, -1))
        return bound, *_q_nodes(rng, chosen[2:])
    return tuple(QNode((name,), abstraction=_abstraction(rng, -1)) for name in chosen)


def _abstraction(rng: np.random.Generator, least: int) -> IntArray | None:
    return None if rng.random() < 0.5 else rng.integers(least, 3, STATES)


class RandomWorld:
    """A deterministic world with rewards at random, whose episodes end after a number of steps."""

    def __init__(self, rng: np.random.Generator, actions: int) -> None:
        self.next_states = rng.integers(0, STATES, (STATES, actions))
        self.rewards = rng.normal(size=(STATES, actions))
        self.steps_left = 0

    def step(self, state: int, action: int) -> tuple[int, float, bool]:
        """Return next state, reward and whether the episode is over."""
        self.steps_left -= 1
        place = state, action
        return int(self.next_states[place]), float(self.rewards[place]), self.steps_left == 0
