"""Action selection (section 2.6): greedy, epsilon-greedy, softmax (eq. 2.18), and their decay.

Each policy takes one uniform draw `u` in [0, 1) and gives back an action, so that whoever owns the
random generator also owns the history. Exact ties between greedy actions are broken fairly.
Whatever the values are, NaN included, the answer is a valid action: a learner that diverged must
not bring its robot down.

Equation 2.18 is printed with the sum inside the exponential; the policy meant, and built here, is
P(a|s) = exp(Q(s, a) / tau) / sum_b exp(Q(s, b) / tau).
"""

import numpy as np

from crcolony.compiled import FloatArray, compiled

NEVER = -700.0
"""An exponent below this is a probability below 1e-300; exp takes a slow path there."""


@compiled
def greedy(values: FloatArray, u: float) -> int:
    """The action of the largest of `values` (actions,); `u` chooses among exact ties."""
    best = 0
    ties = 1
    for action in range(1, values.shape[0]):
        if values[action] > values[best]:
            best = action
            ties = 1
        elif values[action] == values[best]:
            ties += 1
    if ties == 1:
        return best
    skip = min(int(u * ties), ties - 1)
    for action in range(best + 1, values.shape[0]):
        if skip == 0:
            break
        if values[action] == values[best]:
            best = action
            skip -= 1
    return best


@compiled
def epsilon_greedy(values: FloatArray, epsilon: float, u: float) -> int:
    """A random action with probability `epsilon`, else the greedy one; one draw serves both."""
    if u < epsilon:
        actions: int = values.shape[0]
        return min(int(u / epsilon * actions), actions - 1)
    return greedy(values, (u - epsilon) / (1.0 - epsilon))


@compiled
def softmax(values: FloatArray, temperature: float, scratch: FloatArray, u: float) -> int:
    """An action drawn from the Boltzmann distribution of `values` (actions,).

    `temperature` >= 0; at 0, and as it gets there, this is `greedy(values, u)`, action for action.
    `scratch` (actions,) is overwritten.
    """
    best = 0
    for action in range(1, values.shape[0]):
        if values[action] > values[best]:
            best = action
    total = 0.0
    for action in range(values.shape[0]):
        behind = values[action] - values[best]
        if behind == 0.0:
            scratch[action] = 1.0  # also at a temperature of 0
        elif behind > NEVER * temperature:
            scratch[action] = np.exp(behind / temperature)
        else:
            scratch[action] = 0.0
        total += scratch[action]
    threshold = u * total
    cumulated = 0.0
    for action in range(values.shape[0]):
        cumulated += scratch[action]
        if cumulated > threshold:
            return action
    return best  # only reached where values are NaN: u < 1, and both sums round alike


@compiled
def linear_decay(initial: float, k: float, t: float) -> float:
    """tau_t = tau_0 - k t, but never below 0."""
    return max(initial - k * t, 0.0)


@compiled
def exponential_decay(initial: float, k: float, t: float) -> float:
    """tau_t = k tau_(t-1), that is tau_0 k^t."""
    return float(initial * k**t)


@compiled
def hyperbolic_decay(initial: float, k: float, t: float) -> float:
    """tau_t = tau_0 / (1 + k t)."""
    return initial / (1.0 + k * t)


def greedy_probabilities(values: FloatArray) -> FloatArray:
    """P(a|s) (actions,) of `greedy`: the best actions share everything."""
    best = values == values.max()
    return np.asarray(best / best.sum(), dtype=np.float64)


def epsilon_greedy_probabilities(values: FloatArray, epsilon: float) -> FloatArray:
    """P(a|s) (actions,) of `epsilon_greedy`."""
    return epsilon / values.size + (1.0 - epsilon) * greedy_probabilities(values)


def softmax_probabilities(values: FloatArray, temperature: float) -> FloatArray:
    """P(a|s) (actions,) of `softmax`, equation 2.18; its limit at 0 is greedy."""
    if temperature < 0.0:
        raise ValueError(f"a temperature is not negative, got {temperature}")
    if temperature == 0.0:
        return greedy_probabilities(values)
    with np.errstate(over="ignore"):  # -inf is what a tiny temperature means
        responses = np.exp((values - values.max()) / temperature)
    return np.asarray(responses / responses.sum(), dtype=np.float64)
