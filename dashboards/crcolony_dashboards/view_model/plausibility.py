"""Whether received data can be drawn and counted: any peer can publish anything, and many numbers are unbounded."""

import numpy as np

from crcolony.evolution.history import Born, Lived
from crcolony.protocol.telemetry_messages import Scene

MAX_SIM_S = 1e9
"""Of a colony's own time: Rerun keeps it as nanoseconds in 64 bits"""
_MAX_NAME_LENGTH = 64
"""Of an agent's name (characters)"""
_MAX_GENE = 1e9
"""Absolute value of a gene"""
_MAX_GENERATIONS = 2**53
"""Above this a generation's number is not exact as a float"""


def is_plausible_scene(scene: Scene) -> bool:
    """Return whether the time of a scene can be drawn."""
    return scene.tick * scene.period_s < MAX_SIM_S


def is_plausible_event(event: Born | Lived) -> bool:
    """Return whether names, generation and genes of a birth or a lifetime are within limits, and genes finite."""
    names, genes = [event.agent], np.zeros(0)
    if isinstance(event, Born):
        names += [parent for parent in (event.mother, event.father) if parent is not None]
        if len(event.genes) % 8:
            return False
        genes = np.frombuffer(event.genes, dtype="<f8")
    if not 0 <= event.generation < _MAX_GENERATIONS:
        return False
    # NaN compares false, so it is refused too
    return max(map(len, names)) <= _MAX_NAME_LENGTH and bool(np.all(np.abs(genes) <= _MAX_GENE))
