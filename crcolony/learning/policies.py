"""Action selection (section 2.6): greedy, epsilon-greedy, softmax (eq. 2.18), and their decay.

Each policy is a function of one uniform draw `u` in [0, 1), so that the caller decides about
randomness. Exact ties between greedy actions are broken fairly. Whatever the values are, NaN
included, the result is a valid action: a learner that has diverged must not crash its robot.

Equation 2.18 is printed with the sum inside the exponential; what is meant, and implemented, is
P(a|s) = exp(Q(s, a) / tau) / sum_b exp(Q(s, b) / tau).
"""

import numpy as np

from crcolony.compiled import FloatArray, compiled

NO_ACTION = -1
"""The action after a terminal state."""
MIN_EXPONENT = -700.0
"""Below this exponent, of a probability below 1e-300, exp() is not computed: it would be slow."""


@compiled
def greedy(values: FloatArray, u: float) -> int:
    """Return the action of the largest of `values` (actions,); `u` selects among exact ties."""
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
    """Return a random action with probability `epsilon`, else the greedy one, by one draw `u`."""
    if u < epsilon:
        actions: int = values.shape[0]
        return min(int(u / epsilon * actions), actions - 1)
    return greedy(values, (u - epsilon) / (1.0 - epsilon))


@compiled
def softmax(values: FloatArray, temperature: float, scratch: FloatArray, u: float) -> int:
    """Return an action drawn from the Boltzmann distribution of `values` (actions,) (eq. 2.18).

    `temperature` >= 0; at 0, and in the limit, this is `greedy(values, u)` for every `u`.
    `scratch` (actions,) is overwritten.
    """
    if temperature == 0.0:
        return greedy(values, u)
    best = 0
    for action in range(1, values.shape[0]):
        if values[action] > values[best]:
            best = action
    total = 0.0
    for action in range(values.shape[0]):
        difference = values[action] - values[best]
        if difference == 0.0:
            scratch[action] = 1.0  # also at a temperature of 0
        elif difference > MIN_EXPONENT * temperature:
            scratch[action] = np.exp(difference / temperature)
        else:
            scratch[action] = 0.0
        total += scratch[action]
    threshold = u * total
    cumulative = 0.0
    for action in range(values.shape[0]):
        cumulative += scratch[action]
        if cumulative > threshold:
            return action
    return best  # only reached where values are NaN: u < 1, and both sums round alike


@compiled
def linear_decay(initial: float, k: float, t: float) -> float:
    """Return tau_t = tau_0 - k t, but never below 0."""
    return max(initial - k * t, 0.0)


@compiled
def exponential_decay(initial: float, k: float, t: float) -> float:
    """Return tau_t = k tau_(t-1), that is tau_0 k^t."""
    return float(initial * k**t)


@compiled
def hyperbolic_decay(initial: float, k: float, t: float) -> float:
    """Return tau_t = tau_0 / (1 + k t)."""
    return initial / (1.0 + k * t)


def greedy_probabilities(values: FloatArray) -> FloatArray:
    """Return P(a|s) (actions,) of `greedy`: the best actions are equally likely."""
    best = values == values.max()
    return np.asarray(best / best.sum(), dtype=np.float64)


def epsilon_greedy_probabilities(values: FloatArray, epsilon: float) -> FloatArray:
    """Return P(a|s) (actions,) of `epsilon_greedy`."""
    return epsilon / values.size + (1.0 - epsilon) * greedy_probabilities(values)


def softmax_probabilities(values: FloatArray, temperature: float) -> FloatArray:
    """Return P(a|s) (actions,) of `softmax`, equation 2.18; at a temperature of 0 it is greedy.

    Raises ValueError for a negative temperature.
    """
    if temperature < 0.0:
        raise ValueError(f"a temperature is not negative, got {temperature}")
    if temperature == 0.0:
        return greedy_probabilities(values)
    with np.errstate(over="ignore"):  # -inf is what a tiny temperature means
        responses = np.exp((values - values.max()) / temperature)
    return np.asarray(responses / responses.sum(), dtype=np.float64)
