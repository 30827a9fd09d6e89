"""A simple reactive rule: towards faces while it wants to mate, towards batteries otherwise, away from walls."""

from typing import Final

from tests.foreign.messages import numbers, packed

PACK: Final = 0  # the columns of an observation's row
FACE: Final = 6
PROXIMITY: Final = 19
HOLDS: Final = 31
CHARGE: Final = 32

SPEED_M_S: Final = 0.25
TURN_M_S: Final = 0.15
NEAR_M: Final = 0.08
TTL_S: Final = 0.5


def driven(row: bytes, wants_to_mate: bool) -> bytes:
    """The row of an action for this row of an observation."""
    sensed = numbers(row)
    left_m_s, right_m_s = _wheels(sensed, wants_to_mate)
    is_empty = sensed[HOLDS] > 0.5 and sensed[CHARGE] <= 0.0
    jaw = 0.0 if is_empty else 1.0  # it lets an empty pack go
    beacon = 1.0 if wants_to_mate else 0.0
    return packed((left_m_s, right_m_s, jaw, 0.0, beacon, 0.0, 0.0, beacon, TTL_S))


def charge(row: bytes) -> float:
    return numbers(row)[CHARGE]


def _wheels(sensed: tuple[float, ...], wants_to_mate: bool) -> tuple[float, float]:
    for blob in (FACE, PACK) if wants_to_mate else (PACK,):
        visible, distance_m, bearing_rad = sensed[blob : blob + 3]
        if visible > 0.5:
            turn_m_s = max(-TURN_M_S, min(TURN_M_S, 0.3 * bearing_rad))
            speed_m_s = (
                0.0
                if blob == FACE and distance_m < 2 * NEAR_M
                else SPEED_M_S / (1.0 + abs(bearing_rad))
            )
            return speed_m_s - turn_m_s, speed_m_s + turn_m_s
    right_m, ahead_m, left_m = min(sensed[19:22]), sensed[22], min(sensed[23:26])
    if min(right_m, ahead_m, left_m) < NEAR_M:  # turn away from what is near
        return (TURN_M_S, -TURN_M_S) if left_m < right_m else (-TURN_M_S, TURN_M_S)
    return SPEED_M_S, 0.9 * SPEED_M_S
