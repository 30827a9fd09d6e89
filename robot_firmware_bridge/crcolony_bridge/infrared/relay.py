"""Which robots are met by infrared and are on no network with us, so that their matings go by infrared, too."""

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

from crcolony.protocol.codec import WireError
from crcolony.protocol.envelope import open_envelope
from crcolony.protocol.identity import RobotId
from crcolony.protocol.mating_messages import receiver_of, sender_of
from crcolony.protocol.token_set import TokenTable

_NEAR_S = 10.0
"""A robot that was received so lately may still be answered."""
_PATIENCE_S = 1.0
"""A robot that is on the network, too, is seen there within this time."""
_MAX_NEAR = 16


class Parties(NamedTuple):
    """From whom an envelope is, and for whom."""

    sender: RobotId
    receiver: RobotId


def parties_of(envelope: bytes) -> Parties | None:
    """Return from whom and for whom an envelope is, None if it is malformed. Its signature is not verified."""
    try:
        _, message = open_envelope(envelope)
    except WireError:
        return None
    return Parties(sender_of(message), receiver_of(message))


class _Near(NamedTuple):
    """A robot that is received by infrared."""

    first_s: float
    last_s: float
    colony: str
    """That of the robot that received it: others do not mate with it"""


class AbsentRobots:
    """The robots that are near, by infrared, and not online; `online` holds the tokens of the network."""

    def __init__(self, online: TokenTable) -> None:
        self._online = online
        self._near: OrderedDict[RobotId, _Near] = OrderedDict()

    def receive(self, now_s: float, robot: RobotId, colony: str) -> None:
        """A robot was received by infrared, by one of this colony."""
        before = self._near.pop(robot, None)
        first_s = now_s if before is None else before.first_s
        self._near[robot] = _Near(first_s, now_s, colony)
        if len(self._near) > _MAX_NEAR:
            self._near.popitem(last=False)

    def update(self, now_s: float, is_served: Callable[[RobotId], bool]) -> dict[RobotId, str]:
        """Return the robots to stand in for, and their colonies; `is_served` tells those that have a body here."""
        for robot, near in list(self._near.items()):
            if now_s - near.last_s > _NEAR_S:
                del self._near[robot]
        return {
            robot: near.colony
            for robot, near in self._near.items()
            if now_s - near.first_s >= _PATIENCE_S
            and robot not in self._online
            and not is_served(robot)
        }
