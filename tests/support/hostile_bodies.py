"""Attacks on the link between robots and their bodies, by somebody who has no key of either and hears everything."""

import secrets
import socket
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import zenoh
from zenoh.handlers import Callback

from crcolony.body.contract import ACTION_WIDTH
from crcolony.protocol import key_expressions
from crcolony.protocol.body_messages import Action, BodyGranted, Contact, Observation, pack_row
from crcolony.protocol.body_requests import keys_of_grant, open_request, sign_reply
from crcolony.protocol.codec import WireError, encode
from crcolony.protocol.identity import Identity
from crcolony.protocol.link_keys import CODE_BYTES, ExchangeKey, seal
from tests.support.hostile_session import ARENA, Hostile
from tests.support.linked_robot import forged_join, forged_leave

HALF_OPEN = 1_500
LONG_TOKENS, LONG_TOKEN_BYTES = 200, 50_000


def evictions(peer: Hostile) -> Callable[[], None]:
    """Requests in the robots' names: to leave, to join under another colony's name, and their own, played again."""
    heard: deque[tuple[bytes, bytes]] = deque(maxlen=100)

    def record(query: zenoh.Query) -> None:
        robot = key_expressions.parse_body_topic(str(query.key_expr), "join")
        if robot is not None and query.payload is not None:
            heard.append((robot, query.payload.to_bytes()))

    queryable = _declare_queryable(peer, record)

    def shoot() -> None:
        assert queryable
        robot = peer.victim()
        run = peer.observations[robot].arena_run
        requests = [forged_leave(robot, run), forged_join(robot, "another", -1, run)]
        requests += [data for asked, data in heard if asked == robot]
        peer.query(peer.arena.join(robot), peer.chance.choice(requests))

    return shoot


def steering(peer: Hostile) -> Callable[[], None]:
    """Actions for the robots' bodies: new ones of the present tick and of later ones, and their own, played again."""
    heard: deque[tuple[bytes, bytes]] = deque(maxlen=200)

    def record(robot: bytes, sample: zenoh.Sample) -> None:
        heard.append((robot, sample.payload.to_bytes()))

    subscribers = [
        peer.session.declare_subscriber(
            peer.arena.action(robot), Callback(partial(record, robot), indirect=False)
        )
        for robot in peer.robots
    ]

    def shoot() -> None:
        assert subscribers
        robot = peer.victim()
        row = np.full(ACTION_WIDTH, peer.chance.uniform(-1.0, 1.0))
        tick = peer.observations[robot].tick + peer.chance.choice((0, 1, 2, 2**40))
        code = peer.chance.randbytes(CODE_BYTES)
        forged = [encode(Action(tick, pack_row(row))) + code]
        forged += [action for acted, action in list(heard) if acted == robot]
        peer.put(peer.arena.action(robot), peer.chance.choice(forged))

    return shoot


def contacts(peer: Hostile) -> Callable[[], None]:
    """Observations of the next tick in which two robots that have not met have a contact with one nonce."""

    def shoot() -> None:
        robot = peer.victim()
        other, nonce = peer.peer_of(robot), peer.chance.getrandbits(48)
        for one, met in ((robot, other), (other, robot)):
            seen = peer.observations[one]
            observation = Observation(seen.arena_run, seen.tick + 1, seen.row, Contact(met, nonce))
            code = peer.chance.randbytes(CODE_BYTES)
            peer.put(peer.arena.observation(one), encode(observation) + code)

    return shoot


def arena_tokens(peer: Hostile) -> Callable[[], None]:
    """The arena's own token, and others of its run, that come and go."""
    live = peer.session.liveliness()
    run = next(iter(peer.observations.values())).arena_run
    found = [str(reply.ok.key_expr) for reply in live.get(peer.arena.all_alive) if reply.ok]
    keys = [*found, peer.arena.alive(run, "f00d"), peer.arena.alive(run + 1, "f00d")]
    declared: list[Any] = []

    def shoot() -> None:
        if declared:
            for token in declared:
                token.undeclare()
            declared.clear()
        else:
            declared.extend(live.declare_token(key) for key in keys)

    return shoot


def impostor_arena(peer: Hostile) -> Callable[[], None]:
    """An arena of the same name with a key of its own: it grants bodies to all that ask, and sends observations."""
    identity, run = Identity(secrets.token_bytes(32)), secrets.randbelow(2**62)
    keys: dict[bytes, bytes] = {}
    token = peer.session.liveliness().declare_token(peer.arena.alive(run, "f00d"))

    def grant(query: zenoh.Query) -> None:
        with query:
            try:
                request = open_request(query.payload.to_bytes() if query.payload else b"")
                own = ExchangeKey(secrets.token_bytes(32))
                asked_run = request.message.arena_run
                granted = BodyGranted(
                    request.digest, own.public, 0, asked_run, 0, 0.05, False, "{}"
                )
                keys[request.message.robot] = keys_of_grant(own, request, granted).observations
            except (WireError, AssertionError):
                return
            query.reply(query.key_expr, sign_reply(granted, ARENA, identity))

    queryable = _declare_queryable(peer, grant)

    def shoot() -> None:
        assert token
        assert queryable
        for robot, key in list(keys.items()):
            seen = peer.observations[robot]
            observation = encode(Observation(seen.arena_run, seen.tick + 1, seen.row, None))
            peer.put(peer.arena.observation(robot), seal(key, observation))

    return shoot


def half_open(peer: Hostile) -> Callable[[], None]:
    """Connections to the colony's endpoint on which nothing is ever said."""
    host, _, port = peer.endpoint.partition("/")[2].rpartition(":")
    connections: deque[socket.socket] = deque(maxlen=HALF_OPEN)

    def shoot() -> None:
        connection = socket.socket()
        connection.setblocking(False)
        connection.connect_ex((host, int(port)))
        if len(connections) == HALF_OPEN:
            connections.popleft().close()
        connections.append(connection)

    return shoot


def long_tokens(peer: Hostile) -> Callable[[], None]:
    """Tokens with keys of 50 kB, where those of robots and arenas stand, that come and go."""
    live = peer.session.liveliness()
    declared: deque[Any] = deque()

    def shoot() -> None:
        if len(declared) == LONG_TOKENS:
            declared.popleft().undeclare()
        name = "a" * LONG_TOKEN_BYTES + f"{peer.chance.getrandbits(32):x}"
        key = peer.colony.alive(peer.chance.randbytes(16), 1, name)
        declared.append(live.declare_token(peer.chance.choice((key, peer.arena.alive(1, name)))))

    return shoot


def _declare_queryable(peer: Hostile, handle: Callable[[zenoh.Query], None]) -> Any:
    return peer.session.declare_queryable(peer.arena.all_joins, Callback(handle, indirect=False))


BODY_ATTACKS: dict[str, tuple[Callable[[Hostile], Callable[[], None]], float]] = {
    "evictions": (evictions, 200.0),
    "steering": (steering, 500.0),
    "contacts": (contacts, 200.0),
    "arena_tokens": (arena_tokens, 1.0),
    "impostor_arena": (impostor_arena, 50.0),
    "half_open": (half_open, 200.0),
    "long_tokens": (long_tokens, 20.0),
}
"""Every attack, and how many times a second it shoots."""
