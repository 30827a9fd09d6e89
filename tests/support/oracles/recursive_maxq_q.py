"""Algorithm 3.1 as printed: a recursive function, lists of states and dictionaries of values.

With the corrections that `maxq_q.py` names, and its memory, which is long enough here.
"""

from collections import defaultdict
from collections.abc import Callable

import numpy as np

from crcolony.learning.maxq.task_graph import NO_ENTRY, Composite, Primitive, QNode, TaskGraph
from crcolony.learning.policies import softmax
from crcolony.randomness import Stream, draw

World = Callable[[int, int], tuple[int, float, bool]]
"""Returns next state, reward and end of the episode, of a state and an action."""


class RecursiveMaxqQ:
    """The oracle of `MaxqQ`: equal to it with the same draws."""

    def __init__(
        self, graph: TaskGraph, gamma: float, alpha: float, temperature: float, cooling: float
    ) -> None:
        self.graph = graph
        self.gamma = gamma
        self.alpha = alpha
        self.cooling = cooling
        self.temperature = defaultdict[str, float](lambda: temperature)
        self.v = defaultdict[tuple[str, int], float](float)
        self.c = defaultdict[tuple[str, int, int], float](float)
        self.inner = defaultdict[tuple[str, int, int], float](float)
        self.actions: list[int] = []

    def episode(self, world: World, state: int, stream: Stream) -> None:
        """Let the root run from `state` on."""
        self.world, self.state, self.stream, self.is_over = world, state, stream, False
        if not self.has_ended(self.graph.root, state):
            self.run(self.graph.root, [])

    def run(self, name: str, callers: list[str]) -> list[int]:
        """Function MAXQ-Q: run a subtask; return the states that were visited, the last one first."""
        subtask, seq = self.graph[name], list[int]()
        if isinstance(subtask, Primitive):
            state = self.state
            self.actions.append(subtask.action)
            self.state, reward, self.is_over = self.world(state, subtask.action)
            entry = name, index(subtask.abstraction, state)
            self.v[entry] += self.alpha * (reward - self.v[entry])
            return [state]
        running = [*callers, name]
        while not self.is_over and not any(self.has_ended(one, self.state) for one in running):
            number = self.select(subtask)
            child = target(subtask.q_nodes[number], self.state)
            child_seq = self.run(child, running)
            self.update(subtask, number, child, child_seq)
            seq = child_seq + seq
        if self.is_goal(subtask):
            self.temperature[name] *= self.cooling
        return seq

    def update(self, subtask: Composite, number: int, child: str, child_seq: list[int]) -> None:
        """Update C~ and C of an action that has ended."""
        s_next = self.state
        if self.is_over or self.has_ended(subtask.name, s_next):
            pseudo = subtask.pseudo_reward
            inner, outer = (0.0 if pseudo is None else float(pseudo[s_next])), 0.0
        else:
            best = self.best(subtask, s_next)
            value = self.value(target(subtask.q_nodes[best], s_next), s_next)
            inner = self.completion(self.inner, subtask, best, s_next) + value
            outer = self.completion(self.c, subtask, best, s_next) + value
        node = subtask.q_nodes[number]
        for state in child_seq:
            inner, outer = (
                self.gamma * inner,
                self.gamma * outer,
            )  # γ^N, rounded as the learner does
            entry = subtask.name, number, index(node.abstraction, state)
            if entry[2] == NO_ENTRY or target(node, state) != child:
                continue
            self.inner[entry] += self.alpha * (inner - self.inner[entry])
            self.c[entry] += self.alpha * (outer - self.c[entry])

    def select(self, subtask: Composite) -> int:
        """Select among the actions that can be invoked."""
        numbers = self.available(subtask, self.state)
        values = np.array([self.inner_value(subtask, one, self.state) for one in numbers])
        temperature = self.temperature[subtask.name]
        return numbers[softmax(values, temperature, np.zeros(values.size), draw(self.stream))]

    def best(self, subtask: Composite, state: int) -> int:
        """Return a*."""
        numbers = self.available(subtask, state)
        return max(numbers, key=lambda number: self.inner_value(subtask, number, state))

    def value(self, name: str, state: int) -> float:
        """Return V(i, s), equation 3.9."""
        subtask = self.graph[name]
        if isinstance(subtask, Primitive):
            return self.v[name, index(subtask.abstraction, state)]
        if self.has_ended(name, state):
            return 0.0
        best = self.best(subtask, state)
        child = target(subtask.q_nodes[best], state)
        return self.value(child, state) + self.completion(self.c, subtask, best, state)

    def inner_value(self, subtask: Composite, number: int, state: int) -> float:
        """Return C~(i, s, a) + V(a, s)."""
        value = self.value(target(subtask.q_nodes[number], state), state)
        return value + self.completion(self.inner, subtask, number, state)

    def completion(
        self,
        table: defaultdict[tuple[str, int, int], float],
        subtask: Composite,
        number: int,
        state: int,
    ) -> float:
        """Return C(i, s, a), or C~."""
        entry = index(subtask.q_nodes[number].abstraction, state)
        return 0.0 if entry == NO_ENTRY else table[subtask.name, number, entry]

    def available(self, subtask: Composite, state: int) -> list[int]:
        """Return the numbers of the Q nodes whose subtasks can be invoked."""
        return [
            number
            for number, node in enumerate(subtask.q_nodes)
            if not self.has_ended(target(node, state), state)
        ]

    def has_ended(self, name: str, state: int) -> bool:
        """Return T_i(s), which holds too where nothing can be invoked."""
        subtask = self.graph[name]
        if isinstance(subtask, Primitive):
            return False
        return bool(subtask.terminal[state]) or not self.available(subtask, state)

    def is_goal(self, subtask: Composite) -> bool:
        """Tell whether a subtask that has stopped is at a goal: then it cools."""
        own_end = bool(subtask.terminal[self.state])
        can_go_on = bool(self.available(subtask, self.state))
        if not own_end and not (self.is_over and can_go_on):
            return False
        return subtask.pseudo_reward is None or bool(subtask.pseudo_reward[self.state] >= 0.0)


def target(node: QNode, state: int) -> str:
    """Return the subtask that a Q node invokes."""
    return node.subtasks[0 if node.parameter is None else int(node.parameter[state])]


def index(abstraction: object, state: int) -> int:
    """Return the entry of a state."""
    return state if abstraction is None else int(abstraction[state])  # type: ignore[index]
