"""Encounters (thesis 4.5, 5.2): two robots, beacons on, face each other within infrared range."""

import numpy as np

from crcolony.body import contract
from crcolony.compiled import compiled
from crcolony.randomness import draw_bits
from crcolony.world.camera import is_hidden, is_in_view
from crcolony.world.neighbours import collect_near
from crcolony.world.state import World

_NONCE_SHIFT = np.uint64(16)
"""Leaves 48 bits of 64 for a nonce: the float64 of an observation represents it exactly."""


@compiled
def detect_encounters(world: World) -> None:
    """Write the partner of every robot: at most one other, the nearest pair first, then the
    smaller index."""
    world.partners[:] = -1
    pairs = 0
    for i in range(world.poses.shape[0]):
        if world.actions[i, contract.BEACON] >= 0.5 and pairs < world.contacts.shape[0]:
            pairs = _collect_pairs(world, i, pairs)
    while pairs > 0 and _match_nearest(world, pairs):
        pass


@compiled
def _match_nearest(world: World, pairs: int) -> bool:
    """Match all pairs that are each other's nearest; return whether there was one.

    Repeated until there is none, this has the same result as to match the nearest pair of all again
    and again, and is much faster in a crowd.
    """
    for k in range(pairs):
        for end in (1, 2):
            world.nearest[int(world.contacts[k, end])] = -1
    for k in range(pairs):
        i, j = int(world.contacts[k, 1]), int(world.contacts[k, 2])
        if world.partners[i] < 0 and world.partners[j] < 0:
            for robot in (i, j):
                if _comes_before(world, k, world.nearest[robot]):
                    world.nearest[robot] = k
    has_matched = False
    for k in range(pairs):
        i, j = int(world.contacts[k, 1]), int(world.contacts[k, 2])
        if world.nearest[i] == k and world.nearest[j] == k:
            world.partners[i], world.partners[j] = j, i
            nonce = float(draw_bits(world.stream) >> _NONCE_SHIFT)
            world.nonces[i], world.nonces[j] = nonce, nonce
            has_matched = True
    return has_matched


@compiled
def _comes_before(world: World, k: int, best: int) -> bool:
    """Return whether contact k is nearer than contact `best` (-1: none), or as near and of smaller
    indices."""
    if best < 0:
        return True
    for column in range(3):
        if world.contacts[k, column] < world.contacts[best, column]:
            return True
        if world.contacts[k, column] > world.contacts[best, column]:
            return False
    return False


@compiled
def _collect_pairs(world: World, i: int, pairs: int) -> int:
    """Append the pairs (i, j > i) that could have an encounter to `world.contacts`; return how many
    it has now."""
    rules = world.rules
    x, y = world.poses[i, 0], world.poses[i, 1]
    count = collect_near(world.robot_cells, x, y, rules.encounter_range_m, world.near_bodies)
    for k in range(count):
        j = int(world.near_bodies[k, 0])
        if j <= i or world.actions[j, contract.BEACON] < 0.5:
            continue
        if world.colonies[j] != world.colonies[i]:
            continue
        dx, dy, squared_m2 = (
            world.near_bodies[k, 1],
            world.near_bodies[k, 2],
            world.near_bodies[k, 3],
        )
        ahead_m = dx * world.headings[i, 0] + dy * world.headings[i, 1]
        ahead_of_other_m = -dx * world.headings[j, 0] - dy * world.headings[j, 1]
        if (
            is_in_view(ahead_m, squared_m2, rules.encounter_cosine)
            and is_in_view(ahead_of_other_m, squared_m2, rules.encounter_cosine)
            and not is_hidden(world, count, x, y, dx, dy, k)
            and pairs < world.contacts.shape[0]
        ):
            world.contacts[pairs, 0] = squared_m2
            world.contacts[pairs, 1] = i
            world.contacts[pairs, 2] = j
            pairs += 1
    return pairs
