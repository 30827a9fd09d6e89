"""Recent meetings and matings: reported by both robots, kept once, and for as long as they are drawn."""

from collections import deque
from dataclasses import dataclass

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Exchanged, Met

MATING_S = 1.5
"""How long a mating is drawn"""
MEETING_S = 0.6
"""How long a meeting is drawn"""
_MAX_PAIRINGS = 2_000
"""Kept at a time; the oldest are dropped"""
_KEEP_S = 10.0
"""For how long the second robot's report of a pairing is recognised when there are many"""


@dataclass
class Pairing:
    """Two robots that met or mated."""

    robots: tuple[RobotId, RobotId]
    unix_s: float
    """When the first report of it was received"""
    mated: bool = False
    conceived: int = 0
    """How many of the two robots conceived"""


class RecentPairings:
    """The meetings and matings of the last moments."""

    def __init__(self) -> None:
        self.recent: deque[Pairing] = deque(maxlen=_MAX_PAIRINGS)
        """Those that are drawn, the oldest first"""
        self._by_key: dict[object, Pairing] = {}

    def add(self, robot: RobotId, event: Met | Exchanged, unix_s: float) -> None:
        """Add one robot's report of a meeting or mating."""
        if isinstance(event, Met):
            low, high = sorted((robot, event.peer))
            self._pairing((low, high), (low, high), unix_s)
        else:
            robots = (event.encounter.initiator, event.encounter.responder)
            pairing = self._pairing(event.encounter, robots, unix_s)
            pairing.mated = True
            pairing.conceived += event.conceived

    def drop_old(self, unix_s: float) -> None:
        """Drop pairings that were drawn long enough, also if the clock was set back."""
        while self.recent and abs(unix_s - self.recent[0].unix_s) > MATING_S:
            self.recent.popleft()
        if len(self._by_key) > 2 * _MAX_PAIRINGS:
            self._by_key = {
                key: pairing
                for key, pairing in self._by_key.items()
                if pairing.unix_s > unix_s - _KEEP_S
            }

    def _pairing(self, key: object, robots: tuple[RobotId, RobotId], unix_s: float) -> Pairing:
        """Return the pairing with a key; a new one if there is none or the last meeting is over."""
        known = self._by_key.get(key)
        if known is not None and (known.mated or abs(unix_s - known.unix_s) < MEETING_S):
            return known
        pairing = Pairing(robots, unix_s)
        self._by_key[key] = pairing
        self.recent.append(pairing)
        return pairing
