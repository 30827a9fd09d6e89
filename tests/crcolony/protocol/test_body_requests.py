"""A request for a body and its reply are signed, name each other, and give both ends the same keys."""

import pytest

from crcolony.protocol.body_messages import BodyDenied, BodyGranted, Join
from crcolony.protocol.body_requests import (
    PendingRequest,
    keys_of_grant,
    open_request,
    sign_reply,
    sign_request,
)
from crcolony.protocol.codec import WireError
from crcolony.protocol.identity import arena_id, robot_id, seeded
from crcolony.protocol.link_keys import ExchangeKey

ROBOT, OTHER, ARENA = (seeded("test", 1, number) for number in range(3))
OWN, THEIRS = ExchangeKey(bytes(range(32))), ExchangeKey(bytes(range(1, 33)))
JOIN = Join(ROBOT.id, "blue", -1, 7, 1, 1, OWN.public)


def pending(arena: str = "lab") -> PendingRequest:
    return PendingRequest(JOIN, arena, ROBOT, OWN)


def granted(request: bytes) -> BodyGranted:
    return BodyGranted(request, THEIRS.public, 2, 7, 70, 0.1, False, "{}")


def test_both_ends_have_the_same_keys() -> None:
    """They follow from the exchange, and from what both have signed."""
    asked = pending()
    request = open_request(asked.data)
    assert request.is_signed("lab")
    message = granted(request.digest)
    reply = asked.open_reply(sign_reply(message, "lab", ARENA))
    assert reply.message == message
    assert reply.arena == arena_id(ARENA.public_key)
    assert reply.keys == keys_of_grant(THEIRS, request, message)


def test_a_request_is_for_one_arena() -> None:
    """Its signature is not valid for another one, nor for a mating."""
    request = open_request(pending().data)
    assert not request.is_signed("lob")
    assert not request.is_signed("")


def test_a_request_is_of_the_robot_that_signed_it() -> None:
    """In the name of another one it is refused before its signature is looked at."""
    with pytest.raises(WireError, match="not the robot's"):
        open_request(sign_request(JOIN, "lab", OTHER))


def test_a_reply_is_to_the_request_that_was_made() -> None:
    """One to another request, or for another arena, or changed on its way, is refused."""
    asked = pending()
    digest = open_request(asked.data).digest
    with pytest.raises(WireError, match="to another request"):
        asked.open_reply(sign_reply(granted(bytes(16)), "lab", ARENA))
    with pytest.raises(WireError, match="signature is not valid"):
        asked.open_reply(sign_reply(granted(digest), "lob", ARENA))
    data = bytearray(sign_reply(granted(digest), "lab", ARENA))
    data[-1] ^= 1
    with pytest.raises(WireError, match="signature is not valid"):
        asked.open_reply(bytes(data))


def test_a_denial_gives_no_keys() -> None:
    """It is signed all the same."""
    asked = pending()
    denied = BodyDenied(open_request(asked.data).digest, "full")
    reply = asked.open_reply(sign_reply(denied, "lab", ARENA))
    assert (reply.message, reply.keys) == (denied, None)


def test_an_arena_is_no_robot() -> None:
    """The ids of one key differ, so that neither can be taken for the other."""
    assert arena_id(ARENA.public_key) != robot_id(ARENA.public_key)
