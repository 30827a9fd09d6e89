"""Finds links that are lost for this robot alone, so that it can reconnect.

A mesh that has lost one link stays that way: both robots still reach the arena. Two observations show it. A robot that
is met bodily is not online; or a robot that went offline has its lamp lit in the arena's scene, which an arena puts out
within the time to live of the robot's last action.
"""

import math

from crcolony.protocol.identity import RobotId
from crcolony.protocol.telemetry_messages import Scene

_SUSPICION_S = 5.0
"""How long a robot is a suspect before its link counts as lost."""
_YIELD_FACTOR = 3.0
"""The robot with the larger id waits longer, so that only one of the two reconnects."""
_RECONNECT_PERIOD_S = 30.0
"""The shortest time between two reconnections."""
_FORGET_S = 300.0
"""After so long offline a robot is no longer looked for in the scene."""
_MAX_SUSPECTS = 1000


class LinkRecovery:
    """The suspected link failures of one robot. A returned text is the reason to reconnect now."""

    def __init__(self, robot: RobotId, colony: str) -> None:
        self._robot, self._colony = robot, colony
        self._met: dict[RobotId, float] = {}
        """Robots that were met and are not online, and since when"""
        self._offline: dict[RobotId, float] = {}
        """Robots that went offline, and when"""
        self._reconnect_due_s = -math.inf

    @property
    def needs_scene(self) -> bool:
        """Whether the arena's scene is to be searched for robots that went offline."""
        return bool(self._offline)

    def handle_online(self, peer: RobotId) -> None:
        """Clear a robot of suspicion."""
        self._met.pop(peer, None)
        self._offline.pop(peer, None)

    def handle_offline(self, now_s: float, peer: RobotId) -> None:
        """Suspect a robot that went offline; not the robot itself, whose former session has gone with its token."""
        if peer != self._robot and len(self._offline) < _MAX_SUSPECTS:
            self._offline[peer] = now_s

    def handle_contact(self, now_s: float, peer: RobotId, is_online: bool) -> str | None:
        """Suspect a robot that was met and is not online; return a reason once that has lasted too long."""
        if is_online:
            self._met.pop(peer, None)
        elif len(self._met) >= _MAX_SUSPECTS:
            self._met.clear()
        elif now_s - self._met.setdefault(peer, now_s) >= _SUSPICION_S:
            return self._reason_at(now_s, f"robot {peer.hex()[:8]} was met and is not online")
        return None

    def handle_scene(self, now_s: float, scene: Scene) -> str | None:
        """Return a reason if a robot of the colony that went offline still commands its body."""
        for body in scene.robots:
            offline_s = now_s - self._offline.get(body.robot, now_s)
            factor = 1.0 if self._robot < body.robot else _YIELD_FACTOR
            is_lit = body.red + body.green + body.blue > 0.0
            if is_lit and offline_s >= factor * _SUSPICION_S and body.colony == self._colony:
                return self._reason_at(
                    now_s, f"robot {body.robot.hex()[:8]} acts and is not online"
                )
        return None

    def remove_expired(self, now_s: float) -> None:
        """Give up the robots that have been offline for too long."""
        for peer in [peer for peer, at_s in self._offline.items() if now_s - at_s > _FORGET_S]:
            del self._offline[peer]

    def _reason_at(self, now_s: float, reason: str) -> str | None:
        if now_s < self._reconnect_due_s:
            return None
        self._reconnect_due_s = now_s + _RECONNECT_PERIOD_S
        self._met.clear()
        return reason
