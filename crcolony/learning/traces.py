"""Eligibility traces, equations 2.15 to 2.17: replacing traces with clearing, made lazy.

Equation 2.15 gives every weight its share of every TD error, which costs a pass over all traces in
every step. Wiering and Schmidhuber (1998) observed that nobody looks at a weight until its tile is
active again, so the share can be paid then. All traces fade by the same factor; with the running
product DECAY_t = prod gamma lambda, a trace set to 1 at time v is now DECAY_t / DECAY_v, and what
its weight is owed is

    alpha / N * sum_t delta_t DECAY_t / DECAY_v = rate * SCALE * (ERRORS - SUM)

where ERRORS = sum_t delta_t DECAY_t is kept once for all, SCALE = 1 / DECAY_v, and SUM is ERRORS
when the tile was last paid. Clearing makes this small: at most one action of a tile holds a trace,
so a tile needs just three numbers. Nothing is lost but rounding, and a step costs the same however
many traces are alive; only when DECAY has become small are they visited, to start it anew.

The readable definitions come first: (n, actions) traces `e`, faded and set in every step. The lazy
ones are `settle` and what follows it, and are tested against them.

The arrays of one learner (n tiles):

    weights (n, actions)  Theta of Algorithm 2.2
    traces  (n, 3)        ACTION, SCALE (0: the tile holds no trace) and SUM of each tile
    live    (n,)          the tiles that hold a trace, in its first COUNT places
    clock   (3,)          DECAY, ERRORS and COUNT; starts as (1, 0, 0)

`rate` is alpha / N. What is owed is owed at one rate: call `forget` before changing it.
"""

from crcolony.compiled import FloatArray, IntArray, compiled


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
    """Keep only the traces of the last `m` steps and now, e >= (gamma lambda)^m (section 2.5)."""
    e[e < gamma_lambda**m] = 0.0


ACTION, SCALE, SUM = 0, 1, 2
DECAY, ERRORS, COUNT = 0, 1, 2

# An error is added to ERRORS as delta * DECAY and comes back as a difference, so about 1e-16 /
# DECAY of it is lost to rounding. DECAY starts anew at 1 before that matters.
SMALLEST_DECAY = 1e-4
# A trace below this could not change a weight by more than its error in rounding does.
SMALLEST_TRACE = 1e-14


@compiled
def settle(
    weights: FloatArray, traces: FloatArray, clock: FloatArray, tile: int, rate: float
) -> None:
    """Pay `tile` what it is owed (eq. 2.15)."""
    scale = traces[tile, SCALE]
    if scale != 0.0:
        owed = scale * (clock[ERRORS] - traces[tile, SUM])
        weights[tile, int(traces[tile, ACTION])] += rate * owed
        traces[tile, SUM] = clock[ERRORS]


@compiled
def action_values(
    weights: FloatArray,
    traces: FloatArray,
    clock: FloatArray,
    tiles: IntArray,
    rate: float,
    out: FloatArray,
) -> None:
    """Write to `out` (actions,) the values Q_s of a state with active `tiles` (N,) (eq. 2.23)."""
    for action in range(out.shape[0]):
        out[action] = 0.0
    for position in range(tiles.shape[0]):
        tile = tiles[position]
        settle(weights, traces, clock, tile, rate)
        for action in range(out.shape[0]):
            out[action] += weights[tile, action]


@compiled
def visit(
    weights: FloatArray,
    traces: FloatArray,
    live: IntArray,
    clock: FloatArray,
    tiles: IntArray,
    action: int,
    gamma_lambda: float,
    rate: float,
) -> None:
    """Fade all traces; set those of the active `tiles` (N,) to 1 for `action`, to 0 for others."""
    clock[DECAY] *= gamma_lambda
    if clock[DECAY] < SMALLEST_DECAY:
        renew(weights, traces, live, clock, rate)
    scale = 1.0 / clock[DECAY]
    for position in range(tiles.shape[0]):
        tile = tiles[position]
        if traces[tile, SCALE] == 0.0:
            live[int(clock[COUNT])] = tile
            clock[COUNT] += 1.0
        else:
            settle(weights, traces, clock, tile, rate)
        traces[tile, ACTION] = action
        traces[tile, SCALE] = scale
        traces[tile, SUM] = clock[ERRORS]


@compiled
def learn(clock: FloatArray, delta: float) -> None:
    """Owe the TD error `delta` to all traces (eq. 2.15)."""
    clock[ERRORS] += delta * clock[DECAY]


@compiled
def renew(
    weights: FloatArray, traces: FloatArray, live: IntArray, clock: FloatArray, rate: float
) -> None:
    """Pay every tile and count DECAY from 1 again; traces that have faded away end."""
    kept = 0
    for position in range(int(clock[COUNT])):
        tile = live[position]
        settle(weights, traces, clock, tile, rate)
        trace = traces[tile, SCALE] * clock[DECAY]
        if trace < SMALLEST_TRACE:
            traces[tile, SCALE] = 0.0
            continue
        traces[tile, SCALE] = trace
        traces[tile, SUM] = 0.0
        live[kept] = tile
        kept += 1
    clock[DECAY] = 1.0
    clock[ERRORS] = 0.0
    clock[COUNT] = kept


@compiled
def forget(
    weights: FloatArray, traces: FloatArray, live: IntArray, clock: FloatArray, rate: float
) -> None:
    """Pay every tile and end all traces, as at the start of an episode: e <- 0."""
    clock[DECAY] = 0.0  # every trace has faded to nothing
    renew(weights, traces, live, clock, rate)
