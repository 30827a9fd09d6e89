"""The links of an arena or a bridge to the robots that have its bodies: who asked last, and with which keys they speak.

No clock, no I/O: random bytes are drawn by a function that is passed in.
"""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field

from crcolony.protocol.body_messages import BodyDenied, BodyGranted, LocalLink
from crcolony.protocol.body_requests import Request, keys_of_grant, open_request, sign_reply
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import Identity, RobotId
from crcolony.protocol.link_keys import (
    EXCHANGE_KEY_BYTES,
    ExchangeKey,
    LinkKeys,
    open_sealed,
    seal,
)
from crcolony.protocol.local_link import check_robot, prove_body, read_claim
from crcolony.rate_limit import TokenBucket

_MAX_REMEMBERED = 10_000
"""Robots without a body whose last request is remembered, so that none is carried out twice."""
_MAX_STRANGERS_PER_S = 200.0
"""Requests of robots without a body whose signatures are verified: 0.1 ms each."""
_MAX_OF_A_ROBOT_PER_S = 5.0
"""Requests of a robot that has a body."""


class StaleRequestError(WireError):
    """A request that was made before another one of the same robot, or the same one that is done with."""


@dataclass
class _Robot:
    """What is known of a robot."""

    order: tuple[int, int] = (-1, -1)
    request: bytes = b""
    """Digest of its last request"""
    reply: bytes | None = None
    """To that request, which may arrive again because the reply was lost"""
    keys: LinkKeys | None = None
    limit: TokenBucket = field(default_factory=lambda: TokenBucket(_MAX_OF_A_ROBOT_PER_S))


class BodyLinks:
    """The links of one run of an arena, which is called `arena` and has a key, `identity`."""

    def __init__(
        self, arena: str, arena_run: int, identity: Identity, draw: Callable[[int], bytes]
    ) -> None:
        self._arena, self._arena_run, self._identity, self._draw = arena, arena_run, identity, draw
        self._robots: dict[RobotId, _Robot] = {}
        """Those that have bodies"""
        self._others: OrderedDict[RobotId, _Robot] = OrderedDict()
        """Those that have none, the one that asked last at the end"""
        self._limit = TokenBucket(_MAX_STRANGERS_PER_S)

    def receive(self, now_s: float, robot: RobotId, data: bytes) -> Request | bytes | None:
        """Return a request that is to be carried out, the reply if it was carried out before, or None beyond the rate.

        Raises WireError if it is malformed, forged, for another run, or made before another one of this robot.
        """
        request = open_request(data)
        message = request.message
        if message.robot != robot:
            raise WireError("under the key of another robot")
        if message.arena_run != self._arena_run:
            raise StaleRequestError("for another run of the arena")
        known = self._known(robot)
        if request.order == known.order and request.digest == known.request and known.reply:
            return known.reply
        if request.order <= known.order:
            raise StaleRequestError("made before another one of this robot")
        limit = known.limit if robot in self._robots else self._limit
        if not limit.allow(now_s):
            return None
        if not request.is_signed(self._arena):
            raise WireError("its signature is not valid")
        return request

    def grant(self, request: Request, granted: Callable[[bytes, bytes], BodyGranted]) -> bytes:
        """Remember a robot that has a body now, and return the signed reply.

        `granted` makes the message from the request's digest and the arena's public key of the exchange. Raises
        WireError if the robot's key is none.
        """
        own = ExchangeKey(self._draw(EXCHANGE_KEY_BYTES))
        message = granted(request.digest, own.public)
        keys = keys_of_grant(own, request, message)
        robot = request.message.robot
        known = self._known(robot)
        self._others.pop(robot, None)
        self._robots[robot] = known
        known.order, known.request, known.keys = request.order, request.digest, keys
        known.reply = sign_reply(message, self._arena, self._identity)
        return known.reply

    def deny(self, request: Request, reason: str) -> bytes:
        """Return the signed reply that a robot gets no body."""
        robot = request.message.robot
        known = self._robots.get(robot)
        if known is None:
            self._remember(robot, request.order, request.digest)
        else:  # it asked in the name of another colony; the body that it has stays its own
            known.order, known.request, known.reply = request.order, request.digest, None
        return sign_reply(BodyDenied(request.digest, reason), self._arena, self._identity)

    def leave(self, request: Request) -> None:
        """Forget the keys of a robot that has left."""
        self._robots.pop(request.message.robot, None)
        self._remember(request.message.robot, request.order, request.digest)

    def remove(self, robot: RobotId) -> None:
        """Forget the keys of a robot that has no body any more, and remember its last request."""
        known = self._robots.pop(robot, None)
        if known is not None:
            self._remember(robot, known.order, known.request)

    def seal_observation(self, robot: RobotId, content: bytes) -> bytes | None:
        """Return an observation with its code; None for a robot that has not asked in this run."""
        known = self._robots.get(robot)
        if known is None or known.keys is None:
            return None
        return seal(known.keys.observations, content)

    def open_action(self, robot: RobotId, data: bytes) -> bytes:
        """Return an action without its code; raises WireError if it is not of this link."""
        known = self._robots.get(robot)
        if known is None or known.keys is None:
            raise WireError("of no link")
        return open_sealed(known.keys.actions, data)

    def prove_local(self, challenge: bytes, data: bytes) -> tuple[RobotId, bytes]:
        """Return which robot on this machine has proved to have a body here, and the proof for it.

        Raises WireError if it has not.
        """
        claim = read_claim(data)
        known = self._robots.get(claim.robot)
        if known is None or known.keys is None:
            raise WireError("of no link")
        link = LocalLink(claim.robot, self._arena_run, challenge)
        check_robot(data, link, known.keys)
        return claim.robot, prove_body(link, known.keys)

    def _known(self, robot: RobotId) -> _Robot:
        return self._robots.get(robot) or self._others.get(robot) or _Robot()

    def _remember(self, robot: RobotId, order: tuple[int, int], request: bytes) -> None:
        self._others[robot] = _Robot(order, request)
        self._others.move_to_end(robot)
        if len(self._others) > _MAX_REMEMBERED:
            self._others.popitem(last=False)
