"""The microphones (thesis 4.6): the loudness of the speakers of the robots around."""

import math

from crcolony.body import contract
from crcolony.compiled import FloatArray, as_index, compiled
from crcolony.world.state import World

_HALF_LOUDNESS_M2 = 0.25
"""At this squared distance a speaker is half as loud."""


@compiled
def sense_sound(world: World, i: int, count: int, row: FloatArray) -> None:
    """Write the loudness at both microphones to an observation (row).

    Loudness falls with the distance, and is half as large at the microphone that is turned away.
    `world.near_bodies` has the `count` bodies around robot i.
    """
    cosine, sine = world.headings[i, 0], world.headings[i, 1]
    for k in range(count):
        loudness = world.actions[as_index(world.near_bodies[k, 0]), contract.SPEAKER]
        if loudness == 0.0:
            continue
        dx, dy = world.near_bodies[k, 1], world.near_bodies[k, 2]
        squared_m2 = world.near_bodies[k, 3]
        distance_m = math.sqrt(squared_m2)
        if distance_m > world.rules.hearing_range_m:
            continue
        loudness /= 1.0 + squared_m2 / _HALF_LOUDNESS_M2
        side = (dy * cosine - dx * sine) / max(distance_m, 1e-9)
        left, right = contract.MICROPHONES, contract.MICROPHONES + 1
        row[left] = min(1.0, row[left] + loudness * (0.75 + 0.25 * side))
        row[right] = min(1.0, row[right] + loudness * (0.75 - 0.25 * side))
