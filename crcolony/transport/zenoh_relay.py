"""Stands in on the network for robots that are met by infrared and are on no network with us.

Envelopes for such a robot are delivered here, to be sent by infrared, and those that it has sent are put to the
network.
"""

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import zenoh

from crcolony.protocol.codec import MAX_ENVELOPE_BYTES
from crcolony.protocol.identity import RobotId
from crcolony.protocol.key_expressions import ColonyKeys
from crcolony.transport.interface import Deliver, EnvelopeReceived
from crcolony.transport.zenoh_samples import callback, leaving, payload_bytes, undeclare_all

_STAND_IN = 0
"""Incarnation of a token of ours: older than every incarnation of the robot itself."""


class EnvelopeRelay:
    """Declares robots in their stead, and carries their envelopes."""

    def __init__(self, session: zenoh.Session, deliver: Deliver) -> None:
        self._session, self._deliver = session, deliver
        self._declared: dict[RobotId, list[Any]] = {}
        self._colonies: Mapping[RobotId, str] = {}
        self.name = str(session.zid())
        """The session in our tokens"""

    def move_to(self, session: zenoh.Session) -> Callable[[], None]:
        """Stand in for the same robots in another session; return a function that undeclares them in the former one."""
        former = list(itertools.chain(*self._declared.values()))
        self._session, self.name = session, str(session.zid())
        for robot, colony in self._colonies.items():
            self._open(colony, robot)
        return leaving(former)

    def stand_in_for(self, robots: Mapping[RobotId, str]) -> None:
        """Stand in for these robots, whose colonies are given, and for no others any more."""
        self._colonies = dict(robots)
        for robot in self._declared.keys() - robots.keys():
            undeclare_all(self._declared.pop(robot))
        for robot, colony in robots.items():
            if robot not in self._declared:
                self._open(colony, robot)

    def put(self, colony: str, robot: RobotId, envelope: bytes) -> None:
        """Put an envelope that was received by infrared into the inbox of the robot it is for."""
        self._session.put(
            ColonyKeys(colony).inbox(robot),
            envelope,
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
        )

    def _open(self, colony: str, robot: RobotId) -> None:
        keys = ColonyKeys(colony)

        def on_envelope(sample: zenoh.Sample) -> None:
            data = payload_bytes(sample.payload, MAX_ENVELOPE_BYTES)
            self._deliver(EnvelopeReceived(robot, data))

        self._declared[robot] = [
            self._session.declare_subscriber(keys.inbox(robot), callback(on_envelope)),
            self._session.liveliness().declare_token(keys.alive(robot, _STAND_IN, self.name)),
        ]
