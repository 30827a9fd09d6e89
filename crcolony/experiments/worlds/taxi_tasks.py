"""The task graph of the taxi (figure 3.2 of the thesis), with Dietterich's state abstractions or without."""

import numpy as np

from crcolony.compiled import IntArray
from crcolony.experiments.worlds.taxi import (
    ACTION_NAMES,
    CELLS,
    IN_TAXI,
    PICKUP,
    PUTDOWN,
    STAND_CELLS,
    STAND_NAMES,
    STANDS,
    STATES,
    factors_of_states,
)
from crcolony.learning.maxq.maxq_learner import NodeParameters
from crcolony.learning.maxq.task_graph import NO_ENTRY, Composite, Primitive, QNode, TaskGraph

MOVES = ACTION_NAMES[:PICKUP]
NAVIGATE = tuple(f"Navigate({stand})" for stand in STAND_NAMES)


INITIAL_VALUE = 0.123
"""Of all tables, as Dietterich has it: a value that no state has, so that what is untouched can be told."""


def dietterich_parameters(abstract: bool) -> dict[str, NodeParameters]:
    """Return the meta-parameters that Dietterich (2000) tuned for each subtask, with abstractions or without."""
    alpha = 0.25 if abstract else 0.5
    cooling = dict.fromkeys(NAVIGATE, 0.9879)
    if abstract:
        cooling |= {"Root": 0.9074, "Get": 0.9526, "Put": 0.9526}
    else:
        cooling |= {"Root": 0.9996, "Get": 0.9939, "Put": 0.9996}
    primitives = dict.fromkeys(ACTION_NAMES, NodeParameters(alpha))
    return primitives | {name: NodeParameters(alpha, 50.0, one) for name, one in cooling.items()}


def taxi_tasks(abstract: bool) -> TaskGraph:
    """Return the graph: 14,000 values, or 632 with abstractions.

    Three of these are safe only without discounting: a completion after Navigate, and after Get, depends on where
    that has led, not on how long it took.
    """
    cell, passenger, destination = factors_of_states()
    waits = passenger != IN_TAXI
    source = np.where(waits, passenger, 0)  # Get, which asks for it, has ended where nobody waits
    stands = np.array(STAND_CELLS)
    legal_pickup = waits & (cell == stands[source])
    legal_putdown = ~waits & (cell == stands[destination])
    depends_on = _index_of if abstract else _all_states
    by_source, by_destination = (source, STANDS), (destination, STANDS)
    navigate = [
        Composite(
            name,
            tuple(QNode((move,), abstraction=depends_on((cell, CELLS))) for move in MOVES),
            terminal=cell == stands[stand],
            parameterised="Navigate",
        )
        for stand, name in enumerate(NAVIGATE)
    ]
    get = Composite(
        "Get",
        (
            QNode(NAVIGATE, source, depends_on(by_source)),
            QNode(("Pickup",), abstraction=depends_on((cell, CELLS), by_source)),
        ),
        terminal=~waits,
    )
    put = Composite(
        "Put",
        (
            QNode(NAVIGATE, destination, depends_on(by_destination)),
            QNode(("Putdown",), abstraction=depends_on((cell, CELLS), by_destination)),
        ),
        terminal=waits,
    )
    nothing_left = np.full(STATES, NO_ENTRY) if abstract else None
    root = Composite(
        "Root",
        (
            QNode(("Get",), abstraction=depends_on(by_source, by_destination)),
            QNode(("Put",), abstraction=nothing_left),
        ),
        terminal=np.zeros(STATES, dtype=np.bool_),
    )
    primitives = [Primitive(name, action, depends_on()) for action, name in enumerate(MOVES)]
    primitives.append(Primitive("Pickup", PICKUP, depends_on((legal_pickup.astype(int), 2))))
    primitives.append(Primitive("Putdown", PUTDOWN, depends_on((legal_putdown.astype(int), 2))))
    return TaskGraph(STATES, (root, get, put, *navigate, *primitives))


def _index_of(*factors: tuple[IntArray, int]) -> IntArray | None:
    """Return an abstraction: an index that tells apart nothing but these factors, given with their sizes."""
    index = np.zeros(STATES, dtype=np.int64)
    for values, size in factors:
        index = index * size + values
    return index


def _all_states(*_: tuple[IntArray, int]) -> IntArray | None:
    """Return no abstraction: every state has its own entry."""
    return None
