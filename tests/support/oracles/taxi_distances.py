"""Distances on the taxi's grid by breadth-first search over a drawing of it, and the best returns that follow."""

from collections import deque

import numpy as np

from crcolony.compiled import FloatArray, IntArray

MAP = (
    "R:_|_:_:G",
    "_:_|_:_:_",
    "_:_:_:_:_",
    "_|_:_|_:_",
    "Y|_:_|B:_",
)
"""A cell each second character, and whether there is a wall (|) between two."""
STANDS = "RGYB"


def stand_distances() -> IntArray:
    """Return steps (stands, cells) from each stand."""
    distances = np.full((4, 25), -1)
    for stand, name in enumerate(STANDS):
        start = next((r, line.index(name) // 2) for r, line in enumerate(MAP) if name in line)
        queue = deque([(start, 0)])
        while queue:
            (row, column), steps = queue.popleft()
            if distances[stand, 5 * row + column] >= 0:
                continue
            distances[stand, 5 * row + column] = steps
            near = [(row - 1, column), (row + 1, column)]
            near += [(row, column - 1)] if column > 0 and MAP[row][2 * column - 1] == ":" else []
            near += [(row, column + 1)] if column < 4 and MAP[row][2 * column + 1] == ":" else []
            queue.extend((cell, steps + 1) for cell in near if 0 <= cell[0] < 5)
    return distances


def best_returns(step_cost_in_addition: bool) -> FloatArray:
    """Return the best return (cells, stands, stands) of fetching from one stand and bringing to another."""
    distances = stand_distances()
    stands = [int(np.flatnonzero(row == 0)[0]) for row in distances]
    fetch = distances.T[:, :, None] + 1
    bring = distances[:, stands][None, :, :]
    last = 19.0 if step_cost_in_addition else 20.0
    return np.asarray(last - fetch - bring, dtype=np.float64)
