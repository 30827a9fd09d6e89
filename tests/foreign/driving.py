"""A simple reactive rule: towards faces while it wants to mate, towards batteries, and away from walls."""

import math
from typing import Final

from tests.foreign.messages import numbers, packed

PACK: Final = 0  # columns of an observation's row
FACE: Final = 6
PROXIMITY: Final = 19
CHARGE: Final = 32

_SHARE: Final = (0.0, 1.0)
_LENGTH: Final = (0.0, math.inf)
_ANY: Final = (-math.inf, math.inf)
_WHEEL: Final = (-1.3, 1.3)
_BLOB: Final = (_SHARE, _LENGTH, (-math.pi, math.pi), _SHARE, _SHARE, _SHARE)
LIMITS: Final = (
    *(*_BLOB, *_BLOB, *_BLOB),
    *(8 * (_LENGTH,)),
    *(3 * (_ANY,)),
    *(2 * (_WHEEL,)),
    *(6 * (_SHARE,)),
    (-1.0, math.inf),
    (0.0, 2.0**48),
)
"""Of every column of an observation."""

SPEED_M_S: Final = 0.25
TURN_M_S: Final = 0.15
TURN_M_S_PER_RAD: Final = 0.3
NEAR_M: Final = 0.08
FACING_M: Final = 0.3
"""So near to another robot it stands still and faces it."""
TTL_S: Final = 0.5


def driven(row: bytes, wants_to_mate: bool) -> bytes:
    """The row of an action for this row of an observation: red and with its beacon on if it wants to mate."""
    left_m_s, right_m_s = _wheels(numbers(row), wants_to_mate)
    red, green, beacon = (1.0, 0.0, 1.0) if wants_to_mate else (0.0, 1.0, 0.0)
    jaw, blue, speaker = 1.0, 0.0, 0.0
    return packed((left_m_s, right_m_s, jaw, red, green, blue, speaker, beacon, TTL_S))


def can_be_sensed(row: bytes) -> bool:
    """Whether an observation is within the limits of the page's table."""
    return all(low <= x <= high for x, (low, high) in zip(numbers(row), LIMITS, strict=True))


def charge(row: bytes) -> float:
    return numbers(row)[CHARGE]


def _wheels(sensed: tuple[float, ...], wants_to_mate: bool) -> tuple[float, float]:
    for blob in (FACE, PACK) if wants_to_mate else (PACK,):
        is_visible, distance_m, bearing_rad = sensed[blob : blob + 3]
        if is_visible:
            turn_m_s = max(-TURN_M_S, min(TURN_M_S, TURN_M_S_PER_RAD * bearing_rad))
            is_there = blob == FACE and distance_m < FACING_M
            ahead_m_s = 0.0 if is_there else SPEED_M_S / (1.0 + abs(bearing_rad))
            return ahead_m_s - turn_m_s, ahead_m_s + turn_m_s
    right_m = min(sensed[PROXIMITY : PROXIMITY + 3])
    left_m = min(sensed[PROXIMITY + 4 : PROXIMITY + 7])
    if min(right_m, sensed[PROXIMITY + 3], left_m) < NEAR_M:
        return (TURN_M_S, -TURN_M_S) if left_m < right_m else (-TURN_M_S, TURN_M_S)
    return SPEED_M_S, 0.9 * SPEED_M_S
