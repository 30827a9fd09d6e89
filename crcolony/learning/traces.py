"""Eligibility traces, equations 2.15 to 2.17: replacing traces with clearing, updated lazily.

Equation 2.15 gives every weight its share of every TD error, which costs a pass over all traces in
every step. Wiering and Schmidhuber (1998) observed that a weight is not read until its tile is
active again, so that its share can be applied then. All traces fade by the same factor; with the
running product DECAY_t = prod gamma lambda, a trace set to 1 at time v is now DECAY_t / DECAY_v,
and the update that is pending for its weight is

    alpha / N * sum_t delta_t DECAY_t / DECAY_v = rate * SCALE * (ERRORS - SUM)

where ERRORS = sum_t delta_t DECAY_t is stored once for all traces, SCALE = 1 / DECAY_v, and SUM is
ERRORS when the tile was last updated. Clearing keeps this small: at most one action of a tile has a
trace, so a tile needs just three numbers. Nothing is lost but rounding, and a step costs the same
however many traces there are; all of them are visited only when DECAY has become small, to scale it
back to 1.

The readable definitions come first: (n, actions) traces `e`, faded and set in every step. The lazy
ones, from `apply_pending` on, are tested against them.

The arrays of one learner (n tiles):

    weights     (any, actions)  Theta of Algorithm 2.2
    traces        (n, 4)        ACTION, SCALE (0: the tile has no trace), SUM and ROW of each tile
    traced_tiles  (n,)          the tiles that have a trace, in its first COUNT elements
    totals        (3,)          DECAY, ERRORS and COUNT; starts as (1, 0, 0)

Where `tiles` (N,) are active, `rows` (N,) are the rows of `weights` that they have: a learner with a
row for every tile passes its tiles.

`rate` is alpha / N. Pending updates are applied at one rate: call `clear_traces` before changing
it.
"""

from crcolony.compiled import AnyFloatArray, FloatArray, IntArray, as_index, compiled


def accumulate(
    e: FloatArray, indices: IntArray, values: FloatArray, action: int, gamma_lambda: float
) -> None:
    """Accumulating traces (eq. 2.16): a feature's value is added to what is left of its trace."""
    e *= gamma_lambda
    e[indices, action] += values


def replace(e: FloatArray, indices: IntArray, action: int, gamma_lambda: float) -> None:
    """Replacing traces: that of an active feature and the action taken is 1, never more."""
    e *= gamma_lambda
    e[indices, action] = 1.0


def replace_and_clear(e: FloatArray, indices: IntArray, action: int, gamma_lambda: float) -> None:
    """Replacing traces with clearing (eq. 2.17): the other actions of an active feature get 0."""
    e *= gamma_lambda
    e[indices] = 0.0
    e[indices, action] = 1.0


def truncate(e: FloatArray, gamma_lambda: float, m: int) -> None:
    """Clear the traces that are older than `m` steps: keep e >= (gamma lambda)^m (section 2.5)."""
    e[e < gamma_lambda**m] = 0.0


ACTION = 0
"""Column of `traces`: the action that has the trace of a tile."""
SCALE = 1
"""Column of `traces`: 1 / DECAY when the trace was set; 0 if the tile has no trace."""
SUM = 2
"""Column of `traces`: ERRORS when the tile was last updated."""
ROW = 3
"""Column of `traces`: the row of `weights` that the tile has."""
DECAY = 0
"""Element of `totals`: the running product of gamma lambda."""
ERRORS = 1
"""Element of `totals`: the running sum of delta * DECAY."""
COUNT = 2
"""Element of `totals`: the number of tiles that have a trace."""

MIN_DECAY = 1e-4
"""Below this DECAY is scaled back to 1: an error is added to ERRORS as delta * DECAY and read as a
difference, so that about 1e-16 / DECAY of it is lost to rounding."""
MIN_TRACE = 1e-14
"""A trace below this is cleared: it changes a weight by less than rounding does."""


@compiled
def apply_pending(
    weights: AnyFloatArray, trace: FloatArray, errors: float, row: int, rate: float
) -> None:
    """Apply to a row of weights the update that is pending for them (eq. 2.15), as the `trace` (4,) of
    their tile and ERRORS have it."""
    scale = trace[SCALE]
    if scale != 0.0:
        pending = scale * (errors - trace[SUM])
        weights[as_index(row), as_index(trace[ACTION])] += rate * pending
        trace[SUM] = errors


@compiled
def action_values(
    weights: AnyFloatArray,
    traces: FloatArray,
    totals: FloatArray,
    tiles: IntArray,
    rows: IntArray,
    rate: float,
    out: FloatArray,
) -> None:
    """Write to `out` (actions,) the values Q_s of a state with active `tiles` (N,) (eq. 2.23)."""
    errors = totals[ERRORS]
    for position in range(tiles.shape[0]):
        apply_pending(weights, traces[as_index(tiles[position])], errors, rows[position], rate)
    for action in range(out.shape[0]):
        value = 0.0
        for position in range(rows.shape[0]):
            value += weights[as_index(rows[position]), action]
        out[action] = value


@compiled
def set_traces(
    weights: AnyFloatArray,
    traces: FloatArray,
    traced_tiles: IntArray,
    totals: FloatArray,
    tiles: IntArray,
    rows: IntArray,
    action: int,
    gamma_lambda: float,
    rate: float,
) -> None:
    """Fade all traces; set those of active `tiles` (N,) to 1 for `action`, 0 for others (eq.
    2.17)."""
    totals[DECAY] *= gamma_lambda
    if totals[DECAY] < MIN_DECAY:
        renormalise(weights, traces, traced_tiles, totals, rate)
    scale, errors = 1.0 / totals[DECAY], totals[ERRORS]
    count = int(totals[COUNT])
    for position in range(tiles.shape[0]):
        trace = traces[as_index(tiles[position])]
        if trace[SCALE] == 0.0:
            traced_tiles[count] = tiles[position]
            count += 1
        else:
            apply_pending(weights, trace, errors, rows[position], rate)
        trace[ACTION] = action
        trace[SCALE] = scale
        trace[SUM] = errors
        trace[ROW] = rows[position]
    totals[COUNT] = count


@compiled
def accumulate_error(totals: FloatArray, delta: float) -> None:
    """Make the TD error `delta` pending for all weights that have a trace (eq. 2.15)."""
    totals[ERRORS] += delta * totals[DECAY]


@compiled
def renormalise(
    weights: AnyFloatArray,
    traces: FloatArray,
    traced_tiles: IntArray,
    totals: FloatArray,
    rate: float,
) -> None:
    """Apply all pending updates, scale DECAY back to 1, and clear traces that have faded to
    nothing."""
    kept, errors = 0, totals[ERRORS]
    for position in range(int(totals[COUNT])):
        trace = traces[as_index(traced_tiles[position])]
        apply_pending(weights, trace, errors, trace[ROW], rate)
        faded = trace[SCALE] * totals[DECAY]
        if faded < MIN_TRACE:
            trace[SCALE] = 0.0
            continue
        trace[SCALE] = faded
        trace[SUM] = 0.0
        traced_tiles[kept] = traced_tiles[position]
        kept += 1
    totals[DECAY] = 1.0
    totals[ERRORS] = 0.0
    totals[COUNT] = kept


@compiled
def clear_traces(
    weights: AnyFloatArray,
    traces: FloatArray,
    traced_tiles: IntArray,
    totals: FloatArray,
    rate: float,
) -> None:
    """Apply all pending updates and clear all traces, as at the start of an episode: e <- 0."""
    totals[DECAY] = 0.0  # every trace has faded to nothing
    renormalise(weights, traces, traced_tiles, totals, rate)
