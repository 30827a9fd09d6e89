"""Where the weights of the agents of all robots are: in a row for every tile that an agent has visited.

In a lifetime an agent visits less than half of its tiles. The weights of all robots are one table of
32-bit numbers with room for all tiles of all agents. At its first visit a tile gets a row of its
robot, and a new generation begins with the first row again. A robot has rows in blocks of 256: it
takes a free block of the table when it needs one, and gives all back at a new generation. So the
rows that are in use are together, and the rest of the table is memory that the system gives to nobody
before it is written: the colony takes what all robots need together at most, and not as many times
as there are robots what the most curious of them needs.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import IntArray, RowArray, as_index, compiled
from crcolony.learning.traces import COUNT, ROW, SCALE
from crcolony.robot.state import Robots

_NO_ROW = -1
_BLOCK_BITS = 8
_BLOCK_ROWS = 1 << _BLOCK_BITS
_WITHIN_BLOCK = _BLOCK_ROWS - 1

SAVED_APART = ("weights", "traces")
"""Fields that `save_weights` and `restore_weights` are for."""
BLOCKS = ("weight_blocks", "free_blocks", "free_count")
"""Fields that say where rows are, which differs from colony to colony, and is not saved."""


def no_rows(robots: int, agents: int, modules: int, tiles: int) -> RowArray:
    """Return the rows of tiles that have none yet, in as few bytes as they need."""
    shape = (robots, agents, modules, tiles)
    highest = agents * modules * tiles - 1
    kind = np.int16 if highest <= np.iinfo(np.int16).max else np.int32
    return np.full(shape, _NO_ROW, dtype=kind)


def block_count(tiles: int) -> int:
    """Return the blocks that a robot with so many tiles of all agents and modules needs at most."""
    return -(-tiles // _BLOCK_ROWS)


def table_rows(robots: int, tiles: int) -> int:
    """Return the rows of the weights of so many robots."""
    return robots * block_count(tiles) * _BLOCK_ROWS


def all_blocks(robots: int, tiles: int) -> IntArray:
    """Return the first row of every block of the table, that of the block to be taken first at the end."""
    return np.arange(robots * block_count(tiles), dtype=np.int64)[::-1] * _BLOCK_ROWS


@compiled
def give_rows(robots: Robots, i: int, agent: int, module: int, initial_weight: float) -> None:
    """Write the rows of `robots.next_tiles` to `robots.next_rows`; a tile that has none yet gets one,
    with the initial weight."""
    rows = robots.weight_rows[i, agent, module]
    blocks = robots.weight_blocks[i]
    for position in range(robots.next_tiles.shape[0]):
        tile = as_index(robots.next_tiles[position])
        is_new = rows[tile] < 0
        if is_new:
            used = robots.rows_used[i]
            if used & _WITHIN_BLOCK == 0:
                robots.free_count[0] -= 1
                blocks[used >> _BLOCK_BITS] = robots.free_blocks[robots.free_count[0]]
            rows[tile] = used
            robots.rows_used[i] += 1
        own = np.int64(rows[tile])
        row = blocks[as_index(own >> _BLOCK_BITS)] + (own & _WITHIN_BLOCK)
        if is_new:
            for action in range(robots.weights.shape[1]):
                robots.weights[row, action] = initial_weight
        robots.next_rows[position] = row


@compiled
def find_rows(robots: Robots, i: int, agent: int, module: int) -> None:
    """Write the rows of the last state's active tiles to `robots.state_rows`."""
    for position in range(robots.state_rows.shape[0]):
        tile = as_index(robots.state_tiles[i, position])
        own = np.int64(robots.weight_rows[i, agent, module, tile])
        block = robots.weight_blocks[i, as_index(own >> _BLOCK_BITS)]
        robots.state_rows[position] = block + (own & _WITHIN_BLOCK)


def forget(robots: Robots, i: int) -> None:
    """Take the rows of all tiles of robot i away: its agents have learnt nothing."""
    robots.weight_rows[i] = _NO_ROW
    _take_blocks(robots, i, 0)


def _take_blocks(robots: Robots, i: int, rows: int) -> None:
    """Give all blocks of robot i back, and take as many as so many rows need."""
    free, blocks, count = robots.free_blocks, robots.weight_blocks[i], int(robots.free_count[0])
    held, needed = block_count(int(robots.rows_used[i])), block_count(rows)
    free[count : count + held] = blocks[:held][::-1]
    count += held
    blocks[:needed] = free[count - needed : count][::-1]
    robots.free_count[0] = count - needed
    robots.rows_used[i] = rows


def _rows_in_table(robots: Robots, i: int, rows: NDArray[Any]) -> IntArray:
    """Return where in the table these of robot i's own rows are."""
    own = rows.astype(np.int64)
    found: IntArray = robots.weight_blocks[i][own >> _BLOCK_BITS] + (own & _WITHIN_BLOCK)
    return found


def weights_by_tile(robots: Robots, i: int, initial_weight: float) -> NDArray[np.float32]:
    """Return the weights of robot i's agents as a table of all tiles, (A, M, T, K)."""
    rows = robots.weight_rows[i]
    table = np.full((*rows.shape, robots.weights.shape[1]), initial_weight, dtype=np.float32)
    table[rows >= 0] = robots.weights[_rows_in_table(robots, i, rows[rows >= 0])]
    return table


def inherit_weights(
    robots: Robots, i: int, table: NDArray[np.float32], is_visited: NDArray[np.bool_]
) -> None:
    """Give the agents of robot i what others have learnt: weights as a table (A, M, T, K), and which tiles were visited
    (A, M, T), as a lifetime ends."""
    used = int(np.count_nonzero(is_visited))
    _take_blocks(robots, i, used)
    rows = robots.weight_rows[i]
    rows[...] = _NO_ROW
    rows[is_visited] = np.arange(used)
    robots.weights[_rows_in_table(robots, i, rows[is_visited])] = table[is_visited]


def save_weights(robots: Robots, i: int) -> dict[str, np.ndarray]:
    """Return copies of robot i's weights and traces, as if it were alone."""
    own = np.arange(robots.rows_used[i])
    traces, rows = robots.traces[i].copy(), robots.weight_rows[i, robots.agent[i], robots.module[i]]
    traces[:, ROW] = np.where(traces[:, SCALE] != 0.0, rows, 0)  # of the module in control alone
    return {"weights": robots.weights[_rows_in_table(robots, i, own)], "traces": traces}


def restore_weights(robots: Robots, i: int, saved: Mapping[str, Any]) -> None:
    """Restore what `save_weights` returned, to whichever robot.

    Raises ValueError if it does not fit: compiled code checks no index.
    """
    most = robots.weight_rows[i].size
    weights, rows, traces, used = (
        np.asarray(saved.get(name, _NO_ROW))
        for name in ("weights", "weight_rows", "traces", "rows_used")
    )
    traced_rows = traces[traces[:, SCALE] != 0.0, ROW] if traces.ndim == 2 else traces
    fits = (
        weights.shape == (used, robots.weights.shape[1])
        and used <= most
        and rows.shape == robots.weight_rows[i].shape
        and rows.min() >= _NO_ROW
        and rows.max() < used
        and traces.shape == robots.traces[i].shape
        and (traced_rows >= 0).all()
        and (traced_rows < used).all()
    )
    if not fits:
        raise ValueError("the saved robot does not fit these settings: weights")
    _take_blocks(robots, i, int(used))
    robots.weights[_rows_in_table(robots, i, np.arange(int(used)))] = weights
    robots.traces[i] = traces
    is_traced = traces[:, SCALE] != 0.0
    robots.traces[i, is_traced, ROW] = _rows_in_table(robots, i, traced_rows)


def with_rows(arrays: Mapping[str, Any], initial_weight: float) -> Mapping[str, Any]:
    """Return saved fields with rows, also those of an earlier version, whose weights were a table of
    all tiles (A, M, T, K).

    A tile gets a row if it has learnt, or has a trace, as tiles of the module in control may.
    """
    if "weight_rows" in arrays or np.ndim(arrays.get("weights", 0)) != 4:
        return arrays
    table = np.asarray(arrays["weights"])
    agent, module = int(arrays["agent"]), int(arrays["module"])
    traced = arrays["traced_tiles"][: int(arrays["trace_totals"][COUNT])]
    has_row = np.any(table != initial_weight, axis=-1)
    has_row[agent, module, traced] = True
    used = np.count_nonzero(has_row)
    rows = np.full(has_row.shape, _NO_ROW, dtype=np.int32)
    rows[has_row] = np.arange(used)
    traced_rows = np.maximum(rows[agent, module], 0)
    return {
        **arrays,
        "weights": table[has_row].astype(np.float32),
        "weight_rows": rows,
        "rows_used": np.int64(used),
        "traces": np.column_stack([arrays["traces"], traced_rows]),
    }
