"""A robot's link to its body: which run of the arena it asks, whether it trusts the reply, and what they say then.

No clock, no I/O: random bytes are drawn by a function that is passed in. Rows go over the network, with codes, or
through the memory that robot and body share on one machine.
"""

from collections.abc import Callable

from crcolony.body.contract import check_observation
from crcolony.compiled import FloatArray
from crcolony.nodes.node_inputs import ColonyMember, KnownArenas
from crcolony.protocol.body_messages import (
    Action,
    BodyDenied,
    BodyGranted,
    Contact,
    Join,
    Leave,
    decode_observation,
    pack_row,
    unpack_row,
)
from crcolony.protocol.body_requests import PendingRequest, sign_request
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import ArenaId, RobotId, arena_id
from crcolony.protocol.link_keys import EXCHANGE_KEY_BYTES, ExchangeKey, LinkKeys, open_sealed, seal
from crcolony.protocol.mating_messages import NONCES
from crcolony.protocol.signed_telemetry import open_telemetry, purpose_of_arena
from crcolony.transport.interface import LinkOnThisMachine, LocalObservation

_MAX_RUNS = 100
"""Runs of the arena that are known at a time: anybody may declare a token."""
_ATTEMPTS = 3
"""A run that has not answered so many requests is asked again after all others."""
_MAX_AHEAD = 2**24
"""Ticks by which an observation may be newer than the last: years of real time are refused, hours are not."""


Sensed = tuple[int, FloatArray, Contact | None]
"""The tick of an observation, its row (OBSERVATION_WIDTH,) within the limits, and its contact"""


class UnknownArenaError(Exception):
    """An arena of this name has answered that is not the one in which the robot lives."""


class LinkToBody:
    """What a robot knows of the arena that has its body."""

    def __init__(
        self,
        member: ColonyMember,
        arena: str,
        wanted_slot: int,
        known: KnownArenas,
        draw: Callable[[int], bytes],
        publish_action: Callable[[RobotId, bytes], None],
        local: LinkOnThisMachine,
    ) -> None:
        self.lease: BodyGranted | None = None
        """None: it has no body"""
        self.tick = -1
        """Of the last observation"""
        self.has_acted = True
        """Whether the last observation has been answered"""
        self._action: FloatArray | None = None
        """The answer to the last observation"""
        self._publish_action, self._local = publish_action, local
        self._member, self._arena, self._wanted_slot = member, arena, wanted_slot
        self._known, self._draw = known, draw
        self._runs: dict[int, int] = {}
        """The runs that are online, the next to be asked at the end; and how often each was asked in vain"""
        self._refused: set[ArenaId] = set()
        """Arenas of this name that are not known"""
        self._pending: PendingRequest | None = None
        self._count = 0
        self._keys = LinkKeys(b"", b"")
        self._arena_id: ArenaId = b""

    @property
    def is_in_lockstep(self) -> bool:
        """Whether the arena waits for this robot's actions."""
        return self.lease is not None and self.lease.lockstep

    @property
    def can_act(self) -> bool:
        """Whether the last observation waits for its answer."""
        return self.lease is not None and not self.has_acted and self.tick >= 0

    # Which arena ---------------------------------------------------------------------------------------------------

    def handle_online(self, arena_run: int) -> bool:
        """Handle that a run of the arena is online; return whether it is to be asked for a body."""
        if arena_run not in self._runs and len(self._runs) < _MAX_RUNS:
            self._runs[arena_run] = 0
        return self.lease is None

    def handle_offline(self, arena_run: int) -> bool:
        """Handle that a run of the arena is offline; return whether the body is lost by that."""
        self._runs.pop(arena_run, None)
        if self._pending is not None and self._pending.join.arena_run == arena_run:
            self._pending = None
        is_lost = self.lease is not None and self.lease.arena_run == arena_run
        if is_lost:
            self.lease = None
        return is_lost

    def request(self) -> bytes | None:
        """Return the request for a body: the same until it is answered; None while no arena is online."""
        run = self._run_to_ask()
        if run is None:
            return None
        if self._pending is None or self._pending.join.arena_run != run:
            self._count += 1
            own = ExchangeKey(self._draw(EXCHANGE_KEY_BYTES))
            join = Join(
                self._member.identity.id, self._member.colony, self._wanted_slot, run,
                self._member.incarnation, self._count, own.public,
            )  # fmt: skip
            self._pending = PendingRequest(join, self._arena, self._member.identity, own)
        return self._pending.data

    def leave(self) -> bytes | None:
        """Give the body up, and return the request that says so; None without a body."""
        if self.lease is None:
            return None
        self._count += 1
        robot, incarnation = self._member.identity, self._member.incarnation
        message = Leave(robot.id, self.lease.arena_run, incarnation, self._count)
        self.lease = None
        return sign_request(message, self._arena, robot)

    def _run_to_ask(self) -> int | None:
        if self.lease is not None and self.lease.arena_run in self._runs:
            return self.lease.arena_run
        if not self._runs:
            return None
        run = next(reversed(self._runs))
        if self._runs[run] >= _ATTEMPTS and len(self._runs) > 1:
            self._ask_last(run)
            run = next(reversed(self._runs))
        self._runs[run] += 1
        return run

    def _ask_last(self, run: int) -> None:
        self._runs.pop(run)
        self._runs = {run: 0, **self._runs}

    # Replies -------------------------------------------------------------------------------------------------------

    def open_reply(self, data: bytes) -> BodyGranted | BodyDenied | None:
        """Handle a reply, and return it if it answers the last request.

        Raises WireError if it is malformed or forged, and UnknownArenaError, once for each, if another arena signed it
        than the one in which the robot lives.
        """
        if self._pending is None:
            return None  # one that arrives twice
        reply = self._pending.open_reply(data)
        run = self._pending.join.arena_run
        if not self._known.accepts(self._arena, reply.arena):
            self._refuse(run, reply.arena)
            return None
        self._pending = None
        if isinstance(reply.message, BodyGranted) and reply.keys is not None:
            if reply.message.arena_run != run:
                raise WireError("it grants a body of another run")
            if self.lease is None or self.lease.arena_run != run:
                self.tick = -1
            self.tick = min(self.tick, reply.message.tick)
            self.lease, self._keys, self._arena_id = reply.message, reply.keys, reply.arena
            self._local.open(self._member.identity.id, run, reply.keys)
        return reply.message

    def _refuse(self, run: int, arena: ArenaId) -> None:
        self._pending = None
        if run in self._runs:
            self._ask_last(run)
        if arena not in self._refused and len(self._refused) < _MAX_RUNS:
            self._refused.add(arena)
            raise UnknownArenaError(
                f"another one of this name ({arena.hex()}) is ignored: this robot lives in those of its known_arenas"
            )

    # Observations and actions --------------------------------------------------------------------------------------

    def sense(self, observation: bytes | LocalObservation) -> Sensed | None:
        """Return what an observation of the present body says, which came over the network or not; None without a body.

        It may be one that arrives again. Raises WireError if it is malformed, forged, beyond the limits of what a body
        can sense, or far ahead of the last one.
        """
        if self.lease is None:
            return None
        if isinstance(observation, bytes):
            opened = decode_observation(open_sealed(self._keys.observations, observation))
            if opened.arena_run != self.lease.arena_run:
                raise WireError("of another run")
            tick, row, contact = opened.tick, unpack_row(opened.row), opened.contact
        else:
            tick, row, contact = observation.tick, observation.row, observation.contact
            if contact is not None and not 0 <= contact.nonce < NONCES:
                raise WireError("its contact has no nonce")
        if tick > max(self.tick, self.lease.tick) + _MAX_AHEAD:
            raise WireError("far ahead of the last one")
        try:
            check_observation(row)
        except ValueError as error:
            raise WireError(str(error)) from None
        return tick, row, contact

    def answer(self, tick: int, action: FloatArray) -> None:
        """Note the action (ACTION_WIDTH,) for a new observation; `act` sends it."""
        self.tick, self._action, self.has_acted = tick, action, False

    def act(self) -> None:
        """Send the action for the last observation, if there is one; it may be sent again if it was lost."""
        self.has_acted = True
        if self._action is None:
            return
        if self._local.is_open:
            self._local.publish_action(self.tick, self._action)
        else:
            action = encode(Action(self.tick, pack_row(self._action)))
            sealed = seal(self._keys.actions, action)
            self._publish_action(self._member.identity.id, sealed)

    def open_telemetry(self, data: bytes) -> bytes:
        """Return what the arena told all that listen; raises WireError if another one said it, or nobody signed it."""
        telemetry = open_telemetry(data)
        if arena_id(telemetry.key) != self._arena_id:
            raise WireError("of another arena than the one that has the body")
        if not telemetry.is_valid(purpose_of_arena(self._arena)):
            raise WireError("its signature is not valid")
        return telemetry.content
