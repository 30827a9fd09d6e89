"""A learner by MAXQ-Q to call once a step from Python, and what it has learnt, by the names of subtasks."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from crcolony.learning.maxq.decomposition import (
    NO_EDGE,
    Tables,
    completion,
    greedy_action,
    project,
)
from crcolony.learning.maxq.flat_graph import flatten, longest_path
from crcolony.learning.maxq.maxq_q import DEPTH, TIME, Learner, learn_and_select, start_episode
from crcolony.learning.maxq.task_graph import TaskGraph, TaskGraphError
from crcolony.randomness import Stream


@dataclass(frozen=True)
class NodeParameters:
    """Meta-parameters of one subtask: learning rate, and softmax temperature with its cooling.

    The temperature is multiplied by `cooling` whenever the subtask ends at a goal. Raises ValueError for
    an alpha or a cooling outside [0, 1], or a negative temperature.
    """

    alpha: float = 0.25
    temperature: float = 0.0
    cooling: float = 1.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.alpha <= 1.0 and 0.0 <= self.cooling <= 1.0):
            raise ValueError(
                f"alpha and cooling are in [0, 1], got {self.alpha} and {self.cooling}"
            )
        if not self.temperature >= 0.0:
            raise ValueError(f"a temperature is not negative, got {self.temperature}")


class MaxqQ:
    """A learner to call once a step: `start`, then `step` until NO_ACTION. `learner` is for compiled loops.

    `parameters` are by name; a subtask without any has the `default`. The values of a parameterised subtask have one
    temperature, that of the first of them. Of what a subtask did, the last `memory` steps are learnt from when it ends.
    """

    def __init__(
        self,
        graph: TaskGraph,
        gamma: float = 1.0,
        parameters: Mapping[str, NodeParameters] | None = None,
        default: NodeParameters | None = None,
        initial_value: float = 0.0,
        memory: int = 4096,
    ) -> None:
        """Raises ValueError for a gamma outside [0, 1] or no memory, TaskGraphError for an unknown name."""
        if not 0.0 <= gamma <= 1.0 or memory < 1:
            raise ValueError(f"gamma is in [0, 1] and memory positive, got {gamma} and {memory}")
        parameters = parameters or {}
        for name in parameters:
            graph[name]
        self.graph = graph
        self._numbers = {name: number for number, name in enumerate(graph.order)}
        flat, self.sizes = flatten(graph)
        of_nodes = [parameters.get(name, default or NodeParameters()) for name in graph.order]
        _, firsts, entries = np.unique(
            [graph.temperature_name(name) for name in graph.order],
            return_index=True,
            return_inverse=True,
        )
        edges = int(np.diff(flat.first_edges).max())
        completions, nodes = int(self.sizes.first_completions[-1]), len(of_nodes)
        self.learner = Learner(
            graph=flat,
            tables=Tables(
                values=np.full(int(self.sizes.first_values[-1]), initial_value),
                completions=np.full(completions, initial_value),
                inner_completions=np.full(completions, initial_value),
                node_values=np.zeros(nodes),
                best_edges=np.full(nodes, NO_EDGE, dtype=np.int64),
            ),
            alpha=np.array([one.alpha for one in of_nodes]),
            temperature=np.array([of_nodes[node].temperature for node in firsts], dtype=np.float64),
            temperature_entries=np.array(entries),
            cooling=np.array([one.cooling for one in of_nodes]),
            gamma=np.array([gamma]),
            stack=np.zeros((longest_path(flat), 4), dtype=np.int64),
            visited=np.zeros(memory, dtype=np.int64),
            clock=np.zeros(2, dtype=np.int64),
            choices=np.zeros(edges, dtype=np.int64),
            choice_values=np.zeros(edges),
            scratch=np.zeros(edges),
        )

    def start(self, state: int, stream: Stream) -> int:
        """Start an episode; return the first action. Raises ValueError for a state that there is not."""
        self._check(state)
        return start_episode(self.learner, state, stream)

    def step(self, reward: float, state: int, terminal: bool, stream: Stream) -> int:
        """Learn from the last action's `reward` and next `state`; return the next action.

        After the end of the episode it is NO_ACTION, and `start` comes next. Raises ValueError for a
        state that there is not, or where no episode has started.
        """
        self._check(state)
        if self.learner.clock[DEPTH] == 0:
            raise ValueError("no episode has started")
        return learn_and_select(self.learner, reward, state, terminal, stream)

    def greedy_action(self, state: int) -> int:
        """Return the action that is best by all that was learnt; NO_ACTION where the root has ended."""
        self._check(state)
        return greedy_action(self.learner.graph, self.learner.tables, state)

    def value(self, state: int, name: str | None = None) -> float:
        """Return V(i, s) of a subtask, the root if none is named (eq. 3.9)."""
        node = self._project(state, name)
        return float(self.learner.tables.node_values[node])

    def decomposition(self, state: int) -> list[tuple[str, float]]:
        """Return the terms of V(0, s) along the greedy path, from its primitive to the root (eq. 3.12).

        A term is named V(North), or C(Get, Navigate(R)). Where the root has ended there is none.
        """
        graph, tables = self.learner.graph, self.learner.tables
        node = self._project(state, None)
        terms: list[tuple[str, float]] = []
        names = self.graph.order
        while node >= graph.actions.size:
            edge = int(tables.best_edges[node])
            if edge == NO_EDGE:
                return []
            child = int(graph.targets[edge, state])
            value = completion(graph, tables.completions, edge, state)
            terms.append((f"C({names[node]}, {names[child]})", value))
            node = child
        terms.append((f"V({names[node]})", float(tables.node_values[node])))
        return terms[::-1]

    @property
    def steps(self) -> int:
        """The steps of this episode so far."""
        return int(self.learner.clock[TIME])

    def temperature(self, name: str) -> float:
        """Return the temperature that a subtask has now."""
        entry = self.learner.temperature_entries[self._numbers[self.graph[name].name]]
        return float(self.learner.temperature[entry])

    def inherit(self, other: "MaxqQ", name: str) -> None:
        """Take over what another learner knows of a subtask and of all below it, which both graphs have.

        That is Lamarckian inheritance of an untouched subtree (Paper V): values are recursively optimal,
        and hold whoever invokes the subtask. Temperatures come with them. Raises TaskGraphError where the
        subtrees differ.
        """
        for one in self.graph.descendants(name):
            if self.graph[one] is not other.graph[one]:
                raise TaskGraphError(f"{name} differs in the two task graphs, at {one}")
            mine, theirs = self._numbers[one], other._numbers[one]
            own, others = self.learner.temperature_entries, other.learner.temperature_entries
            self.learner.temperature[own[mine]] = other.learner.temperature[others[theirs]]
            for table, source, here, there in zip(
                self.learner.tables[:3],
                other.learner.tables[:3],
                self._slices(mine),
                other._slices(theirs),
                strict=True,
            ):
                table[here] = source[there]

    def entries(self, name: str) -> int:
        """Return the numbers that are stored for a subtask alone, V or C."""
        values, completions, _ = self._slices(self._numbers[self.graph[name].name])
        return int(values.stop - values.start + completions.stop - completions.start)

    def _slices(self, node: int) -> tuple[slice, slice, slice]:
        """Return where the tables V, C and C~ have the entries of a node."""
        first_values, first_completions = self.sizes
        edges = self.learner.graph.first_edges
        first, last = edges[node], edges[node + 1]
        completions = slice(int(first_completions[first]), int(first_completions[last]))
        if node < self.learner.graph.actions.size:
            values = slice(int(first_values[node]), int(first_values[node + 1]))
        else:
            values = slice(0, 0)
        return values, completions, completions

    def _project(self, state: int, name: str | None) -> int:
        self._check(state)
        node = self._numbers[self.graph.root if name is None else self.graph[name].name]
        project(self.learner.graph, self.learner.tables, node, state)
        return node

    def _check(self, state: int) -> None:
        if not 0 <= state < self.graph.states:
            raise ValueError(f"a state is in 0 ... {self.graph.states - 1}, got {state}")
