"""Task graphs of MAXQ: subtasks <T_i, A_i, R~_i> (Definition 3.2) and how they invoke each other.

A composite subtask has a Q node for each action that it can select. With a parameter, as in
Navigate(t), a subtask is one composite for each value, and a Q node that names them all binds the
parameter in every state. A Q node's abstraction says what its completion function depends on, and a
primitive's what its reward depends on: states with the same index share an entry of the table.

A graph is a value: one that cannot be learnt with is refused, by the name of the subtask at fault.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import BoolArray, FloatArray, IntArray
from crcolony.errors import CrcolonyError, did_you_mean

NO_ENTRY = -1
"""In an abstraction: here the value is always 0 and there is nothing to learn, nor to store."""


class TaskGraphError(CrcolonyError):
    """A task graph that cannot be learnt with: the message names the subtask and what is wrong."""


@dataclass(frozen=True, eq=False)
class Primitive:
    """A primitive subtask: it executes an action of the world and ends after one step."""

    name: str
    action: int
    abstraction: IntArray | None = None
    """(states,) index of V(i, s), or None: every state has its own"""
    type: str = "primitive"
    """For strongly typed graphs: see `Composite.accepts`"""


@dataclass(frozen=True, eq=False)
class QNode:
    """An action of a composite subtask: it invokes `subtasks[parameter[s]]` in state s."""

    subtasks: tuple[str, ...]
    parameter: IntArray | None = None
    """(states,) which of the subtasks is invoked; None where there is just one"""
    abstraction: IntArray | None = None
    """(states,) index of C(i, s, a), or NO_ENTRY where C is 0; None: every state has its own"""


@dataclass(frozen=True, eq=False)
class Composite:
    """A composite subtask: it selects among its Q nodes until the world is in a terminal state."""

    name: str
    q_nodes: tuple[QNode, ...]
    terminal: BoolArray
    """(states,) the termination predicate T_i. The end of an episode ends every subtask."""
    pseudo_reward: FloatArray | None = None
    """(states,) R~_i(s') of ending in s', negative where s' is no goal; None: it is 0 everywhere"""
    type: str = "composite"
    accepts: frozenset[str] | None = None
    """Types of the subtasks that it may invoke (strongly typed graphs, section 4.2); None: of any"""
    parameterised: str | None = None
    """Navigate, for Navigate(R): the subtask of which it is one value, whose values share a temperature"""


Subtask = Primitive | Composite


@dataclass(frozen=True, eq=False)
class TaskGraph:
    """A MAXQ graph over a world with `states` states, 0 ... states - 1.

    Raises TaskGraphError if it has a circle, not one root, no primitive, a subtask that is unknown,
    of a wrong type or invoked twice by one composite, or an array of a wrong shape or range.
    """

    states: int
    subtasks: tuple[Subtask, ...]

    def __post_init__(self) -> None:
        if self.states < 1:
            raise TaskGraphError(f"a task graph needs a state, got {self.states}")
        _check_names(self.subtasks)
        for subtask in self.subtasks:
            if isinstance(subtask, Primitive):
                _check_primitive(subtask, self.states)
            else:
                _check_composite(subtask, self.states, self._by_name)
        _check_circles(self)
        if len(roots := self._roots) != 1:
            found = ", ".join(roots)
            raise TaskGraphError(f"a task graph has one root, not {len(roots)}: {found}")
        if isinstance(self._by_name[roots[0]], Primitive):
            raise TaskGraphError(
                f"{roots[0]} is the root of a task graph, but no composite subtask"
            )

    def __getitem__(self, name: str) -> Subtask:
        """Return a subtask by its name. Raises TaskGraphError if there is none."""
        if name not in self._by_name:
            raise TaskGraphError(f"no subtask {name}{did_you_mean(name, self._by_name)}")
        return self._by_name[name]

    @property
    def root(self) -> str:
        """The subtask that no other invokes."""
        return self._roots[0]

    @cached_property
    def order(self) -> tuple[str, ...]:
        """All names, primitives first and every subtask after those that it invokes; the root is last."""
        primitives = [one.name for one in self.subtasks if isinstance(one, Primitive)]
        ordered = dict.fromkeys(sorted(primitives, key=lambda name: self._action(name)))

        def visit(name: str) -> None:
            for child in children(self._by_name[name]):
                visit(child)
            ordered.setdefault(name)

        visit(self.root)
        return tuple(ordered)

    def temperature_name(self, name: str) -> str:
        """Return the name under which a subtask has its temperature: its own, or that of what it is a value of."""
        subtask = self[name]
        return (isinstance(subtask, Composite) and subtask.parameterised) or name

    def descendants(self, name: str) -> frozenset[str]:
        """Return the names of a subtask and of all that it may invoke, directly or not."""
        found = {name}
        for child in children(self[name]):
            found |= self.descendants(child)
        return frozenset(found)

    @cached_property
    def _by_name(self) -> dict[str, Subtask]:
        return {subtask.name: subtask for subtask in self.subtasks}

    @property
    def _roots(self) -> list[str]:
        invoked = {child for subtask in self.subtasks for child in children(subtask)}
        return [name for name in self._by_name if name not in invoked]

    def _action(self, name: str) -> int:
        subtask = self._by_name[name]
        return subtask.action if isinstance(subtask, Primitive) else -1


def children(subtask: Subtask) -> tuple[str, ...]:
    """Return the names of what a subtask may invoke, in the order of its Q nodes, each once."""
    if isinstance(subtask, Primitive):
        return ()
    return tuple(dict.fromkeys(name for node in subtask.q_nodes for name in node.subtasks))


def _check_names(subtasks: Iterable[Subtask]) -> None:
    names: set[str] = set()
    actions: dict[int, str] = {}
    for subtask in subtasks:
        if subtask.name in names:
            raise TaskGraphError(f"there are two subtasks {subtask.name}")
        names.add(subtask.name)
        if isinstance(subtask, Primitive):
            other = actions.setdefault(subtask.action, subtask.name)
            if other != subtask.name:
                raise TaskGraphError(f"{subtask.name} and {other} are both action {subtask.action}")
    if not actions:
        raise TaskGraphError("a task graph needs a primitive subtask")


def _check_primitive(subtask: Primitive, states: int) -> None:
    if subtask.action < 0:
        raise TaskGraphError(f"{subtask.name}: an action is not negative, got {subtask.action}")
    _check_indices(f"{subtask.name}: its abstraction", subtask.abstraction, states, 0)


def _check_composite(subtask: Composite, states: int, known: dict[str, Subtask]) -> None:
    name = subtask.name
    if not subtask.q_nodes:
        raise TaskGraphError(f"{name} invokes nothing: a composite subtask needs a Q node")
    _check_shape(f"{name}: its termination predicate", subtask.terminal, states)
    if subtask.pseudo_reward is not None:
        _check_shape(f"{name}: its pseudo-reward", subtask.pseudo_reward, states)
        if not np.isfinite(subtask.pseudo_reward).all():
            raise TaskGraphError(f"{name}: its pseudo-reward is not finite everywhere")
    invoked: set[str] = set()
    for node in subtask.q_nodes:
        _check_q_node(name, node, states)
        for child in node.subtasks:
            if child not in known:
                raise TaskGraphError(
                    f"{name} invokes {child}, which there is not{did_you_mean(child, known)}"
                )
            if child in invoked:
                raise TaskGraphError(f"{name} invokes {child} twice")
            invoked.add(child)
            type_ = known[child].type
            if subtask.accepts is not None and type_ not in subtask.accepts:
                wanted = " or ".join(sorted(subtask.accepts))
                raise TaskGraphError(f"{name} invokes {child}, a {type_}, but may only a {wanted}")


def _check_q_node(name: str, node: QNode, states: int) -> None:
    if not node.subtasks or (node.parameter is None and len(node.subtasks) > 1):
        raise TaskGraphError(
            f"{name}: a Q node without a parameter invokes one subtask, not {len(node.subtasks)}"
        )
    what = f"{name}: the {{}} of its Q node {'/'.join(node.subtasks)}"
    _check_indices(what.format("parameter"), node.parameter, states, 0, len(node.subtasks) - 1)
    _check_indices(what.format("abstraction"), node.abstraction, states, NO_ENTRY)


def _check_indices(
    what: str, indices: IntArray | None, states: int, least: int, most: float = np.inf
) -> None:
    if indices is None:
        return
    _check_shape(what, indices, states)
    if not np.issubdtype(indices.dtype, np.integer):
        raise TaskGraphError(f"{what} needs whole numbers, got {indices.dtype}")
    if indices.min() < least or indices.max() > most:
        wrong = int(np.flatnonzero((indices < least) | (indices > most))[0])
        raise TaskGraphError(f"{what} is {indices[wrong]} in state {wrong}, out of its range")


def _check_shape(what: str, array: NDArray[Any], states: int) -> None:
    if array.shape != (states,):
        raise TaskGraphError(f"{what} has shape {array.shape}, but there are {states} states")


def _check_circles(graph: TaskGraph) -> None:
    by_name = {subtask.name: subtask for subtask in graph.subtasks}
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        if name in path:
            circle = " → ".join([*path[path.index(name) :], name])
            raise TaskGraphError(f"the task graph has a circle: {circle}")
        if name not in done:
            for child in children(by_name[name]):
                visit(child, (*path, name))
            done.add(name)

    for name in by_name:
        visit(name, ())
