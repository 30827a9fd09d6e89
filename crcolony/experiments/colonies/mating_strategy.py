"""What an agent does where it sees both a battery and a mate: its mating strategy (Elfwing and Doya 2014).

A *forager* always goes for the battery. A *tracker* keeps following the mate, from an energy on that may be 0. The
selector is linear in energy, so that its genes say which an agent is, and at which energy.
"""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.evolution.genotype import Schema

FORAGER, TRACKER, OTHER = "forager", "tracker", "other"
"""The last follows the mate only when it is hungry."""
_MIDDLE = 0.5
"""The energy from which a forager tracks that is made a tracker."""
_SURE = 1e-6
"""More than rounding."""
_BIAS, _ENERGY = "selector.mating.bias", "selector.mating.energy"
_BATTERY, _MATE = (
    "selector.mating.foraging_target_visible",
    "selector.mating.mating_target_visible",
)


def strategies_of(genotypes: FloatArray, schema: Schema) -> np.ndarray:
    """Return the strategy (agents,) of every genotype (agents, genes)."""
    hungry, full = _outputs(genotypes, schema)
    return np.select([(hungry <= 0.0) & (full <= 0.0), full > 0.0], [FORAGER, TRACKER], OTHER)


def threshold_of(genes: FloatArray, schema: Schema) -> float:
    """Return the energy from which a tracker follows the mate; 0: always."""
    hungry, full = _outputs(genes, schema)
    return 0.0 if hungry > 0.0 else float(hungry / (hungry - full))


def mating_range_of(genotypes: FloatArray, schema: Schema, battery: bool, mate: bool) -> FloatArray:
    """Return at which share of all energies from 0 to 1 every genotype (agents, genes) selects mating, (agents,).

    `battery` and `mate` say what is in sight.
    """
    hungry, full = _outputs(genotypes, schema, float(battery), float(mate))
    above = np.maximum(np.maximum(hungry, full), 0.0)
    below = np.maximum(-np.minimum(hungry, full), 0.0)
    extent = above + below
    shares: FloatArray = np.divide(above, extent, out=np.zeros_like(extent), where=extent > 0.0)
    return shares


def as_forager(genes: FloatArray, schema: Schema) -> FloatArray:
    """Return the genes of a forager: these, or with as much more attention to batteries as that takes."""
    hungry, full = _outputs(genes, schema)
    return _attending(genes, schema, min(0.0, -float(max(hungry, full)) - _SURE))


def as_tracker(genes: FloatArray, schema: Schema) -> FloatArray:
    """Return the genes of a tracker: these, or with as much less attention to batteries as that takes.

    One that was none tracks from an energy of 0.5 on, or always where its drive to mate falls with energy.
    """
    hungry, full = _outputs(genes, schema)
    if full > 0.0:
        return genes.copy()
    return _attending(genes, schema, _SURE - float(min(full, hungry + _MIDDLE * (full - hungry))))


def _attending(genes: FloatArray, schema: Schema, change: float) -> FloatArray:
    """Return genes with another attention to batteries: the output for mating changes where one is in sight."""
    changed = genes.copy()
    changed[schema.index(_BATTERY)] += change
    return changed


def _outputs(
    genotypes: FloatArray, schema: Schema, battery: float = 1.0, mate: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Return the outputs of the selector for mating, by default with both in sight, at energies 0 and 1."""
    bias, energy, to_battery, to_mate = (
        genotypes[..., schema.index(name)] for name in (_BIAS, _ENERGY, _BATTERY, _MATE)
    )
    hungry = bias + battery * to_battery + mate * to_mate
    return hungry, hungry + energy
