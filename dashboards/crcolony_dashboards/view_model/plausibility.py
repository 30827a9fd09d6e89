"""Whether what was heard can be drawn and counted: anybody can publish anything, and many numbers have no limits."""

import numpy as np

from crcolony.evolution.history import Born, Lived
from crcolony.protocol.telemetry_messages import Scene

MAX_S = 1e9
"""Of a colony's own time, which is told in nanoseconds that fit into 64 bits"""
_MAX_NAME = 64
_LARGEST_GENE = 1e9
_MAX_GENERATIONS = 2**53


def is_sound_scene(scene: Scene) -> bool:
    """Tell whether a scene is of a time that can be drawn."""
    return scene.tick * scene.period_s < MAX_S


def is_sound_event(event: Born | Lived) -> bool:
    """Tell whether a birth or a life is one of some agent in some generation, with genes that are numbers."""
    names, numbers = [event.agent], np.zeros(0)
    if isinstance(event, Born):
        names += [parent for parent in (event.mother, event.father) if parent is not None]
        if len(event.genes) % 8:
            return False
        numbers = np.frombuffer(event.genes, dtype="<f8")
    is_known = 0 <= event.generation < _MAX_GENERATIONS
    return is_known and max(map(len, names)) <= _MAX_NAME and _are_within(numbers, _LARGEST_GENE)


def _are_within(values: object, most: float) -> bool:
    """Tell whether all are numbers, and no larger than that."""
    return bool(np.all(np.abs(np.asarray(values, dtype=float)) <= most))
