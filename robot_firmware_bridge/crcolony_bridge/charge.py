"""How a physical battery becomes the energy that a robot lives on: one function for all robots."""

_NOISE = 0.01
"""A level must rise by more than this to be charge: the voltage of a battery recovers a little when motors stop."""


class ChargeMeter:
    """Turns levels of a battery (0 to 1) into the observation's `charge`: energy taken in the last control period.

    Filling the battery from empty to full gives `energy_per_charge`, as `life.energy` has it.
    """

    def __init__(self, energy_per_charge: float = 1.0) -> None:
        self._energy_per_charge = energy_per_charge
        self._lowest: float | None = None

    def fall(self, level: float) -> float:
        """Follow a level that falls; return the lowest so far. What it rises above that is for the next `update`."""
        self._lowest = level if self._lowest is None else min(self._lowest, level)
        return self._lowest

    def update(self, level: float) -> float:
        """Return the energy that was taken until now; a level that falls gives none."""
        rise = level - self.fall(level)
        if rise <= _NOISE:
            return 0.0
        self._lowest = level
        return min(rise * self._energy_per_charge, 1.0)
