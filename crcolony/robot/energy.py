"""Energy (thesis 4.5, 5.3): a step costs some, a pack gives some, and conception depends on it."""

from crcolony.compiled import compiled


@compiled
def next_energy(energy: float, charge: float, cost: float) -> float:
    """Return the energy after one step: with the charge, at most 1; less the cost of the step,
    never below 0."""
    return max(min(energy + charge, 1.0) - cost, 0.0)


def conception_probability(energy: float, threshold: float, exponent: float) -> float:
    """Return the probability that a mating leads to an offspring in the robot's own subpopulation
    (Paper III)."""
    if energy <= 0.0 or energy < threshold:
        return 0.0
    return float(energy**exponent)
