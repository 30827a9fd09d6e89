"""Encounters: two robots of a colony, beacons on, face each other within infrared range (thesis 4.5, 5.2)."""

import numpy as np

from crcolony.body import contract
from crcolony.compiled import compiled
from crcolony.randomness import draw_bits
from crcolony.world.camera import hidden, in_view
from crcolony.world.neighbours import find_near
from crcolony.world.state import World

_SHIFT = np.uint64(16)
"""A nonce has 48 bits: an observation's float64 holds it exactly."""


@compiled
def report_encounters(world: World) -> None:
    """Tell every robot whom it encounters: at most one each, the nearest pair first, then the smaller index."""
    world.partners[:] = -1
    pairs = 0
    for i in range(world.poses.shape[0]):
        if world.actions[i, contract.BEACON] >= 0.5 and pairs < world.contacts.shape[0]:
            pairs = _pairs_of(world, i, pairs)
    while pairs > 0 and _match(world, pairs):
        pass


@compiled
def _match(world: World, pairs: int) -> bool:
    """Match all that are each other's nearest; tell whether there were any.

    Repeated until there are none this is the same as taking the nearest pair of all, again and again, and in a crowd
    much faster.
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
    is_any = False
    for k in range(pairs):
        i, j = int(world.contacts[k, 1]), int(world.contacts[k, 2])
        if world.nearest[i] == k and world.nearest[j] == k:
            world.partners[i], world.partners[j] = j, i
            nonce = float(draw_bits(world.stream) >> _SHIFT)
            world.nonces[i], world.nonces[j] = nonce, nonce
            is_any = True
    return is_any


@compiled
def _comes_before(world: World, k: int, best: int) -> bool:
    """Tell whether contact k is nearer than contact `best` (-1: none), or as near and of smaller indices."""
    if best < 0:
        return True
    for column in range(3):
        if world.contacts[k, column] < world.contacts[best, column]:
            return True
        if world.contacts[k, column] > world.contacts[best, column]:
            return False
    return False


@compiled
def _pairs_of(world: World, i: int, pairs: int) -> int:
    """Add the pairs (i, j > i) that could make contact to `world.contacts`; return how many there are now."""
    rules = world.rules
    x, y = world.poses[i, 0], world.poses[i, 1]
    count = find_near(world.robot_cells, world.poses, x, y, rules.encounter_range_m, world.near)
    for k in range(count):
        j = int(world.near[k, 0])
        if j <= i or world.actions[j, contract.BEACON] < 0.5:
            continue
        if world.colonies[j] != world.colonies[i]:
            continue
        dx, dy, squared = world.near[k, 1], world.near[k, 2], world.near[k, 3]
        ahead = dx * world.headings[i, 0] + dy * world.headings[i, 1]
        ahead_of_other = -dx * world.headings[j, 0] - dy * world.headings[j, 1]
        if (
            in_view(ahead, squared, rules.encounter_cosine)
            and in_view(ahead_of_other, squared, rules.encounter_cosine)
            and not hidden(world, count, x, y, dx, dy, j)
            and pairs < world.contacts.shape[0]
        ):
            world.contacts[pairs, 0] = squared
            world.contacts[pairs, 1] = i
            world.contacts[pairs, 2] = j
            pairs += 1
    return pairs
